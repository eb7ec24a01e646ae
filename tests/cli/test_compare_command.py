"""``daebench compare``: its one JSON object, and its table, which fits 80 columns whatever the methods."""

import itertools
import json
import sys

import pandas as pd
import pytest

from daebench.cli import picture_file
from daebench.cli.summary import print_part
from daebench.studies.comparison.table import WIDTH, narrow, notes

COMMANDS = {
    "certified": "planar_pendulum --case rotating --h 0.05 --t-end 3 --methods rattle,rk4+proj,scipy:DOP853",
    "parameter": "planar_pendulum --h 0.02 --t-end 1 --param gravity=3 --methods implicit_euler,rattle/suzuki4",
    "one stops": "spherical_pendulum --case fig1.2 --h 0.01 --t-end 2 --methods se,rattle",
    "a file": "./ring.py --h 0.05 --t-end 1 --methods rattle,ida:ggl",
    "poisson": "lotka_volterra --case 4,2 --anyway --h 0.05 --t-end 2 --methods strang,midpoint/kahan_li8,rk4",
    "by tolerance": "free_rigid_body --t-end 2 --tol 1e-4 --methods scipy:RK45",
}
VERDICTS = ("kept", "bounded", "drifts", "undetermined", "failed")


@pytest.fixture
def plain(plain_functions, uncompiled_schemes, uncompiled_poisson_schemes, folder):
    """Have everything run uncompiled, in a folder with a problem file."""


def _refuse(name):
    raise AssertionError(f"{name} is no JSON")


@pytest.mark.sampled(left_out=("parameter", "by tolerance"))
@pytest.mark.parametrize("words", COMMANDS.values(), ids=COMMANDS)
def test_json_is_one_object_with_a_row_a_method(daebench, plain, words):
    status, out, err = daebench("compare", *words.split(), "--json")
    found = json.loads(out, parse_constant=_refuse)
    assert all(" % after " in line for line in err.splitlines())  # how far it is, where it takes long
    assert (found["problem"], out.count("\n")) == (words.split()[0], 1)
    assert [row["method"] for row in found["rows"]] == words.split()[-1].split(",")
    assert status == any(row["failure"] is not None for row in found["rows"])
    for row in found["rows"]:
        assert ("h" in row) != ("tol" in row)
        assert row["energy_verdict"] in VERDICTS
        assert (row["energy_verdict"] == "failed") == (row["failure"] is not None)
        assert bool(row["energy_reason"]) == (row["energy_verdict"] in ("undetermined", "failed"))
        assert f"--t-end {row['t_end']:g} " in words
        assert (row["position_error"] is None) == (row["failure"] is not None or row["position_reference"].startswith("unknown"))


def test_what_is_printed_fits_80_columns_and_says_what_positions_are_held_against(daebench, plain):
    _, out, _ = daebench("compare", *COMMANDS["one stops"].split())
    failures = [line for line in out.splitlines() if "stopped at t" in line]  # each a sentence for itself
    assert max(len(line) for line in out.splitlines() if line not in failures) <= 80
    assert "certified spherical_pendulum-fig1.2" in " ".join(out.split())


NAN = float("nan")
LONG = ("rattle", "radau3_index2", "baumgarte:gauss6+symproj", "generalized_alpha")
LONG += ("./folder/of/mine/my_own_stepper.so:step", "ida:baumgarte:atol")
EXTREME = (1.2345678e-300, 29217.293692, NAN, 0.0, 1.5)


def made(methods, k):
    """Return a table as a comparison has it, with numbers as long as they get."""
    rows = []
    for j, method in enumerate(methods):
        error, bound = EXTREME[(j + k) % 5], EXTREME[(j + k + j % 2) % 5]
        row = {"method": method} | ({"tol": 1.2345e-13} if ":" in method else {"h": 0.0123456})
        row |= {"energy_error": error, "energy_size": 1e3 * error, "energy_verdict": VERDICTS[(j + k) % 5], "position_error": error}
        row |= {"position_bound": bound, "position_reference": "" if j % 3 == 2 else f"certified two_bodies_on_sphere-case {j % 2}"}
        rows.append(row | {"seconds": 12345.6789, "failure": None})
    return pd.DataFrame(rows)


