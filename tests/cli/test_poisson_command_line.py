"""Poisson systems on the command line and from Python: as constrained ones, with y in the place of q and p."""

import json
import math

import numpy as np
import pandas as pd
import pytest
import sympy as sp

import daebench as package

LOTKA = ["run", "lotka_volterra", "--case", "4,2", "--method", "strang", "--h", "0.1"]
BODY = ["run", "free_rigid_body", "--method", "strang", "--h", "0.1", "--steps", "50"]


def strang(u, v, h, steps):
    """Return (4.6) for predator and prey, written from the book: half a step of u' = u (v - 2), one of v' = v (1 - u), half a step."""
    for _ in range(steps):
        u *= math.exp(h / 2 * (v - 2))
        v *= math.exp(h * (1 - u))
        u *= math.exp(h / 2 * (v - 2))
    return u, v


def energy(u, v):
    return u - math.log(u) + v - 2 * math.log(v)


def test_run_prints_one_json_object_with_y_for_q_and_p(daebench):
    status, out, err = daebench(*LOTKA, "--steps", 100, "--watch", "energy,casimirs,integrals", "--json")
    found = json.loads(out)
    assert (status, err) == (0, "")
    assert (found["steps"], found["t"], found["h"], found["tol"], found["failure"]) == (100, 10.0, 0.1, None, None)
    assert found["y"] == pytest.approx(strang(4.0, 2.0, 0.1, 100), rel=1e-12)
    assert found["energy"] == pytest.approx(energy(*found["y"]), rel=1e-14)
    assert found["energy_error"] == pytest.approx(found["energy"] - energy(4, 2), abs=1e-14)
    assert abs(found["energy_error"]) <= found["max_energy_error"] < 0.1


def test_casimir_functions_are_watched_by_default_and_named(daebench):
    found = json.loads(daebench(*BODY, "--json")[1])
    assert list(found["casimirs"]) == ["C"]
    assert found["casimirs"]["C"] < 1e-14 < 1e-6 < found["max_energy_error"]
    assert json.loads(daebench(*BODY, "--watch", "none", "--json")[1])["casimirs"] == {}


def test_a_run_that_leaves_the_domain_exits_1_with_the_time_and_keeps_what_it_has(daebench, tmp_path):
    path = tmp_path / "run.csv"
    words = "run lotka_volterra --case 4,2 --method rk4 --h 0.9 --steps 1000 --json --out"
    status, out, _ = daebench(*words.split(), path)
    found = json.loads(out)
    rows = np.genfromtxt(path, delimiter=",", names=True)
    assert (status, f"t = {found['t']:.9g}" in found["failure"], "domain" in found["failure"]) == (1, True, True)
    assert (len(rows), rows["t"][-1]) == (found["steps"] + 1, found["t"])
    assert min(rows["y1"].min(), rows["y2"].min()) > 0


def test_compare_has_a_column_for_each_casimir_function_and_no_constraints(daebench, tmp_path):
    words = "compare free_rigid_body --methods strang@top,midpoint,rk4 --anyway --h 0.2 --t-end 40 --out"
    assert daebench(*words.split(), tmp_path)[0] == 0
    table = pd.read_csv(tmp_path / "comparison.csv", index_col="method")
    assert not {"g", "Gv"} & {*table}
    assert table["C"].drop("rk4").max() < 1e-13 < table["C"]["rk4"]
    assert table["energy_error"]["midpoint"] < 1e-13 < table["energy_error"]["strang@top"]
    drawn = pd.read_csv(tmp_path / "comparison_drift.csv")
    assert list(drawn) == ["method", "t", "energy_error", "casimir_error"]
    assert drawn["casimir_error"].max() == pytest.approx(table["C"]["rk4"], rel=1e-2)


def test_show_gives_structure_cases_and_methods_with_reasons(daebench):
    shown = json.loads(daebench("show", "free_rigid_body", "--json")[1])
    definition = {
        "B": "[[0, -y3, y2], [y3, 0, -y1], [-y2, y1, 0]]",
        "Casimir C": "y1**2/2 + y2**2/2 + y3**2/2",
        "splitting 132": "T1, then T3, then T2",
        "closed form": "yes",
        "canonical coordinates": "yes",
        "lift": "rigid_body_rotation",
    }
    assert (shown["kind"], shown["definition"] | definition) == ("poisson", shown["definition"])
    assert shown["cases"]["symmetric"].items() >= {"y": "cos(11/10), 0, sin(11/10)", "parameters": {"I1": 0.8, "I2": 0.8}}.items()
    assert {"strang", "rk4", "darboux:verlet"} <= {*shown["methods"]}
    assert {"midpoint", "verlet"} <= {*shown["refused"]}


def oscillator():
    """Return a canonical system in disguise, B = 2 J and H = (u^2 + v^2)/4: a rotation by the angle t."""
    u, v = sp.symbols("u v", real=True)
    case = package.PoissonCase(y=(1, 0))
    return package.PoissonSystem(y=(u, v), B=sp.Matrix([[0, 2], [-2, 0]]), H=(u**2 + v**2) / 4, cases={"one": case})


def test_a_system_made_in_the_process_goes_wherever_a_name_goes():
    run = package.run(oscillator(), method="midpoint", h=0.1, steps=10)
    angle = 10 * 2 * math.atan(0.05)  # the midpoint rule turns by this, HLW VI.3
    assert run.y[-1] == pytest.approx([math.cos(angle), -math.sin(angle)], rel=1e-13)
    assert list(package.compare(oscillator(), methods=["midpoint"], h=0.1, t_end=10)["failure"]) == [None]
    assert package.run(oscillator(), method="midpoint", h=0.1, steps=10, y0=[0, 0]).y.tolist() == [[0, 0]] * 11
