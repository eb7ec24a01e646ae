"""Arevalo's problem: its exact solution in the equations as they were published, and IDA's errors in a published benchmark."""

import time
from functools import cache

import numpy as np
import pytest
from published import AREVALO_IDA
from scipy.integrate import solve_ivp

from daebench.errors import BadInput
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.solvers.drive import drive
from daebench.methods.solvers.ida import Ida
from daebench.methods.solvers.rank_monitor import RankMonitor
from daebench.problems.arevalo import closed_form
from daebench.reference.solution import integrated, reference_solution
from daebench.runs.request import Request


def by_hand(t, state):
    """Return the right side with lam = -(v.v) - 2 (x y - y x) of the published equations, from the second derivative of the circle."""
    x, y, u, v = state
    lam = -(u**2 + v**2)
    return [u, v, 2 * y + x * lam, -2 * x + y * lam]


def test_the_closed_form_is_the_motion_of_the_published_equations():
    where, times = initial_value_problem("arevalo"), [0.5, 1.5, 3.0]
    states = reference_solution(where, times).states
    hand = solve_ivp(by_hand, (0, 3), [0, 1, 0, 0], t_eval=times, method="DOP853", rtol=1e-13, atol=1e-13).y.T
    for t, q, p, lam, other in zip(times, states["q"], states["p"], states["lam"], hand, strict=True):
        assert q == pytest.approx([np.sin(t**2), np.cos(t**2), t], abs=1e-15)
        assert [*q[:2], *p[:2]] == pytest.approx(other, abs=1e-10)
        assert p[2] == pytest.approx(-2 * t**2, rel=1e-14)
        assert lam == pytest.approx([4 * t**2], rel=1e-14)


def test_the_closed_form_is_the_motion_from_another_start():
    turned = 0.7
    q0, rate = np.array([np.sin(turned), np.cos(turned), 0]), -1.3
    where = initial_value_problem("arevalo").at(rate * np.array([q0[1], -q0[0], 0]), q0)
    exact, found = reference_solution(where, [2.0]), integrated(where, [2.0])
    for part in ("q", "p", "lam"):
        assert np.abs(exact.states[part] - found.states[part]).max() < 1e-11


def test_a_start_off_the_circle_has_no_closed_form():
    for q0, p0 in (([0, 1.1], [0, 0]), ([0, 1], [0, 0.1])):
        with pytest.raises(BadInput, match="not on the unit circle"):
            closed_form(1.0, q0, p0, {})


@cache
def posed():
    return Ida("ggl")._posed(initial_value_problem("arevalo"))


def error_of_ida(tol):
    """Return the Euclidean norm of the errors of x, y, their rates, Lam and Mu at t = 5, as the benchmark has it."""
    dae, t = posed(), 5.0

    def monitor(*settings):
        return RankMonitor(dae, "stop", *settings)

    Y = drive(Ida("ggl"), dae, Request(value=tol, t_end=t, every=0), began=time.perf_counter(), make_monitor=monitor).Y[-1]
    q, v, lam, mu = (Y[dae.blocks[name]] for name in ("q", "v", "lam", "mu"))
    s, c = np.sin(t**2), np.cos(t**2)
    return np.linalg.norm([*(q[:2] - [s, c]), *(v[:2] - 2 * t * np.array([c, -s])), lam[0] - 4 * t**3 / 3, mu[0]])


def test_ida_has_the_published_errors():
    """A factor of two is what steps chosen a little otherwise make of these errors; at 1e-3 the motion is all but lost."""
    ms, published = np.array(list(AREVALO_IDA)), np.array(list(AREVALO_IDA.values()))
    errors = np.array([error_of_ida(10 ** -(3 + m / 4)) for m in ms])
    ratios = errors / published
    assert np.all((ratios[1:-1] > 1 / 2) & (ratios[1:-1] < 2))
    assert np.all((ratios > 1 / 2.7) & (ratios < 2.7))
    assert 1 / 1.5 < np.exp(np.mean(np.log(ratios))) < 1.5
    ours, theirs = (np.polyfit(ms / 4, np.log10(e), 1)[0] for e in (errors, published))
    assert ours == pytest.approx(theirs, rel=0.15)
