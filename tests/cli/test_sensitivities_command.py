"""``daebench run --sensitivities``: what it prints and writes, and what it refuses."""

import json
from types import SimpleNamespace

import numpy as np

from daebench.cli.summary import _by

RUN = "run planar_pendulum --case horizontal --method rattle --h 0.1 --steps 20 --every 5 --sensitivities length,gravity,p0,q0"


def test_json_and_files_have_the_derivatives_by_what_they_are_taken_by(daebench, tmp_path):
    for ending in ("csv", "npz"):
        status, out, _ = daebench(*RUN.split(), "--out", tmp_path / f"run.{ending}", "--json")
        assert status == 0
    table, shown = np.genfromtxt(tmp_path / "run.csv", delimiter=",", names=True), json.loads(out)["sensitivities"]
    assert list(shown) == ["length", "gravity", "p0", "q0"]
    with np.load(tmp_path / "run.npz") as stored:
        arrays = dict(stored)
    assert arrays["dq_dq0"].shape == (5, 2, 2)
    assert np.array_equal(table["dq1_dgravity"], arrays["dq_dgravity"][:, 0])
    assert np.array_equal(table["dp2_dq0_1"], arrays["dp_dq0"][:, 1, 0])
    assert np.array_equal(arrays["dq_dq0"][-1], shown["q0"]["q"])
    lines = [line.replace(",", "").split() for line in daebench(*RUN.split())[1].splitlines()]
    printed = {words[0]: np.array(words[1:], dtype=float) for words in lines if words and words[0][:3] in ("dq/", "dp/")}
    assert np.allclose(printed["dp/dq0_2"], arrays["dp_dq0"][-1, :, 1], rtol=1e-14)
    assert len(printed) == 12
    assert np.array_equal(arrays["dp_dgravity"][-1], shown["gravity"]["p"])


def test_a_system_in_time_has_no_row_and_no_column_of_the_time_but_one_of_the_energy_received(random):
    """Its time and p_t, minus the energy received, are the last position and momentum of its states."""
    where = SimpleNamespace(facts=SimpleNamespace(KIND="constrained", EXTENDED=True))
    by = {part: random.standard_normal((4, 3, 3)) for part in ("q", "p")}
    of_gravity = {part: rows[:, :, 0] for part, rows in by.items()}
    for shown, columns in ((_by(where, "q0", by), slice(2)), (_by(where, "gravity", of_gravity), 0)):
        assert list(shown) == ["q", "p", "energy_received"]
        assert np.array_equal(shown["q"], by["q"][-1, :2, columns])
        assert np.array_equal(shown["p"], by["p"][-1, :2, columns])
        assert np.array_equal(shown["energy_received"], -by["p"][-1, 2:, columns])
