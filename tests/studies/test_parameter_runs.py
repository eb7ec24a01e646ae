"""Runs that differ in a parameter, made together: each has the row that it would have alone, and faults in that are seen."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from refusals import refused

from daebench.records.comparison import DIFFERS, EQUAL, WITHIN
from daebench.records.rows import StoredRow, as_json, of_json
from daebench.records.store import opened
from daebench.studies.ensemble import energies
from daebench.studies.grid import runs_together
from daebench.studies.grid.estimate import estimate
from daebench.studies.grid.export import frame
from daebench.studies.grid.measure import measured_row, row_of
from daebench.studies.grid.reproduce import compared
from daebench.studies.grid.run_specification import GridRun, ParameterRuns
from daebench.studies.grid.runs import runs_of
from daebench.studies.grid.specification import key_of, specification_of

FAST = {"problem": "spherical_pendulum", "case": "fig1.2", "t_end": 10.0, "metrics": ("energy", "manifold", "jump"), "varied": "gravity"}
GRAVITIES = tuple(np.geomspace(0.01, 300.0, 12).tolist())
SMALL = ParameterRuns(**FAST, method="rattle", value=10 / 100, outputs=101, values=(1.0, 30.0))


def over_steps(method, counts, values=GRAVITIES, **more):
    """Return runs over gravity with each of these numbers of steps."""
    return [ParameterRuns(**FAST | more, method=method, value=10 / n, outputs=n + 1, values=values) for n in counts]


def differences(pieces):
    """Return which columns of runs made together differ from those of runs by themselves, to the bit, and the rows of the latter."""
    differing, alone = set(), []
    for some in pieces:
        together = list(some.rows(row_of(some)))
        for i, row in enumerate(together):
            alone.append(measured_row(some.run(i)))
            differing |= {name for name in row if name in some.columns and not _same(row[name], alone[-1][name])}
            assert row["gravity"] == alone[-1]["gravity"]
    return differing, alone


def _same(a, b):
    return a == b or (a != a and b != b)


def test_a_map_of_runs_in_lanes_is_that_of_runs_by_themselves():
    differing, alone = differences(over_steps("rattle", np.geomspace(16, 512, 12).astype(int).tolist()))
    assert differing == set()
    assert len(alone) == 12 * 12
    assert "bounded" in [row["energy_verdict"] for row in alone]
    assert any("did not converge" in row["failure"] for row in alone)


@pytest.mark.usefixtures("uncompiled_schemes")
def test_runs_of_other_trends_and_those_that_cannot_be_begun_are_as_by_themselves():
    differing, alone = differences(over_steps("rk4+proj", (2, 12, 40, 100), GRAVITIES[::3]))
    assert differing == set()
    assert {"undetermined", "drifts"} <= {row["energy_verdict"] for row in alone}
    refused = over_steps("rattle", (1, 20, 1 / 2), GRAVITIES[::3])
    refused.append(replace(refused[1], values=(-1.0, 0.0, 1.0), varied="mass"))
    for some in refused[:3]:
        assert differences([some])[0] == set()
    row = row_of(refused[3])
    assert [bool(why) for why in row["failure"]] == [bool(measured_row(refused[3].run(i))["failure"]) for i in range(3)]


@pytest.mark.usefixtures("uncompiled_schemes")
def test_parts_that_fit_into_memory_have_the_same_rows(monkeypatch):
    (some,) = over_steps("rattle", (80,))
    whole = row_of(some)
    for module, name, number in ((runs_together, "NUMBERS", 80 * 6 * 5), (energies, "AT_ONCE", 50)):
        monkeypatch.setattr(module, name, number)
        assert as_json(StoredRow("", some.plain(), row_of(some), "", 0.0)) == as_json(StoredRow("", some.plain(), whole, "", 0.0))


@pytest.mark.usefixtures("uncompiled_schemes")
def test_they_are_kept_as_one_row_that_is_a_row_a_run_in_exports(tmp_path):
    with opened(tmp_path / "s.db") as store:
        table = runs_of(store)([SMALL])
        assert (len(store), store.runs, len(table)) == (1, 2, 1)
        (stored,) = store.all()
        assert table["steps"][0] == stored.row["steps"] == [100, 7]
        assert as_json(of_json(as_json(stored))) == as_json(stored)
    flat = frame([stored])
    assert flat["gravity"].tolist() == [1.0, 30.0]
    assert flat["energy_error"][0] == measured_row(SMALL.run(0))["energy_error"]
    assert specification_of(json.loads(json.dumps(SMALL.plain()))) == SMALL
    assert specification_of(SMALL.run(0).plain()) == SMALL.run(0)


def test_what_decides_them_is_in_their_key():
    others = [replace(SMALL, **change) for change in ({"values": (1.0, 31.0)}, {"varied": "mass"}, {"value": 0.05}, {"outputs": 70})]
    assert len({key_of(some) for some in (SMALL, *others)}) == 5


def test_lists_are_held_against_each_other_entry_by_entry():
    old = {"g": [1.0, math.nan], "failure": ["", "a"]}
    for change, tolerance, verdict in (({}, 0.0, EQUAL), ({"failure": ["", ""]}, 1.0, DIFFERS), ({"g": [1.0]}, 1.0, DIFFERS)):
        assert compared(old, old | change, rtol=tolerance, atol=tolerance).verdict == verdict
    near = compared(old, old | {"g": [1.0 + 1e-9, math.nan]}, rtol=1e-6, atol=0.0)
    assert (near.verdict, near.column, near.archived) == (WITHIN, "g", 1.0)


def test_what_is_not_measured_of_them_is_refused():
    with refused("not-measured-together"):
        replace(SMALL, metrics=("energy", "phase"))


def test_time_is_in_proportion_to_steps_of_members_and_apart_from_that_of_runs_alone(tmp_path):
    with opened(tmp_path / "s.db") as store:
        store.put([StoredRow("alone", SMALL.run(0).plain(), {"failure": ""}, "", 100.0)])
        assert estimate([SMALL], store).like == 0
        store.put([StoredRow("together", SMALL.plain(), {"failure": ["", ""]}, "", 1.0)])
        twice = estimate([replace(SMALL, values=(1.0, 2.0, 3.0, 4.0), value=SMALL.value / 10)], store)
        assert (twice.seconds, twice.like, twice.runs) == (pytest.approx(20.0), 4, 4)
        assert isinstance(SMALL.run(0), GridRun)