def test_the_table_fits_80_columns_for_every_subset_of_methods(capsys):
    for k, methods in enumerate(itertools.chain(*(itertools.combinations(LONG, n) for n in range(1, len(LONG) + 1)))):
        table = made(methods, k)
        print_part(narrow(table))
        printed = [*capsys.readouterr().out.splitlines(), *itertools.chain(*(note.splitlines() for note in notes(table)))]
        assert max(map(len, printed)) <= WIDTH, printed
        letters = "".join(line.split("  ")[0].strip() for line in printed)
        assert all(method in letters for method in methods)  # folded, never cut


@pytest.mark.parametrize("problem", ["planar_pendulum", pytest.param("lotka_volterra", marks=pytest.mark.exhaustive)])
def test_a_solver_that_is_not_installed_loses_no_other_row(daebench, monkeypatch, problem):
    monkeypatch.setitem(sys.modules, "heyoka", None)
    words = "--methods heyoka:taylor,scipy:RK23 --t-end 1 --tol 1e-3 --json"
    status, out, _ = daebench("compare", problem, *words.split())
    absent, there = json.loads(out)["rows"]
    assert (status, "heyoka" in absent["failure"], there["failure"], there["t_reached"]) == (1, True, None, 1.0)
    assert (absent["energy_error"], absent["steps"], absent["t_reached"]) == (None, 0, 0.0)


def test_an_error_within_the_bound_of_its_reference_and_a_lost_motion_are_called_so(capsys):
    table = made(["rattle"], 1).assign(position_error=1e-9, energy_size=0.5)
    for changed, sign in (({"position_bound": 1e-9}, "<"), ({"energy_size": 2.0, "energy_verdict": "bounded"}, "lost")):
        for columns in (changed, {"position_bound": 1e-10}):
            print_part(narrow(table.assign(**{"position_bound": 1e-10} | columns)))
            assert (sign in capsys.readouterr().out) == (columns is changed)


PICTURE = ["compare", "planar_pendulum", "--methods", "rattle,rk4", "--h", "0.05", "--t-end", "1", "--out"]


def test_a_picture_alone_has_its_size_names_and_data(daebench, plain, folder):
    status, out, _ = daebench(*PICTURE, *["slide.svg", "--size", "16x9", "--labels", "mine,theirs", "--colors", "black,#0072b2"])
    assert (status, "slide.svg" in out, "slide.csv" in out) == (0, True, True)
    svg = (folder / "slide.svg").read_text(encoding="utf-8")
    assert 'width="1152pt" height="648pt"' in svg
    assert "#0072b2" in svg
    assert set(pd.read_csv(folder / "slide.csv")["method"]) == {"rattle", "rk4"}
    assert daebench(*PICTURE, "page.pdf")[0] == 0
    assert (folder / "page.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.slow
def test_the_panels_of_a_picture_are_those_that_are_chosen_in_that_order(daebench, plain, folder, monkeypatch):
    drawn = []
    save = picture_file.save_picture
    monkeypatch.setattr(picture_file, "save_picture", lambda figure, path: (drawn.append(figure), save(figure, path)))
    titles = lambda figure: [axis.get_title(loc="left") for axis in figure.axes]  # noqa: E731
    assert daebench(*PICTURE, "two.svg", "--panels", "Gv,energy_error")[0] == 0
    assert titles(drawn[-1]) == ["velocities $|G H_p|$", "energy error $|H - H_0|$"]
    assert daebench(*PICTURE, "all.svg")[0] == 0
    assert titles(drawn[-1]) == ["energy error $|H - H_0|$", "constraint $|g(q)|$", "velocities $|G H_p|$"]
