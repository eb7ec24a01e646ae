"""Ensembles: what is stored and measured of members, held against runs of their own and against numbers that are known."""

from collections import Counter

import definitions
import numpy as np
import pytest
from refusals import refused

import daebench
from daebench.compiler.definition import source_of
from daebench.diagnostics.energy_verdict import energy_verdict
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.runs.make_ivp import make_ivp
from daebench.runs.members import members
from daebench.starts.members import Starts

FEW = {"case": "horizontal", "method": "rattle", "h": 0.1, "members": 12, "lanes": 4, "threads": 1}


class Given:
    """Starts that a test gives."""

    def __init__(self, *start, h=0.1, **parameters):
        self.start, self.h, self.parameters = start, h, parameters

    def draw(self, ivp, n, h, parameters=None, seed=0):
        return Starts(members(ivp, self.start, self.h, self.parameters), "Given starts.")


@pytest.fixture(scope="module")
def swings():
    return daebench.ensemble("planar_pendulum", t_end=5, points=11, seed=3, **FEW)


def test_states_energies_and_constraints_are_those_of_each_member_by_itself(swings):
    assert swings.q.shape == swings.p.shape == (11, 12, 2)
    for i in (0, 5, 11):
        alone = daebench.run(swings.run.members.member(i), method="rattle", h=0.1, steps=50, every=5)
        assert np.array_equal(alone.q, swings.q[:, i])
        assert np.array_equal(alone.p, swings.p[:, i])
        assert np.array_equal(alone.t, swings.t)
        H = [swings.ivp.value("H", p, q) for p, q in zip(alone.p, alone.q, strict=True)]
        g = [np.max(np.abs(swings.ivp.value("g", q))) for q in alone.q]
        assert np.allclose(swings.energy_errors[:, i], np.array(H) - H[0], rtol=0, atol=1e-15)
        assert np.allclose(swings.constraint_errors[:, i], g, rtol=0, atol=1e-16)
        assert swings.run.maxima["energy"][i] == alone.maxima["energy"]


def test_starts_are_on_the_manifold_and_follow_the_seed(swings):
    assert np.max(swings.constraint_errors[0]) < 1e-15
    again = daebench.ensemble("planar_pendulum", t_end=5, points=11, seed=3, **FEW)
    other = daebench.ensemble("planar_pendulum", t_end=5, points=11, seed=4, **FEW)
    assert np.array_equal(again.y, swings.y)
    assert not np.any(np.all(other.y[0] == swings.y[0], axis=1))


def test_spread_and_quantiles_are_those_of_the_definitions(swings):
    q = swings.q[-1]
    assert swings.spread[-1] == pytest.approx(np.sqrt(np.mean(np.sum((q - q.mean(axis=0)) ** 2, axis=1))), rel=1e-14)
    numbers = np.array([[3.0, 1.0, 2.0, np.nan, 5.0, 4.0], [np.nan] * 6])
    quantiles = swings.quantiles(numbers, (0.25, 0.5, 1.0))
    assert quantiles[:, 0].tolist() == [2.0, 3.0, 5.0]
    assert np.all(np.isnan(quantiles[:, 1]))
    table = swings.bands
    assert table["energy_q50"].iloc[-1] == pytest.approx(np.median(swings.energy_errors[-1]), rel=1e-14)
    assert table["members"].tolist() == [12] * 11


