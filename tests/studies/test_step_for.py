"""The search for a step size by its statistics: what passes, what does not, and how often it is wrong on a problem of the catalogue."""

import numpy as np
import pytest
from refusals import refused

import daebench
from daebench.diagnostics.equivalence import equivalence
from daebench.methods.ensemble.run import run_members
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import method_of
from daebench.runs.request import Request
from daebench.starts.draw import draw_starts
from daebench.studies.step_for.run import known, means, quantity

DOUBLE = {"case": "horizontal", "method": "rattle", "members": 1024, "drawn": {"size": 1e-3}}


def finished(problem, case, h, steps, members=8, every=5):
    """Return runs of some members."""
    ivp = initial_value_problem(problem, case)
    some = draw_starts(ivp, "neighbourhood", members=members, h=h).members
    return ivp, run_members(method_of(ivp, "rattle", None), some, Request(value=h, steps=steps, every=every, watch=(), count=False))


def test_the_search_ends_with_the_first_step_that_passes(tmp_path):
    found = daebench.step_for("double_pendulum", statistic="energy", margin=0.005, h=0.02, t_end=5, **DOUBLE)
    verdicts = [row.verdict for row in found.tried]
    assert verdicts[-1] == "equivalent"
    assert "equivalent" not in verdicts[:-1]
    assert found.h == 0.02 / 2 ** (len(verdicts) - 1)
    assert {path.suffix for path in found.write(tmp_path) if path.is_file()} == {".csv", ".svg"}
    assert set(found.table["name"]) == {"mean", "10 %", "50 %", "90 %"}


def test_energy_errors_of_order_two_need_half_of_the_step_for_a_quarter_of_the_margin():
    steps = [
        daebench.step_for("double_pendulum", statistic="energy", margin=margin, h=0.04, t_end=3, **DOUBLE).h for margin in (16e-3, 4e-3)
    ]
    assert steps[1] == steps[0] / 2


def test_too_few_members_are_undecided_and_never_pass():
    found = daebench.step_for(
        "double_pendulum", statistic="q3", margin=1e-3, h=0.02, t_end=30, halvings=1, case="horizontal", method="rattle", members=64
    )
    assert found.h is None
    assert found.tried[0].verdict == "undecided"
    assert found.needed[0.02] is None or found.needed[0.02] > 64


def test_of_fewer_members_than_an_interval_takes_their_number_is_named():
    """One of six tests at 5 % takes 53 members for the quantiles of 10 % and 90 %, whatever the margin."""
    asked = {"case": "horizontal", "method": "rattle", "statistic": "energy", "margin": 100.0, "h": 0.02, "t_end": 1}
    found = daebench.step_for("double_pendulum", members=40, **asked)
    assert (found.h, set(found.needed.values())) == (None, {53})
    assert daebench.step_for("double_pendulum", members=53, **asked).h == 0.02


def test_members_that_stop_do_not_pass():
    found = daebench.step_for(
        "double_pendulum", statistic="energy", margin=100.0, h=0.8, t_end=30, halvings=1, case="horizontal", method="rattle", members=32
    )
    assert found.tried[0].verdict == "stopped"
    assert "members stopped at h = 0.8" in found.tried[0].why


def test_coordinates_and_constraints_are_those_of_the_states():
    ivp, run = finished("spherical_pendulum", "fig1.2", 0.02, 50)
    np.testing.assert_allclose(means(run, quantity(ivp, "q2")), run.states[1:, :, 4].mean(axis=0))
    np.testing.assert_allclose(means(run, quantity(ivp, "p1")), run.states[1:, :, 0].mean(axis=0))
    assert np.all(means(run, quantity(ivp, "g")) < 1e-14)
    assert set(ivp.integrals) <= set(known(ivp))


@pytest.mark.exhaustive
def test_disjoint_ensembles_of_a_real_problem_pass_a_difference_of_the_margin_no_more_often_than_the_level():
    """The margin is the difference in mean kinetic energy that 4096 members have, in ensembles of 64 of them."""
    ivp = initial_value_problem("double_pendulum", "horizontal")
    of, h = quantity(ivp, "energy"), 0.02
    some = draw_starts(ivp, "neighbourhood", members=4096, h=h, size=0.05).members
    method = method_of(ivp, "rattle", None)
    values = []
    for k in range(2):
        request = Request(value=h, steps=500 * 2**k, every=5 * 2**k, watch=(), count=False)
        values.append(means(run_members(method, type(some)(ivp, some.start, h / 2**k, {}), request), of))
    x, y = values
    margin = abs(float(np.mean(x - y)))
    verdicts = [equivalence(x[part], y[part], margin).verdict for part in np.split(np.arange(4096), 64)]
    assert verdicts.count("equivalent") <= 8  # of 64, at a level of 5 %: more with probability 0.003
    wide = 2 * float(np.std(y))
    near = [equivalence(x[part], y[part], wide).verdict for part in np.split(np.arange(4096), 64)]
    assert near.count("equivalent") >= 56


REFUSED = [
    ("unknown-name", {"statistic": "heat"}),
    ("not-positive", {"margin": -1.0}),
    ("search-numbers-out-of-range", {"members": 8}),
    ("search-numbers-out-of-range", {"halvings": 0}),
    ("search-numbers-out-of-range", {"halvings": 2000}),
    ("members-exceed-memory", {"members": 10**9}),
    ("search-numbers-out-of-range", {"level": 0.9}),
    ("not-a-fixed-step-method", {"method": "ida:index2"}),
]


def test_what_cannot_be_done_is_refused():
    for code, changed in REFUSED:
        with refused(code):
            daebench.step_for("double_pendulum", **{"statistic": "energy", "margin": 0.1, "h": 0.02, "t_end": 1, **DOUBLE, **changed})
