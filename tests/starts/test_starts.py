"""Starts of an ensemble: neighbourhoods, grids, parameters in a box, and what is refused."""

import itertools
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
    some = drawn("double_pendulum", size=0.02, n=200, vary={"length1": (0.9, 1.1)}, seed=3).members
    p, q = some.start
    np.testing.assert_allclose(np.hypot(q[:, 0], q[:, 1]), some.parameters["length1"], rtol=1e-14)
    assert np.max(np.abs(some.along("Gv", p, q))) < 1e-15
    assert kstest(some.parameters["length1"], lambda x: (x - 0.9) / 0.2).pvalue > 1e-4
    assert abs(np.corrcoef(some.parameters["length1"], q[:, 1])[0, 1]) < 0.2


def test_a_neighbourhood_of_a_pendulum_is_uniform_along_its_circle():
    p, q = drawn("planar_pendulum", case="rotating", size=0.02, n=1000).members.start
    assert kstest(q[:, 0], lambda u: np.clip((u / 0.02 + 1) / 2, 0, 1)).pvalue > 1e-4
    speed = p[:, 0] * -q[:, 1] + p[:, 1] * q[:, 0]
    assert kstest(speed, lambda u: np.clip(((u / 2.5 - 1) / 0.02 + 1) / 2, 0, 1)).pvalue > 1e-4


def test_a_neighbourhood_of_a_poisson_system_says_what_becomes_of_its_casimir_functions():
    starts = drawn("free_rigid_body", size=0.1)
    (y,), (y0,) = starts.members.start, starts.members.ivp.start
    assert 0.09 < np.max(np.abs(y - y0)) / np.max(np.abs(y0)) <= 0.1
    assert starts.measured["C least"] == pytest.approx(np.min(np.sum(y**2, axis=1) / 2))


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
    starts = draw_starts(initial_value_problem("planar_pendulum", "horizontal"), "grid", values=values)
    some = starts.members
    h, y, length = np.array(list(itertools.product(*values.values()))).T
    assert np.array_equal((some.h, some.parameters["length"]), (h, length))
    wanted = np.stack([np.ones(12), y], axis=1)
    q = wanted / np.linalg.norm(wanted, axis=1)[:, None] * length[:, None]
    np.testing.assert_allclose(some.start[1], q, rtol=1e-14, atol=1e-15)
    assert starts.measured["moved_q"] == pytest.approx(2.0)
    assert starts.measured["moved q2"] == pytest.approx(np.max(np.abs(q[:, 1] - y)))


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

REFUSED = [
    ("unknown-name", ("energi",), {}),
    ("unknown-name", ("energy",), {"size": 1}),
    ("energy-too-low", ("energy",), {"E": -1.5, "n": 3}),
    ("energy-too-low", ("energy",), {"E": -1.0, "n": 3}),
    ("not-finite", ("energy",), {"E": np.nan}),
    ("box-empty", ("liouville",), {"box": CUBE | {"q1": (2, 3)}, "n": 3}),
    ("energy-box-empty", ("energy",), {"box": {"q1": (2, 3)}, "E": 1.0, "n": 3}),
    ("box-unbounded", ("liouville",), {"box": {"p1": (0, 1)}}),
    ("unknown-name", ("liouville",), {"box": CUBE | {"q7": (0, 1)}}),
    ("bounds-malformed", ("liouville",), {"box": CUBE | {"q1": 3}}),
    ("unknown-name", ("neighbourhood",), {"vary": {"gravit": (1, 2)}}),
    ("varied-and-given", ("neighbourhood",), {"vary": {"mass": (1, 2)}, "parameters": {"mass": [1] * 50}}),
    ("grid-of-other-number", ("grid",), {"values": {"q1": [1, 2], "mass": [1, 2, 3]}}),
    ("grid-h-given-twice", ("grid",), {"values": {"h": [1]}, "n": None}),
]


def test_what_cannot_be_drawn_is_refused_in_a_sentence(monkeypatch):
    monkeypatch.setattr("daebench.starts.walk.STEPS", 200)  # searches that find nothing are given up earlier
    for code, names, settings in REFUSED:
        with refused(code, says=("came to is -1",) * (code == "energy-too-low")):  # -m g l
            drawn("planar_pendulum", *names, case="horizontal", **settings)


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