@pytest.mark.usefixtures("uncompiled_schemes")
@pytest.mark.filterwarnings("ignore::daebench.errors.LostMotion")
def test_verdicts_are_those_of_each_member_by_itself():
    """Of a step that is too large for some, with starts of one energy: swings, turns, and one that is too fast."""
    where = initial_value_problem("planar_pendulum", "horizontal")
    angles, speeds = np.array([0.5, 1.5, 3.0, 0.1, 1.0]), np.array([0.0, 0.5, 4.0, 0.0, 40.0])
    q = np.stack([np.sin(angles), -np.cos(angles)], axis=1)
    p = speeds[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    for method in ("rk4", "rattle"):
        some = daebench.ensemble(where, method=method, h=0.3, steps=400, points=401, starts=Given(p, q, h=0.3), lanes=1)
        problems = [some.run.members.member(i) for i in range(5)]
        expected = [energy_verdict(ivp, daebench.run(ivp, method=method, h=0.3, steps=400)).verdict for ivp in problems]
        assert some.verdicts.tolist() == expected
        assert len(set(expected)) > 1
        assert some.summary()["verdicts"] == dict(Counter(expected))


def test_members_that_stop_are_counted_by_reason_and_leave_the_statistics():
    where = initial_value_problem("planar_pendulum", "horizontal")
    start = tuple(np.repeat(vector[None], 6, axis=0) for vector in where.start)
    sizes = np.array([0.1, 5.0, 0.1, 0.1, 5.0, 0.1])
    run = daebench.ensemble("planar_pendulum", **FEW, steps=40, points=5, starts=Given(*start, h=sizes), on_singular="stop")
    lost = sizes > 1
    assert run.reasons == {"no convergence": 2}
    assert [run.run.reason(i) for i in range(6)] == ["no convergence" if each else "" for each in lost]
    assert run.bands["members"].iloc[[0, -1]].tolist() == [6, 4]
    assert run.end_table["steps"].tolist() == np.where(lost, 0, 40).tolist()
    assert np.all(np.isfinite(run.spread))
    assert run.summary().items() >= {"members": 6, "failed": 2, "steps": 40}.items()


def test_a_loss_of_rank_is_named_as_one():
    where = make_ivp(source_of(definitions.bowed(0.0), "bowed"), "in")
    start = tuple(np.repeat(vector[None], 3, axis=0) for vector in where.start)
    run = daebench.ensemble(where, method="rattle", h=0.03, steps=60, starts=Given(*start, h=0.03), members=3, lanes=4)
    assert run.reasons == {"G loses rank": 3}


def test_poisson_systems_have_states_y_and_the_changes_of_their_casimirs(tmp_path):
    tops = daebench.ensemble("free_rigid_body", method="midpoint", anyway=True, h=0.1, steps=20, members=5, points=3, lanes=4)
    assert tops.kept == "casimirs"
    y = tops.run.ends
    assert tops.constraint_errors[-1] == pytest.approx(np.abs(np.sum(y**2, axis=1) - np.sum(tops.y[0] ** 2, axis=1)) / 2, abs=1e-15)
    assert list(tops.start_table) == ["member", "h", "y1", "y2", "y3"]
    with pytest.raises(AttributeError, match="is a Poisson system, which has states y"):
        _ = tops.q
    assert {path.suffix for path in tops.write(tmp_path) if path.is_file()} == {".csv", ".svg"}


def test_what_cannot_be_done_is_refused():
    for code, settings in [
        ("below-least", {"members": 0}),
        ("points-not-positive", {"points": 0}),
        ("not-a-fixed-step-method", {"method": "ida:index2"}),
        ("members-exceed-memory", {"members": 10**7, "points": 10**6}),
        ("members-exceed-memory", {"members": 10**12, "points": 1}),
        ("steps-beside-end-time", {"t_end": None}),
    ]:
        with refused(code):
            daebench.ensemble("planar_pendulum", **FEW | {"t_end": 1e6, **settings})


def test_a_grid_has_its_own_members_and_step_sizes():
    asked = {"method": "rattle", "case": "horizontal", "steps": 4, "points": 3, "lanes": 4, "starts": "grid"}
    run = daebench.ensemble("planar_pendulum", **asked, drawn={"values": {"gravity": [0.5, 1.0, 2.0], "h": [0.1, 0.2]}})
    assert len(run.run.members) == 6
    assert sorted(set(run.run.members.h)) == [0.1, 0.2]
    assert run.t[-1].tolist() == [0.4, 0.8] * 3
    with refused("grid-h-without-steps"):
        daebench.ensemble("planar_pendulum", **asked, h=0.1, drawn={"values": {"h": [0.1]}})
