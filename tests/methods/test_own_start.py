"""Starts by velocities and by the names of points, against hand-written mechanics and the cases of mechanisms."""

import numpy as np
import pytest
import sympy as sp
from refusals import refused

import daebench
from daebench.joints import Body, Guided, Mechanism, Plate, PointMass, Rod, Start

start_of = daebench.initial_value_problem


def definition(H, g):
    q, p = sp.symbols("x y", real=True), sp.symbols("p_x p_y", real=True)
    return daebench.ConstrainedHamiltonian(q=q, p=p, H=H(*p, *q), g=[g(*q)], cases={"rest": daebench.Case(q=(1, 0), p=(0, 1))})


def circle(x, y):
    return (x**2 + y**2 - 1) / 2


def test_momenta_have_the_magnetic_part():
    def H(p1, p2, x, y):  # A = (-y, 2 x), masses 2 and 4
        return (p1 + y) ** 2 / 4 + (p2 - 2 * x) ** 2 / 8

    ivp = start_of(definition(H, circle), q0=[0.6, 0.8], v0=[-0.4, 0.3])
    assert ivp.p0 == pytest.approx([2 * -0.4 - 0.8, 4 * 0.3 + 2 * 0.6], abs=1e-15)


def test_a_start_needs_no_case():
    q, p = sp.symbols("x y", real=True), sp.symbols("p_x p_y", real=True)
    free = daebench.ConstrainedHamiltonian(q=q, p=p, M=3 * sp.eye(2), U=q[1], g=[circle(*q)], cases={})
    ivp = start_of(free, q0=[0.6, 0.8], v0=[-0.4, 0.3])
    assert (ivp.case, ivp.p0.tolist()) == ("[q0=0.6,0.8;v0=-0.4,0.3]", pytest.approx([-1.2, 0.9]))
    assert np.array_equal(start_of(free, ivp.case).p0, ivp.p0)


ARM = Mechanism(
    ground={"O": (0, 0)},
    points={"B": (1, 0), "C": (1, 2)},
    bodies={"arm": Rod("O", "B", mass=3), "forearm": Rod("B", "C", mass=6)},
    cases={"rest": Start()},
)
"""Two uniform rods in a row: M is [[m1/3 + m2/3, m2/6], [m2/6, m2/3]] in B and C."""


def test_a_spin_turns_a_body_and_the_others_move_with_the_least_kinetic_energy():
    ivp = start_of(ARM.problem(), v0={"spin(arm)": 2.0, "spin(forearm)": -1.0})
    v = np.array([0, 2, 2, 2])  # B' = 2 x B, C' = B' - 1 x (C - B)
    M = np.kron([[3.0, 1.0], [1.0, 2.0]], np.eye(2))
    assert ivp.p0 == pytest.approx(M @ v, abs=1e-13)
    alone = start_of(ARM.problem(), v0={"spin(arm)": 2.0})
    free = (np.array([0, 2, s, 2.0]) for s in np.linspace(-3, 3, 601))  # B' is given, and C' - B' is across (0, 2)
    assert alone.value("H", *alone.start) <= min(v @ M @ v / 2 for v in free) + 1e-12


def test_names_agree_with_a_case_of_the_same_start_in_space():
    crank = Plate("O", "N", "A", mass=1)
    parts = {
        "ground": {"O": (0, 0, 0), "N": ("1/2", 0, 0)},
        "points": {"A": (0, 0, 1), "B": (2, 0, 1)},
        "bodies": {"crank": crank, "arm": Body("A", "B", mass=2, centre=(1, 0, 1), inertia=(2, 2, 3))},
    }
    spins = {"crank": (3, 0, 0), "arm": (1, 2, 0)}
    problem = Mechanism(**parts, cases={"rest": Start(), "moving": Start(spin=spins, velocity={"A": (0, -3, 0)})}).problem()
    own = start_of(problem, "rest", v0={**{f"spin({name})": spin for name, spin in spins.items()}, "A": (0, -3, 0)})
    assert own.p0 == pytest.approx(start_of(problem, "moving").p0, abs=1e-13)
    assert np.max(np.abs(own.p0)) > 1


def test_a_point_on_a_guide_is_placed_along_it():
    bodies = {"slider": PointMass("S", mass=1), "rod": Rod("S", "B", mass=1)}
    slide = Mechanism(points={"S": Guided((0, 1), (3, 4)), "B": (1, 1)}, bodies=bodies).problem()
    ivp = start_of(slide, q0={"S": (3, 5), "B": (4, 5)})
    assert ivp.coordinates[0] == "way of S"
    assert [*map(float, slide.parts.places["S"].subs({slide.q[0]: ivp.q0[0]}))] == pytest.approx([3, 5])
    with refused("start-off-its-guide"):
        start_of(slide, q0={"S": (3, 6)})


def test_a_start_is_made_again_from_its_name():
    problem = ARM.problem()
    asked = {"q0": {"B": (0.59, 0.81)}, "v0": {"spin(arm)": 2, "B": (-0.1, 0.1)}}
    with refused("given-velocities-contradict"):
        start_of(problem, "rest", **asked, project=True)
    own = start_of(problem, "rest", q0={"B": (0.59, 0.81)}, v0={"spin(arm)": 2}, project=True)
    assert own.case == "rest[q0=B=(0.59,0.81);v0=spin(arm)=2;project]"
    again = start_of(problem, own.case)
    assert all(map(np.array_equal, own.start, again.start))
    assert start_of(problem, own.case, v0={"spin(forearm)": 1}).case == "rest[q0=B=(0.59,0.81);v0=spin(forearm)=1;project]"
    moved = start_of(own, p0=np.zeros(4))
    assert np.array_equal(start_of(problem, moved.case).q0, own.q0)


def test_a_projection_that_moves_nothing_leaves_the_name_of_the_case():
    assert start_of("planar_pendulum", "horizontal", project=True).case == "horizontal"
    assert start_of("planar_pendulum", "horizontal", {"length": 2.0}, q0=[1, 0], project=True).case == "horizontal[q0=1,0;project]"
