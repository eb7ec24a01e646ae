"""The double pendulum and the chain, against their equations of motion in angles, which are written out here with NumPy."""

from functools import cache

import numpy as np
import pytest
from integrating import by_dop853
from measures import error_of
from refusals import refused

from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.reference.solution import integrated
from daebench.runs.local_flow import enter, leave
from daebench.runs.request import Request

pytestmark = pytest.mark.usefixtures("plain_functions")

UNLIKE = {"mass1": 0.7, "mass2": 2.5, "length1": 1.6, "length2": 0.45, "gravity": 3.7}
TIMES = np.array([0.5, 1.0])


# ---- the motion in angles ------------------------------------------------------------------------------------------------


class Angles:
    """Masses on rods, by the angles a of the rods from the downward vertical and their rates: no constraint, no multiplier.

    The kinetic energy is a'.A(a) a' / 2, A_ij = l_i l_j cos(a_i - a_j) times the mass that hangs below both rods.
    """

    def __init__(self, masses, lengths, gravity):
        self.m, self.length, self.gravity = np.array(masses, dtype=float), np.array(lengths, dtype=float), gravity
        self.n, below = len(self.m), np.cumsum(self.m[::-1])[::-1]
        self.pull = below * self.length
        self.weights = np.outer(self.length, self.length) * below[np.maximum.outer(np.arange(self.n), np.arange(self.n))]

    def mass_matrix(self, a):
        return self.weights * np.cos(np.subtract.outer(a, a))

    def acceleration(self, a, rates):
        torque = -(self.weights * np.sin(np.subtract.outer(a, a))) @ rates**2 - self.gravity * self.pull * np.sin(a)
        return np.linalg.solve(self.mass_matrix(a), torque)

    def cartesian(self, a, rates):
        """Return q and p; a and rates may have further axes behind the first."""
        length, m = (np.expand_dims(x, tuple(range(1, np.ndim(a)))) for x in (self.length, self.m))
        x = [np.cumsum(part, axis=0) for part in (length * np.sin(a), -length * np.cos(a))]
        p = [m * np.cumsum(part, axis=0) for part in (length * np.cos(a) * rates, length * np.sin(a) * rates)]
        return (np.stack(part, axis=1).reshape(2 * self.n, *np.shape(a)[1:]) for part in (x, p))

    def motion(self, a, rates, times):
        """Return q and p at these times, shape(len(times), 2 n)."""

        def field(_, y):
            return np.concatenate([y[self.n :], self.acceleration(y[: self.n], y[self.n :])])

        y0 = np.concatenate([np.broadcast_to(a, self.n), np.broadcast_to(rates, self.n)])
        y = by_dop853(field, y0, times, rtol=3e-14).T
        return [part.T for part in self.cartesian(y[: self.n], y[self.n :])]


def equal(n):
    return Angles([1] * n, [1] * n, 9.81)


def of_double(parameters):
    return Angles(*([parameters[f"{name}{k}"] for k in (1, 2)] for name in ("mass", "length")), parameters["gravity"])


IVPS = {
    "double-horizontal": ("double_pendulum", "horizontal", 2, np.pi / 2, 0),
    "double-swing": ("double_pendulum", "swing", 2, 0.1, 0),
    "double-unlike": ("double_pendulum", "unlike", 2, np.array([2.5, -0.7]), np.array([-1.0, 3.0])),
    "one-horizontal": ("pendulum_chain", "horizontal5", 1, np.pi / 2, 0),
    "three-horizontal": ("pendulum_chain", "horizontal5", 3, np.pi / 2, 0),
    "three-hanging": ("pendulum_chain", "hanging", 3, 0.1, 0),
}


@pytest.mark.sampled(left_out=("double-horizontal", "double-swing", "one-horizontal", "three-hanging"))
@pytest.mark.parametrize(("problem", "case", "n", "angle", "rate"), IVPS.values(), ids=IVPS)
def test_the_motion_is_that_in_angles(problem, case, n, angle, rate):
    if case == "unlike":
        alone = of_double(UNLIKE)
        q0, p0 = alone.cartesian(angle, rate)
        where = initial_value_problem(problem, None, UNLIKE, q0=q0, p0=p0)
    else:
        alone, where = equal(n), initial_value_problem(problem, case, {"links": n} if problem == "pendulum_chain" else None)
    found = integrated(where, TIMES)
    q, p = alone.motion(angle, rate, TIMES)
    # the motion in angles has an error of its own, of the size of the bound
    assert np.max(np.linalg.norm(found.states["q"] - q, axis=1)) < 2 * found.bound["q"] < 1e-9
    assert np.max(np.linalg.norm(found.states["p"] - p, axis=1)) < 2 * found.bound["p"] < 1e-8


