"""Work against precision: which runs are made, which method is called the cheapest, and what the command says."""

import json

import numpy as np
import pandas as pd
import pytest

from daebench.catalogue import problems
from daebench.errors import BadInput
from daebench.reference.certified import store
from daebench.studies.work_precision import cheapest, standard, with_costs


def power_law(method, order, price, floor=1e-15):
    """Return runs whose error is h^order, at this price a step."""
    h = 0.5 ** np.arange(12)
    return pd.DataFrame({"method": method, "value": h, "error_q": h**order, "bound_q": floor, "seconds": price / h, "failure": ""})


def test_the_cheapest_is_the_one_that_the_power_laws_say():
    table = pd.concat([power_law("low", 2, 1.0), power_law("high", 4, 10.0)])
    found = cheapest(table, "error_q", "seconds", [1e-1, 1e-3]).set_index("level")
    # h^2 costs level^(-1/2), h^4 costs 10 level^(-1/4): the same at 1e-4 h
    assert list(found["method"]) == ["low", "low"]
    assert found.loc[1e-3, "seconds"] == pytest.approx(1e-3**-0.5, rel=1e-9)
    assert found.loc[1e-3, "ratio"] == pytest.approx(10 * 1e-3**-0.25 / 1e-3**-0.5, rel=1e-9)
    (fine,) = cheapest(table, "error_q", "seconds", [1e-5]).itertuples()
    assert (fine.method, fine.next) == ("high", "low")
    assert fine.ratio == pytest.approx(1e-5**-0.5 / (10 * 1e-5**-0.25), rel=1e-9)


def test_a_level_that_nobody_reaches_has_no_row_and_errors_count_as_their_bound():
    table = power_law("one", 2, 1.0, floor=1e-5)
    assert list(cheapest(table, "error_q", "seconds", [1e-4, 1e-6])["level"]) == [1e-4]


def test_failed_and_untimed_runs_do_not_count():
    table = power_law("one", 2, 1.0)
    table.loc[table["error_q"] <= 1e-2, "seconds"] = np.nan
    assert cheapest(table, "error_q", "seconds", [1e-3]).empty
    assert not cheapest(table, "error_q", "seconds", [1e-1]).empty


def test_evaluations_leave_out_what_evaluates_nothing():
    table = pd.DataFrame(
        {"n_H_p": [2.0], "n_G": [3.0], "n_solve": [100.0], "n_newton": [100.0], "n_steps": [100.0], "n_residual": [np.nan]}
    )
    assert with_costs(table)["evaluations"].tolist() == [5.0]


@pytest.mark.parametrize("name", [each for each in problems() if any(x.startswith(f"{each}-") for x in store.names())])
def test_the_standard_study_of_a_problem_can_be_made(name):
    case = next(x for x in store.names() if x.startswith(f"{name}-")).removeprefix(f"{name}-")
    study, left_out = standard(name, case=case)
    cells = study.cells()
    assert {cell.method for cell in cells}.isdisjoint(left_out)
    assert len({cell.method for cell in cells}) >= 5
    assert all(why.endswith(".") for why in left_out.values())
    times = store.find(name, case).t
    for cell in cells:
        if cell.solver.knob == "h":
            assert cell.value * round(times[1] / cell.value) == times[1]


def test_a_case_without_a_reference_is_refused():
    with pytest.raises(BadInput, match="there is no reference torus-inner"):
        standard("torus", case="inner")


def test_the_command_keeps_its_runs_and_names_a_winner(daebench, tmp_path, monkeypatch):
    words = ("work-precision", "planar_pendulum", "--case", "rotating", "--methods", "scipy:DOP853,scipy:RK45", "--tol", "1e-4,1e-6,1e-8")
    words = (*words, "--repeat", 0, "--workers", 1, "--out", tmp_path)
    status, out, _ = daebench(*words, "--dry-run")
    assert (status, out.split(",")[0]) == (0, "6 runs")
    assert "6 to make: about 1 s in one process (an estimate" in out
    status, out, err = daebench(*words, "--json")
    assert (status, err) == (0, "")
    found = json.loads(out)
    assert found["runs"] == 6
    table = pd.read_csv(tmp_path / "work_precision.csv")
    for each in found["best"]:
        own = table[(table["method"] == each["method"]) & (table["value"] == each["value"])]
        assert own["error_q"].item() <= each["level"]
        assert own["evaluations"].item() >= each["evaluations"]
    assert {path.name for path in tmp_path.iterdir()} >= {"studies.db", "work_precision.csv", "work_precision_error_q.svg"}
    assert "6 of them kept" in daebench(*words, "--dry-run")[1]
    monkeypatch.setattr("daebench.studies.cell.made_by", lambda: "another version")
    again = "6 kept runs are of another version of daebench, of a library or of the problem, and made again."
    assert again in daebench(*words, "--dry-run")[1]
    assert again in daebench(*words)[1]
    assert again not in daebench(*words)[1]


def test_runs_without_times_are_made_by_processes(daebench, tmp_path):
    words = ("work-precision", "planar_pendulum", "--case", "rotating", "--methods", "scipy:RK45", "--tol", "1e-4,1e-6", "--repeat", 0)
    status, _, err = daebench(*words, "--workers", 2, "--out", tmp_path)
    assert (status, err) == (0, "")
    daebench(*words, "--workers", 1, "--out", tmp_path / "here")
    there, here = (pd.read_csv(folder / "work_precision.csv") for folder in (tmp_path, tmp_path / "here"))
    assert there.equals(here)


PENDULUM = ("planar_pendulum", "--case", "rotating")


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("torus", "--case", "inner"), "there is no reference torus-inner"),
        ((*PENDULUM, "--error", "error_z"), "unknown column 'error_z'"),
        ((*PENDULUM, "--t-end", "1e6"), "which ends at t ="),
        ((*PENDULUM, "--methods", "rattle", "--tol", "1e-3"), "tol"),
        ((*PENDULUM, "--workers", "0"), "--workers 0 must be at least 1"),
        ((*PENDULUM, "--workers", "2", "--scheduler", "tcp://a:1"), "leave out one of them"),
        ((*PENDULUM, "--workers", "2", "--repeat", "1"), "runs that are timed are made one at a time"),
        ((*PENDULUM, "--scheduler", "tcp://a:1", "--repeat", "1"), "runs that are timed are made one at a time"),
    ],
    ids=["no-reference", "column", "too-long", "useless", "no-workers", "two-places", "timed-beside", "timed-elsewhere"],
)
def test_bad_input_is_one_sentence(daebench, tmp_path, words, sentence):
    status, out, err = daebench("work-precision", "--repeat", 0, "--out", tmp_path / "new", *words)
    assert (status, out) == (2, "")
    assert sentence in err
    assert err.count("\n") == 1
