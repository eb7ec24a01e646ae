"""Starts of an ensemble: neighbourhoods, grids, parameters in a box, and what is refused."""

from dataclasses import replace

import definitions
import numpy as np
import pytest
import sympy as sp
from refusals import refused
from scipy.stats import kstest

from daebench.compiler.definition import source_of
from daebench.diagnostics.consistency import project
from daebench.diagnostics.projected_members import project_members
from daebench.errors import BadInput
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.runs.make_ivp import make_ivp
from daebench.runs.members import members
from daebench.starts import convergence
from daebench.starts.draw import draw_starts
from daebench.starts.members import Neighbourhood
from daebench.systems.constrained import Case, ConstrainedHamiltonian, coordinates


def drawn(problem, *names, case=None, n=50, **settings):
    return draw_starts(initial_value_problem(problem, case), *names, members=n, h=0.01, **settings)


@pytest.mark.sampled(left_out=("slider_crank", "torus"))
@pytest.mark.parametrize("problem", ["spherical_pendulum", "double_pendulum", "slider_crank", "torus"])
def test_members_are_projected_as_each_would_be_by_itself(problem, random):
    ivp = initial_value_problem(problem)
    start = tuple(x + 0.05 * random.normal(size=(10, len(x))) for x in ivp.start)
    factors = dict.fromkeys(list(ivp.parameters)[:2], None)
    some = members(ivp, start, 0.01, {name: ivp.parameters[name] * random.uniform(0.9, 1.1, 10) for name in factors})
    projected = project_members(some)
    assert np.sum(projected.met) > (6 if problem == "slider_crank" else 8)  # it starts at its dead centre, beyond which nothing is near
    for i in range(10):
        if not projected.met[i]:
            with pytest.raises(BadInput, match="cannot be projected"):
                project(some.member(i), *(vectors[i] for vectors in start))
            continue
        p, q, moved_q, moved_p = project(some.member(i), *(vectors[i] for vectors in start))
        np.testing.assert_allclose(projected.members.start[0][i], p, rtol=1e-13, atol=1e-15)
        np.testing.assert_allclose(projected.members.start[1][i], q, rtol=1e-13, atol=1e-15)
        np.testing.assert_allclose([projected.moved_q[i], projected.moved_p[i]], [moved_q, moved_p], rtol=1e-10)


def test_a_member_that_cannot_be_projected_spoils_no_other_and_is_counted(pendulum):
    start = np.tile(pendulum.p0, (4, 1)), np.tile(1.01 * pendulum.q0, (4, 1))
    start[1][2] = 0.0
    projected = project_members(members(pendulum, start, 0.01, {}))
    assert projected.met.tolist() == [True, True, False, True]
    far = replace(pendulum, q0=0.0 * pendulum.q0)
    with refused("starts-not-projectable", says=("3", "1e-300", "0")):
        Neighbourhood(1e-300).draw(far, 3, 0.01)


def test_a_neighbourhood_is_as_wide_as_it_says_and_on_the_manifold_of_each():
    starts = drawn("double_pendulum", size=0.02, n=200, vary={"length1": (0.9, 1.1)}, seed=3)
    some = starts.members
    p, q = some.start
    np.testing.assert_allclose(np.hypot(q[:, 0], q[:, 1]), some.parameters["length1"], rtol=1e-14)
    assert np.max(np.abs(some.along("Gv", p, q))) < 1e-15
    assert kstest(some.parameters["length1"], lambda x: (x - 0.9) / 0.2).pvalue > 1e-4
    assert abs(np.corrcoef(some.parameters["length1"], q[:, 1])[0, 1]) < 0.2
    assert starts.about.startswith("a neighbourhood of size 0.02 of double_pendulum, case horizontal, uniform in every coordinate, moved")
    assert starts.about.endswith("; length1 differ from member to member; seed 3; parameters uniform in 0.9 <= length1 <= 1.1.")


def test_a_neighbourhood_of_a_pendulum_is_uniform_along_its_circle():
    p, q = drawn("planar_pendulum", case="rotating", size=0.02, n=1000).members.start
    assert kstest(q[:, 0], lambda u: np.clip((u / 0.02 + 1) / 2, 0, 1)).pvalue > 1e-4
    speed = p[:, 0] * -q[:, 1] + p[:, 1] * q[:, 0]
    assert kstest(speed, lambda u: np.clip(((u / 2.5 - 1) / 0.02 + 1) / 2, 0, 1)).pvalue > 1e-4


def test_a_neighbourhood_of_a_poisson_system_says_what_becomes_of_its_casimir_functions():
    starts = drawn("free_rigid_body", size=0.1)
    (y,) = starts.members.start
    (y0,) = starts.members.ivp.start
    assert 0.09 < np.max(np.abs(y - y0)) / np.max(np.abs(y0)) <= 0.1
    C = np.sum(y**2, axis=1) / 2
    assert starts.measured["C least"] == pytest.approx(np.min(C))
    assert f"C from {np.min(C):.6g} to {np.max(C):.6g}" in starts.about


def test_a_box_of_a_poisson_system_is_uniform_in_y_and_says_whether_the_flow_preserves_that():
    box = {"y1": (1, 2), "y2": (0.5, 3)}
    starts = drawn("lotka_volterra", "liouville", box=box, n=2000)
    for y, (lo, hi) in zip(starts.members.start[0].T, box.values(), strict=True):
        assert kstest(y, lambda u, lo=lo, hi=hi: (u - lo) / (hi - lo)).pvalue > 1e-4
    assert "the flow does not preserve" in starts.about
    body = drawn("free_rigid_body", "liouville", box={f"y{i}": (0, 1) for i in (1, 2, 3)})
    assert "uniform in dy, which the flow preserves" in body.about


