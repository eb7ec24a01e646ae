"""The volume that dampers take away, against the determinant of the motion in the angle of a pendulum, by SciPy and by differences."""

import numpy as np
import pytest
import sympy as sp
from integrating import by_dop853

from daebench.diagnostics.symplecticity import tangent_basis_at_one_time, tangent_map
from daebench.diagnostics.volume import divergence, volume_left, volume_share
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.systems.constrained import Case, ConstrainedHamiltonian

GRAVITY, ALONG, UP, SWING, START, T_END = 9.81, 0.3, 1.1, 0.2, (1.2, 0.4), 0.5
x, y, px, py, vx, vy, t = sp.symbols("x y px py vx vy t", real=True)
SHAKEN = sp.sin(3 * t) * sp.Rational(1, 5)


@pytest.fixture(params=["H", "M"])
def pendulum(request):
    """A pendulum on a shaken pivot with different dampers along x and y, beside a force that does not depend on the velocity."""
    angle, rate = START
    v = sp.Matrix([sp.Rational(3, 5) + rate * sp.cos(angle), rate * sp.sin(angle)])
    mass = sp.eye(2) + sp.Matrix([[0, 1], [1, 0]]) * x / 10**12  # one that is not diagonal is solved with
    energy = {"H": (px**2 + py**2) / 2 + GRAVITY * y} if request.param == "H" else {"M": mass, "U": GRAVITY * y}
    case = Case(q=(sp.sin(angle), -sp.cos(angle)), p=v if request.param == "H" else mass.subs(x, sp.sin(angle)) * v)
    g, force = [(x - SHAKEN) ** 2 + y**2 - 1], (-ALONG * vx + y / 3, -UP * vy + t * x)
    problem = ConstrainedHamiltonian(q=(x, y), p=(px, py), v=(vx, vy), t=t, g=g, force=force, cases={"a": case}, **energy)
    return initial_value_problem(problem)


def in_the_angle(angle, rate):
    """Return the angle and its rate at the end: the equation of motion is derived by hand."""

    def slope(time, z):
        sine, cosine = np.sin(z[0]), np.cos(z[0])
        s, s_t, s_tt = SWING * np.sin(3 * time), 3 * SWING * np.cos(3 * time), -9 * SWING * np.sin(3 * time)
        across = -ALONG * (s_t + cosine * z[1]) - cosine / 3
        up = -UP * sine * z[1] + time * (s + sine)
        return [z[1], (across - s_tt) * cosine + (up - GRAVITY) * sine]

    return by_dop853(slope, [angle, rate], T_END)


def determinant(of, step=1e-4):
    """Return the determinant of the derivative of a map of (angle, rate), by central differences of the fourth order."""

    def column(k):
        def at(n):
            return of(*(z + n * step * (i == k) for i, z in enumerate(START)))

        return (8 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12 * step)

    return np.linalg.det(np.column_stack([column(0), column(1)]))


def by_rattle(ivp, h):
    """Return RATTLE's map as one of the angle and its rate."""
    flow = FixedStep("rattle", compiled=False).flow(ivp, h, round(T_END / h))

    def of(angle, rate):
        sine, cosine = np.sin(angle), np.cos(angle)
        p, q = flow(np.array([0.6 + rate * cosine, rate * sine, 0]), np.array([sine, -cosine, 0]))
        a, b, u, w = (float(np.real(z)) for z in (q[0] - SWING * np.sin(3 * T_END), q[1], p[0] - 0.6 * np.cos(3 * T_END), p[1]))
        return np.array([np.arctan2(a, -b), a * w - b * u])

    return of


def test_the_volume_left_is_the_determinant_of_the_motion_in_the_angle(pendulum):
    exact = determinant(in_the_angle)
    assert 0.5 < exact < 0.9
    assert volume_left(pendulum, T_END) == pytest.approx(exact, rel=1e-8)


def test_the_divergence_is_that_of_the_damping_along_the_circle(pendulum):
    sine, cosine = np.sin(START[0]), np.cos(START[0])
    assert divergence(pendulum, pendulum.p0, pendulum.q0) == pytest.approx(-ALONG * cosine**2 - UP * sine**2, rel=1e-8)


def test_rattle_changes_the_volume_by_the_determinant_of_its_map_and_is_of_order_2(pendulum):
    X, off = tangent_basis_at_one_time(pendulum, pendulum.p0, pendulum.q0), []
    for h in (0.05, 0.025):
        flow = FixedStep("rattle", compiled=False).flow(pendulum, h, round(T_END / h))
        share = volume_share(tangent_map(flow, pendulum.p0, pendulum.q0, X), X)
        assert share == pytest.approx(determinant(by_rattle(pendulum, h)), rel=1e-8)
        off.append(share / volume_left(pendulum, T_END) - 1)
    assert abs(off[0]) > 1e-6
    assert np.log2(off[0] / off[1]) == pytest.approx(2, abs=0.2)
