"""The command line: what it prints, what it refuses and how it exits."""

import json
import math
import os
import re
import subprocess
import sys

import numpy as np
import pytest
import typer
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from refusals import refused

import daebench as package
from daebench.cli.app import app
from daebench.runs.files import atomic

RUN = ("run", "spherical_pendulum", "--case", "fig1.1", "--method", "rattle")


def test_list_imports_nothing_heavy():
    code = "import sys, runpy; sys.argv = ['daebench', 'list']\n"
    code += "try: runpy.run_module('daebench', run_name='__main__')\nexcept SystemExit: pass\n"
    code += "print({'numpy', 'sympy', 'llvmlite', 'pandas', 'matplotlib', 'scipy', 'mpmath'} & set(sys.modules))"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert "rattle" in out
    assert out.strip().endswith("set()")


def test_show_gives_definition_cases_and_methods(daebench):
    shown = json.loads(daebench("show", "spherical_pendulum", "--json")[1])
    assert shown["definition"]["integral L3"] == "-p1*q2 + p2*q1"
    assert shown["cases"]["fig1.2"]["p"] == "3*cos(13/10), 13/2, -3*sin(13/10)"
    assert "rattle" in shown["methods"]
    assert {shown["definition"][part] for part in ("closed form", "kinetic flow", "chart")} == {"yes"}


def test_run_prints_one_json_object_with_the_numbers_of_the_end(daebench):
    status, out, err = daebench(*RUN, "--h", 0.01, "--steps", 200, "--watch", "energy,manifold,integrals", "--json")
    found = json.loads(out)
    assert (status, err) == (0, "")
    assert (found["steps"], found["t"], found["h"], found["failure"]) == (200, 2.0, 0.01, None)
    assert 0 < found["max_energy_error"] < 1e-6
    assert (found["g"] < 1e-14, found["integrals"]["L3"] < 1e-15) == (True, True)
    q, p = np.array(found["q"]), np.array(found["p"])
    assert found["lam"] == pytest.approx([(p @ p - q[2]) / (2 * q @ q)], rel=1e-12)
    assert found["energy"] == pytest.approx(p @ p / 2 + q[2], rel=1e-14)
    trajectory = package.run("spherical_pendulum", case="fig1.1", method="rattle", h=0.01, steps=200)
    assert list(trajectory.q[-1]) == found["q"]


def test_raw_multipliers_go_beside_a_csv_and_into_an_npz(daebench, tmp_path):
    for ending in ("csv", "npz"):
        assert daebench(*RUN, *["--h", "0.1", "--steps", "5", "--raw", "--compensated", "--out"], tmp_path / f"run.{ending}")[0] == 0
    table = np.genfromtxt(tmp_path / "run.raw.csv", delimiter=",", names=True, dtype=None, encoding="ascii")
    with np.load(tmp_path / "run.npz") as arrays:
        for name in ("lam_n", "mu_n", "mean"):
            rows = table[table["multiplier"] == name]
            assert np.array_equal(rows["t"], arrays[f"raw_{name}_t"])
            assert np.array_equal(rows["lam1"], arrays[f"raw_{name}"][:, 0])


def stored(path, vector):
    """Return times and rows of a vector, q or y, in a file of either kind."""
    if path.suffix == ".npz":
        with np.load(path) as arrays:
            return arrays["t"].tolist(), arrays[vector].tolist()
    table = np.genfromtxt(path, delimiter=",", names=True)
    names = [name for name in table.dtype.names if name.startswith(vector)]
    assert names == [f"{vector}{i}" for i in range(1, len(names) + 1)]
    return table["t"].tolist(), np.column_stack([table[name] for name in names]).tolist()


BODY = "run free_rigid_body --method strang --h 0.1 --steps 50"


@pytest.mark.parametrize("ending", ["csv", "npz"])
def test_out_holds_the_trajectory_with_all_its_digits(daebench, tmp_path, ending):
    path = tmp_path / f"run.{ending}"
    end = json.loads(daebench(*RUN, "--h", 0.01, "--steps", 50, "--every", 20, "--out", path, "--lam", "--json")[1])
    for vector in ("q", "p", "lam"):
        t, rows = stored(path, vector)
        assert (t, rows[-1]) == ([0.0, 0.2, 0.4, 0.5], end[vector])
    assert {each.name for each in tmp_path.iterdir()} == {path.name, f"{path.name}.txt"}
    end = json.loads(daebench(*BODY.split(), "--every", 20, "--out", path, "--json")[1])
    t, rows = stored(path, "y")
    assert (t, rows[0], rows[-1]) == ([0.0, 2.0, 4.0, 5.0], [math.cos(1.1), 0.0, math.sin(1.1)], end["y"])


def test_a_run_without_solution_exits_1_and_keeps_what_it_has(daebench, tmp_path):
    path = tmp_path / "run.csv"
    words = "run spherical_pendulum --case fig1.2 --method se --h 0.01 --steps 1000 --json --out"
    status, out, _ = daebench(*words.split(), path)
    found = json.loads(out)
    assert (status, "t = 0.94" in found["failure"]) == (1, True)
    assert len(path.read_text().splitlines()) == 2 + found["steps"]


numbers = st.one_of(st.sampled_from(["0", "-1", "nan", "inf", "1e-300", "1e300", "0.5", "x", ""]), st.floats(width=32).map(str))
extras = st.sampled_from(
    ["--project", "--json", "--lam", "--watch=none", "--watch=,", "--every=0", "--every=-3", "--q0=1", "--p0=a,b,c", "--param=="]
)


counts = st.one_of(st.integers(-5, 50).map(str), st.sampled_from(["1e3", "99999999999999999999", "two"]))


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(h=numbers, steps=counts, more=st.lists(extras, max_size=2))
def test_no_words_on_the_command_line_bring_a_traceback(daebench, h, steps, more):
    status, out, err = daebench(*RUN, f"--h={h}", f"--steps={steps}", "--every=0", *more)
    assert status in (0, 1, 2)
    assert "Traceback" not in err
    assert status != 2 or (out == "" and err.count("\n") == 1)
    if status == 0 and "--json" in more:
        found = json.loads(out)
        assert found["failure"] is None
        assert all(math.isfinite(x) for x in found["q"])


def test_a_device_is_never_replaced_by_a_file(tmp_path):
    fifo = tmp_path / "fifo.csv"
    os.mkfifo(fifo)
    with refused("not-a-regular-file"), atomic(fifo):
        pass
    assert fifo.is_fifo()


def test_help_is_short_too_and_all_names_are_seen(daebench):
    assert daebench("run", "-h")[1] == daebench("run", "--help")[1]
    assert {*package.__all__, "joints"} <= set(dir(package))
    assert package.__version__ in daebench("--version")[1]


def commands(group):
    """Yield all commands, those of groups too."""
    for each in group.commands.values():
        yield from commands(each) if hasattr(each, "commands") else [each]


def test_no_help_has_words_in_brackets_which_would_be_taken_for_a_style_and_left_out():
    texts = [
        text for each in commands(typer.main.get_command(app)) for text in (each.help, *(x.help for x in each.params if hasattr(x, "help")))
    ]
    assert len(texts) > 50
    assert [text for text in texts if text and re.search(r"\[[a-z]", text)] == []
