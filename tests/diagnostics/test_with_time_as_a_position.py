"""What is said of systems in time, whose last position is the time: it has no mass, and does not turn back."""

import itertools

import numpy as np
import pytest
import sympy as sp
from refusals import refused

from daebench.diagnostics.energy_verdict import kinetic_energy
from daebench.diagnostics.freedom import contradicted
from daebench.diagnostics.negative_damping import negative_damping
from daebench.diagnostics.passage import Crossing
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.plan import plan
from daebench.runs.make_ivp import make_ivp
from daebench.systems.constrained import Case, ConstrainedHamiltonian

IN_TIME = ("driven_slider_crank", "arevalo")


def variables(names):
    return (sp.symbols([f"{kind}{name}" for name in names], real=True) for kind in ("q", "p", "v"))


@pytest.mark.parametrize("problem", IN_TIME)
def test_the_kinetic_energy_is_that_of_the_masses_whatever_energy_was_received(problem):
    ivp = initial_value_problem(problem)
    n = ivp.d - 1
    v = np.linspace(1.0, 2.0, n)
    M = ivp.value("mass", ivp.p0, ivp.q0)[:n, :n]
    p = np.append(M @ v, 0.0)
    for received in (0.0, -30.0, 50.0):
        p[n] = received
        assert kinetic_energy(ivp, p[None], ivp.q0[None])[0] == pytest.approx(v @ M @ v / 2, rel=1e-12)


@pytest.mark.parametrize("problem", ["slider_crank", *IN_TIME])
def test_a_motion_that_turns_back_is_called_so_however_slow_it_is(problem):
    ivp = initial_value_problem(problem)
    n = ivp.d - bool(ivp.facts.EXTENDED)
    for speed, (sign, branch) in itertools.product((1.0, 0.1, 0.01), ((-1, "reflected"), (1, "through"))):
        before, after = (np.array(ivp.p0, dtype=float) for _ in range(2))
        before[:n] = speed * np.linspace(1.0, 2.0, n)
        after[:n] = sign * before[:n]
        crossing = Crossing(ivp, 0.5, 0.49, before, ivp.q0, 1.0)
        for k in range(4):
            crossing.add(0.51 + 0.01 * k, after, ivp.q0, 0.3 + 0.2 * k)
        assert crossing.passage.branch == branch, (speed, sign)
        assert crossing.passage.turn == pytest.approx(180.0 * (sign < 0), abs=1e-5)


@pytest.mark.parametrize("c", [0.1, -0.1])
def test_a_position_without_mass_is_no_obstacle_to_a_damping(c):
    q, p, v = variables("xyz")
    g, H = [q[0] ** 2 + q[1] ** 2 - 1], (p[0] ** 2 + p[1] ** 2) / 2 + q[1]
    drag = (-c * v[0], -c * v[1], sp.S.Zero)
    case = Case(q=(1, 0, 0), p=(0, 0, 0))
    ivp = initial_value_problem(ConstrainedHamiltonian(q=q, p=p, v=v, H=H, force=drag, g=g, cases={"side": case}))
    assert negative_damping(ivp) == pytest.approx(max(-c, 0.0), abs=1e-14)


def test_a_redundant_link_contradicts_no_driver_where_there_is_none():
    q, p, v = variables(("x1", "y1", "x2", "y2"))
    x1, y1, x2, y2 = q
    bar = [x1**2 + y1**2 - 1, (x2 - 2) ** 2 + y2**2 - 1, (x2 - x1) ** 2 + (y2 - y1) ** 2 - 4]
    middle = ((x1 + x2) / 2 - 1) ** 2 + ((y1 + y2) / 2) ** 2 - 1
    case, drag = Case(q=(0, -1, 2, -1), p=(0,) * 4), [-x / 10 for x in v]
    links = ConstrainedHamiltonian(q=q, p=p, v=v, M=sp.eye(4), U=9 * (y1 + y2), force=drag, g=[*bar, middle], cases={"a": case})
    source = initial_value_problem(links, consistent=False).source
    for angle in np.linspace(0.1, 1.4, 27):
        place = (np.sin(angle), -np.cos(angle), 2 + np.sin(angle), -np.cos(angle))
        assert not contradicted(make_ivp(source, "a", q0=place, p0=(0.0,) * 4)), angle


def test_conformal_rattle_is_for_a_constant_mass_matrix():
    q, p, v = variables("abs")
    cos = sp.cos(q[0] - q[1])
    M = sp.Matrix([[2, cos, 0], [cos, 1, 0], [0, 0, 1]])
    U, g = -2 * sp.cos(q[0]) - sp.cos(q[1]), [q[2] - sp.sin(q[0])]
    case = Case(q=(1, sp.Rational(1, 2), sp.sin(1)), p=(0, 0, 0))
    arm = ConstrainedHamiltonian(q=q, p=p, v=v, M=M, U=U, force=list(-M * sp.Matrix(v)), g=g, cases={"a": case})
    with refused("method-refuses-problem", says=("constant M",)):
        plan(arm, method="rattle_conformal", h=0.01, steps=1)
    plan(arm, method="rattle", h=0.01, steps=1)