def test_a_grid_has_every_combination_and_says_how_far_starts_were_moved():
    values = {"h": [0.1, 0.2], "q2": [0.0, 0.25], "length": [1.0, 2.0, 3.0]}
    ivp = initial_value_problem("planar_pendulum", "horizontal")
    starts = draw_starts(ivp, "grid", values=values)
    some = starts.members
    assert len(some) == 12
    assert some.h.tolist() == [0.1] * 6 + [0.2] * 6
    assert some.parameters["length"].tolist() == [1.0, 2.0, 3.0] * 4
    wanted = np.array([[1, y] for _ in range(2) for y in (0.0, 0.25) for _ in range(3)])
    q = wanted / np.linalg.norm(wanted, axis=1)[:, None] * some.parameters["length"][:, None]
    np.testing.assert_allclose(some.start[1], q, rtol=1e-14, atol=1e-15)
    assert starts.measured["moved_q"] == pytest.approx(2.0)
    assert starts.measured["moved q2"] == pytest.approx(np.max(np.abs(q[:, 1] - wanted[:, 1])))
    assert (
        "2 of h from 0.1 to 0.2 x 2 of q2 from 0 to 0.25 x 3 of length from 1 to 3, moved onto the manifold by at most 2 in q"
        in starts.about
    )


def translated():
    """Return two points tied together that nothing else holds."""
    q, p = coordinates(4)
    g = (q[0] - q[2]) ** 2 + (q[1] - q[3]) ** 2 - 1
    case = Case(q=(0, 0, 1, 0), p=(0, 1, 0, -1))
    return make_ivp(source_of(ConstrainedHamiltonian(q=q, p=p, M=sp.eye(4), U=sp.Integer(0), g=[g], cases={"tied": case}), "tied"))


def test_positions_that_can_go_to_infinity_are_never_settled(monkeypatch):
    monkeypatch.setattr(convergence, "LAST", 128)
    with refused("draws-did-not-settle", says=("188",)):
        draw_starts(translated(), "energy", members=5, h=0.01)


CUBE = {"p1": (-1, 1), "p2": (-1, 1)}

REFUSED = {
    "name": (("energi",), {}, "unknown distribution of starts 'energi'; did you mean energy?"),
    "setting": (("energy",), {"size": 1}, "unknown setting of energy 'size'"),
    "too-little": (
        ("energy",),
        {"E": -1.5, "n": 3},
        "at the energy -1.5 was found: the least potential energy that 3 of 3 searches came to is -1;",
    ),
    "at-rest": (("energy",), {"E": -1.0, "n": 3}, "at the energy -1"),
    "E": (("energy",), {"E": np.nan}, "E = nan must be a finite number"),
    "empty": (("liouville",), {"box": CUBE | {"q1": (2, 3)}, "n": 3}, "was found in 3 of 3 searches: the box is empty, or hard to find"),
    "empty-q": (("energy",), {"box": {"q1": (2, 3)}, "E": 1.0, "n": 3}, "3 of 3 searches ended outside; give a larger box"),
    "unbounded": (("liouville",), {"box": {"p1": (0, 1)}}, "needs finite bounds of p2: momenta can have any size"),
    "coordinate": (("liouville",), {"box": CUBE | {"q7": (0, 1)}}, "unknown coordinate of planar_pendulum in a box 'q7'"),
    "bounds": (("liouville",), {"box": CUBE | {"q1": 3}}, r"the bounds of q1 are 3; give two numbers"),
    "vary": (("neighbourhood",), {"vary": {"gravit": (1, 2)}}, "unknown parameter of planar_pendulum 'gravit'; did you mean gravity?"),
    "twice": (("neighbourhood",), {"vary": {"mass": (1, 2)}, "parameters": {"mass": [1] * 50}}, "mass is given, and is to vary too"),
    "grid-size": (("grid",), {"values": {"q1": [1, 2], "mass": [1, 2, 3]}}, "2 x 3 = 6 members, not 50"),
    "grid-h": (("grid",), {"values": {"h": [1]}, "n": None}, "give h once"),
}


def test_what_cannot_be_drawn_is_refused_in_a_sentence(monkeypatch):
    monkeypatch.setattr("daebench.starts.walk.STEPS", 200)  # searches that find nothing are given up earlier
    for wrong, (names, settings, sentence) in REFUSED.items():
        with pytest.raises(BadInput) as refusal:
            drawn("planar_pendulum", *names, case="horizontal", **settings)
        assert sentence in str(refusal.value), wrong
        assert "\n" not in str(refusal.value)


def test_problems_without_the_measure_are_refused():
    with refused("poisson-not-constrained", says=("lotka_volterra",)):
        drawn("lotka_volterra", "energy")
    with refused("box-unbounded", says=("y2",)):
        drawn("lotka_volterra", "liouville", box={"y1": (1, 2)})
    with refused("starts-outside-domain"):
        drawn("lotka_volterra", "liouville", box={"y1": (-1, 2), "y2": (1, 2)})
    relativistic = make_ivp(source_of(definitions.relativistic(), "relativistic"))
    with refused("measure-needs-quadratic-h"):
        draw_starts(relativistic, "energy", members=2, h=0.01)
    locked = initial_value_problem("slider_crank", "lock_up", q0=[0.0, 1.0, 0.0], p0=[0.0, 0.0, 0.0])
    with refused("measure-without-density", says=("slider_crank", "1", "2")):
        draw_starts(locked, "energy", members=2, h=0.01)
