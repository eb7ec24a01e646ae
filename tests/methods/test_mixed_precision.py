"""Mixed precision: forces in float32, states, constraints and sums in float64."""

import numpy as np
import pytest
from runs import method

from daebench.errors import BadInput
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import method_of
from daebench.runs.request import Request


def ended(scheme, ivp, precision, *, h, steps=200):
    return method(scheme).solve(ivp, Request(value=h, steps=steps, every=0, precision=precision)).complete()


@pytest.mark.parametrize("scheme", ["rattle", "shake", "rattle_ilves", "rattle/suzuki4"])
def test_a_constant_force_is_the_one_of_a_rounded_constant_to_the_bit(scheme):
    rounded = float(np.float32(9.81))
    assert rounded != 9.81
    given, of_rounded = (initial_value_problem("planar_pendulum", "horizontal", {"gravity": g}) for g in (9.81, rounded))
    mixed, double = ended(scheme, given, "mixed", h=0.01), ended(scheme, of_rounded, "float64", h=0.01)
    assert mixed.q.dtype == np.float64
    assert np.array_equal(mixed.q, double.q)
    assert np.array_equal(mixed.p, double.p)
    assert not np.array_equal(mixed.q, ended(scheme, given, "float64", h=0.01).q)


def test_a_force_that_depends_on_positions_is_that_of_rounded_positions():
    """q1 - q0 - h M^-1 p0 + h^2/2 M^-1 (F + G^T lam) = 0 with F as NumPy has it in float32: a parabola about the origin, and a field."""
    ivp, h, single = initial_value_problem("rigid_water", "tumbling"), 0.01, np.float32
    run = method("rattle").solve(ivp, Request(value=h, steps=1, precision="mixed", raw=True)).complete()
    pull = single(ivp.parameters["charge"]) * single(ivp.parameters["field"])
    F = np.zeros(9)
    F[:3] = single(ivp.parameters["stiffness"]) * ivp.q0[:3].astype(single)
    F[2::3] += [2 * pull, -pull, -pull]
    G, M = ivp.value("G", ivp.q0), ivp.value("mass", ivp.p0, ivp.q0)
    _, lam = run.raw["lam_n"]

    def unmet(F):
        return np.abs(run.q[1] - ivp.q0 - h * np.linalg.solve(M, ivp.p0 - h / 2 * (F + G.T @ lam[0]))).max()

    assert unmet(F) < 1e-15 < 1e-13 < unmet(F + 1e-6 * np.abs(F).max())


def test_constraints_hold_to_double_precision_and_the_motion_to_more_than_single():
    ivp = initial_value_problem("rigid_water", "tumbling")
    double, mixed, single = (ended("rattle_settle", ivp, precision, h=0.01, steps=500) for precision in ("float64", "mixed", "float32"))
    assert mixed.maxima["g"] < 1e-14 < 1e-7 < single.maxima["g"]
    off = [np.abs(run.q[-1] - double.q[-1]).max() for run in (mixed, single)]
    assert 1e-11 < off[0] < off[1] / 10


REFUSED = [
    ("spherical_pendulum", "lobatto3", {}, "evaluates forces within iterations"),
    ("double_pendulum", "baumgarte:rk4", {}, "evaluates forces within iterations"),
    ("lotka_volterra", "midpoint", {}, "has no forces"),
    ("planar_pendulum", "ida:index2", {}, "in float64 only"),
    ("arevalo", "rattle", {}, "neither time nor forces"),
    ("pendulum_chain", "rattle", {"links": 10}, "its vectors are arrays"),
]


@pytest.mark.parametrize(("problem", "name", "parameters", "why"), REFUSED)
def test_where_it_has_no_meaning_it_is_refused(problem, name, parameters, why):
    ivp = initial_value_problem(problem, parameters=parameters)
    with pytest.raises(BadInput, match=why):
        method_of(ivp, name, anyway=problem == "lotka_volterra").solve(ivp, Request(value=0.01, t_end=0.1, precision="mixed"))