@pytest.mark.parametrize("n", [1, 5])
def test_a_scheme_of_order_8_follows_the_chain_in_angles(n):
    # bent and turning, so that no term of the motion vanishes; errors of one step are below rounding
    a, rates = 0.3 * np.arange(n) - 1, np.cos(np.arange(n))
    q0, p0 = equal(n).cartesian(a, rates)
    method = FixedStep("rattle", composition="kahan_li8", compiled=False)
    where = initial_value_problem("pendulum_chain", "hanging", {"links": n}, q0=q0, p0=p0)
    found = method.solve(where, Request(value=0.005, steps=12, watch=("manifold",))).complete()
    q, p = equal(n).motion(a, rates, [0.06])
    assert max(error_of(found.q[-1], q), error_of(found.p[-1], p)) < 1e-12
    assert max(found.maxima.values()) < 1e-12


# ---- horizontal and at rest ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("n", [2, 5])
def test_a_horizontal_chain_at_rest_falls_freely_and_pulls_at_nothing(n):
    # in angles only the first rod has an angular acceleration, -gravity/length: the first mass falls freely and so do all below it
    expected = np.eye(n)[0] * -9.81
    assert error_of(equal(n).acceleration(np.full(n, np.pi / 2), np.zeros(n)), expected) < 1e-11
    where = initial_value_problem("pendulum_chain", "horizontal5", {"links": n}, algebra="values")
    lam = where.value("lam", where.p0, where.q0)
    q_acc = -(where.value("H_q", where.p0, where.q0) + where.value("G", where.q0).T @ lam)
    assert np.abs(lam).max() == 0
    assert np.array_equal(q_acc, np.tile([0, -9.81], n))


def test_a_bent_chain_at_rest_is_pulled_as_in_angles():
    a = np.array([0.4, -1.2, 2.0, 0.1, 1.0])
    q0, p0 = equal(5).cartesian(a, np.zeros(5))
    where = initial_value_problem("pendulum_chain", q0=q0, p0=p0)
    lam = where.value("lam", p0, q0)
    q_acc = -(where.value("H_q", p0, q0) + where.value("G", q0).T @ lam)
    _, expected = equal(5).cartesian(a, equal(5).acceleration(a, np.zeros(5)))
    assert error_of(q_acc, expected) < 1e-12


# ---- definitions ---------------------------------------------------------------------------------------------------------


def test_the_number_of_links_is_the_cases_unless_it_is_given():
    assert initial_value_problem("pendulum_chain", "horizontal5").q0.tolist() == [1, 0, 2, 0, 3, 0, 4, 0, 5, 0]
    assert initial_value_problem("pendulum_chain", "horizontal5", {"links": 2, "length": 3.0}).q0.tolist() == [3, 0, 6, 0]
    assert initial_value_problem("pendulum_chain", "hanging", {"links": 7}).m == 7
    assert initial_value_problem("double_pendulum", None, {"length2": 0.5}).q0.tolist() == [1, 0, 1.5, 0]
    with refused("parameter-not-whole", says=["links", "0"]):
        initial_value_problem("pendulum_chain", "hanging", {"links": 0})


# ---- the chart -----------------------------------------------------------------------------------------------------------

CHARTS = {"double": ("double_pendulum", 2), **{f"{n} links": ("pendulum_chain", n) for n in (1, 2, 5)}}


@cache
def chart(name, n):
    """Return the ways out of the chart and into it, and the motion in angles with the same parameters."""
    values = UNLIKE if name == "double_pendulum" else {"mass": 0.4, "length": 1.5, "gravity": 9.81, "links": n}
    where = initial_value_problem(name, None, values, algebra="values", consistent=False)
    return leave(where), enter(where), of_double(values) if name == "double_pendulum" else Angles([0.4] * n, [1.5] * n, 9.81)


@pytest.fixture(params=CHARTS.values(), ids=CHARTS)
def charted(request, random):
    """The chart's functions, and points of it everywhere on the circle: rates and angles."""
    name, n = request.param
    points = [(random.normal(size=n), random.uniform(-np.pi, np.pi, size=n)) for _ in range(5)]
    ends = [(np.zeros(n), angle * np.ones(n)) for angle in (0.0, np.pi / 2, -np.pi / 2, 3.0)]
    return *chart(name, n), [*points, *ends]


def test_the_chart_is_of_angles_from_the_downward_vertical_and_their_rates_there_and_back(charted):
    out, back, alone, points = charted
    for rates, a in points:
        q, p = alone.cartesian(a, rates)
        assert error_of(out(rates, a), [p, q]) < 1e-13
        assert error_of(back(p, q), [rates, a]) < 1e-13


def test_in_the_chart_gauss_follows_the_double_pendulum():
    where = initial_value_problem("double_pendulum", "swing")
    found = FixedStep("gauss3", form="local", compiled=False).solve(where, Request(value=0.02, steps=25)).complete()
    q, p = equal(2).motion(0.1, 0, [0.5])
    assert max(error_of(found.q[-1], q), error_of(found.p[-1], p)) < 1e-9
