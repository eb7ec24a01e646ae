"""``daebench run --sensitivities``: what it prints and writes, and what it refuses."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from daebench.cli.summary import _by

RUN = ("run", "planar_pendulum", "--case", "horizontal", "--method", "rattle", "--h", 0.1, "--steps", 20)
NAMES = ("--sensitivities", "length,gravity,p0,q0")


@pytest.fixture
def printed(daebench):
    """Return what a run prints as JSON."""
    status, out, _ = daebench(*RUN, *NAMES, "--json")
    assert status == 0
    return json.loads(out)


def test_json_has_the_derivatives_at_the_end_by_what_they_are_taken_by(printed):
    assert list(printed["sensitivities"]) == ["length", "gravity", "p0", "q0"]
    assert np.shape(printed["sensitivities"]["gravity"]["p"]) == (2,)
    assert np.shape(printed["sensitivities"]["q0"]["q"]) == (2, 2)


def test_the_table_has_a_line_for_each_derivative_by_one_number(daebench, printed):
    _, out, _ = daebench(*RUN, *NAMES)
    lines = [line.split() for line in out.splitlines()]
    shown = {words[0]: [float(word.rstrip(",")) for word in words[1:]] for words in lines if words and words[0].startswith(("dq/", "dp/"))}
    assert list(shown) == [f"d{part}/d{name}" for name in ("length", "gravity") for part in "qp"] + [
        f"d{part}/d{name}_{j}" for name in ("p0", "q0") for part in "qp" for j in (1, 2)
    ]
    assert np.allclose(shown["dq/dgravity"], printed["sensitivities"]["gravity"]["q"], rtol=1e-14)
    assert np.allclose(shown["dp/dq0_2"], np.array(printed["sensitivities"]["q0"]["p"])[:, 1], rtol=1e-14)


def test_files_have_the_derivatives_at_all_times(daebench, printed, tmp_path):
    for ending in ("csv", "npz"):
        assert daebench(*RUN, *NAMES, "--every", 5, "--out", tmp_path / f"run.{ending}")[0] == 0
    table = np.genfromtxt(tmp_path / "run.csv", delimiter=",", names=True)
    with np.load(tmp_path / "run.npz") as stored:
        arrays = dict(stored)
    assert len(table) == 5
    assert arrays["dq_dq0"].shape == (5, 2, 2)
    assert np.array_equal(table["dq1_dgravity"], arrays["dq_dgravity"][:, 0])
    assert np.array_equal(table["dp2_dq0_1"], arrays["dp_dq0"][:, 1, 0])
    assert np.array_equal(arrays["dq_dq0"][-1], printed["sensitivities"]["q0"]["q"])


def test_a_system_in_time_has_no_row_and_no_column_of_the_time_but_one_of_the_energy_received(random):
    """Its time and p_t, minus the energy received, are the last position and momentum of its states."""
    where = SimpleNamespace(facts=SimpleNamespace(KIND="constrained", EXTENDED=True))
    by = {part: random.standard_normal((4, 3, 3)) for part in ("q", "p")}
    shown = _by(where, "q0", by)
    assert list(shown) == ["q", "p", "energy_received"]
    assert np.array_equal(shown["q"], by["q"][-1, :2, :2])
    assert np.array_equal(shown["p"], by["p"][-1, :2, :2])
    assert np.array_equal(shown["energy_received"], -by["p"][-1, 2:, :2])
    by_parameter = _by(where, "gravity", {part: rows[:, :, 0] for part, rows in by.items()})
    assert np.array_equal(by_parameter["q"], by["q"][-1, :2, 0])
    assert np.array_equal(by_parameter["energy_received"], -by["p"][-1, 2:, 0])
