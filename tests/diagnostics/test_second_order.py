"""Constraints that depend on each other: redundant ones, those that forbid more at second order, and those that contradict each other."""

import itertools
import math
import re

import numpy as np
import pytest
import sympy as sp
from refusals import refused

from daebench.compiler.definition import source_of
from daebench.diagnostics.consistency import projected, require_consistent
from daebench.diagnostics.contradiction import contradiction
from daebench.diagnostics.freedom import dependence, freedom, redundant
from daebench.diagnostics.problem.check import held
from daebench.diagnostics.second_order import require_motion, semidefinite
from daebench.errors import InconsistentStart
from daebench.joints import Body, Mechanism, Revolute, Spherical
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.runs.make_ivp import make_ivp
from daebench.systems.constrained import Case, ConstrainedHamiltonian, coordinates

UNITS = (1.0, 1e-9, 1e7)


def points(places, pairs, momenta=None, dim=3, distances=None, unit=1.0, masses=None):
    """Points with prescribed distances, those of their places unless others are given."""
    n = len(places)
    q, p = coordinates(dim * n)
    X = [sp.Matrix(q[dim * k : dim * (k + 1)]) for k in range(n)]
    x = unit * np.array(places, dtype=float)
    given = distances or {}
    lengths = {(i, j): unit * given.get((i, j), float(np.linalg.norm(x[i] - x[j])) / unit) for i, j in pairs}
    g = [(X[i] - X[j]).dot(X[i] - X[j]) - sp.Float(length) ** 2 for (i, j), length in lengths.items()]
    M = sp.diag(*[m for m in (masses or range(1, n + 1)) for _ in range(dim)])
    p0 = np.zeros(dim * n) if momenta is None else np.ravel(momenta)
    case = Case(q=tuple(map(float, np.ravel(x))), p=tuple(map(float, p0)))
    return make_ivp(source_of(ConstrainedHamiltonian(q=q, p=p, M=M, U=0, g=g, cases={"a": case}), "points"), "a")


def pairs(n):
    return list(itertools.combinations(range(n), 2))


def line(*xs):
    direction = np.array([2, 3, 6]) / 7
    return [x * direction for x in xs]


LINES = {"three": (-1, 0, 1.3), "three, unequal": (0, 1, 5), "four": (-1.6, -0.6, 0.6, 1.6), "five": (0, 1, 2.5, 3, 4.2)}
TETRAHEDRON = [(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]
REDUNDANT = {
    "methane": ([(0, 0, 0), *TETRAHEDRON], pairs(5), 6),
    "octahedron with its diagonals": ([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], pairs(6), 6),
}


@pytest.mark.sampled(by=lambda case: case in ("three-1e-09", "three, unequal-10000000.0", "four-1.0"))
@pytest.mark.parametrize("unit", UNITS, ids=str)
@pytest.mark.parametrize("xs", LINES.values(), ids=LINES)
def test_points_held_in_a_line_by_distances_have_five_degrees_of_freedom(xs, unit):
    molecule = points(line(*xs), pairs(len(xs)), unit=unit)
    found = freedom(molecule)
    assert (found.degrees, found.forbidden) == (5, 2 * (len(xs) - 2))
    assert not redundant(molecule)
    assert "remove" not in dependence(molecule)


@pytest.mark.sampled(by=lambda case: case == "methane")
@pytest.mark.parametrize("shape", REDUNDANT.values(), ids=REDUNDANT)
def test_what_is_redundant_in_a_body_stays_so(shape):
    places, of, degrees = shape
    found = freedom(points(places, of))
    assert (found.degrees, found.forbidden, found.permanent) == (degrees, 0, True)


def test_a_molecule_may_have_both():
    xs = line(-1, 0, 1)
    twice = points(xs, [(0, 1), (1, 2), (0, 2), (0, 1)])
    assert (freedom(twice).rank, freedom(twice).forbidden, freedom(twice).degrees) == (2, 2, 5)


@pytest.mark.sampled(left_out=("balls",))
@pytest.mark.parametrize(("joint", "more"), [(Spherical, ()), (Revolute, ((0, 0, 1),))], ids=["balls", "hinges"])
def test_a_door_on_two_joints_turns(joint, more):
    door = Mechanism(
        points={"P": (0, 0, 0), "R": (0, 0, 1)},
        bodies={"door": Body("P", "R", mass=12, centre=("0.4", 0, 1), inertia=(5, 5, 1))},
        joints=[joint("door", "ground", at, *more) for at in "PR"],
    )
    counted = freedom(make_ivp(source_of(door.problem())))
    assert (counted.degrees, counted.forbidden) == (1, 0)


@pytest.mark.sampled(by=lambda case: case == "three, unequal")
@pytest.mark.parametrize("xs", LINES.values(), ids=LINES)
def test_a_velocity_that_bends_a_line_is_refused_and_one_that_turns_it_is_not(xs):
    places, m = np.array(line(*xs)), np.arange(1, len(xs) + 1)
    across = np.array([3, -2, 0]) / 13**0.5
    turn = np.outer(m * xs, across)
    bend = turn.copy()
    bend[1] += across
    require_motion(points(places, pairs(len(xs)), turn + m[:, None] * np.array([1, 2, 3])))
    for check in (require_motion, initial_value_problem):
        with refused("no-motion-at-second-order"):
            check(points(places, pairs(len(xs)), bend))


def test_places_where_branches_cross_are_not_called_tangential():
    assert freedom(initial_value_problem("four_bar", "iftomm")).forbidden == 0
    where = initial_value_problem("slider_crank", "lock_up")
    at = make_ivp(where.source, "lock_up", q0=[0.0, -1.0, 0.0], p0=[0.0, 0.0, 0.0])
    assert freedom(where).forbidden == freedom(at).forbidden == 0
    branch, none = (
        make_ivp(where.source, "lock_up", q0=at.q0, p0=where.value("mass", at.p0, at.q0) @ [1.0, 0.0, turn]) for turn in (2.0, 1.0)
    )
    require_motion(branch)
    with refused("no-motion-at-second-order"):
        require_motion(none)


def test_a_definite_form_is_found_in_a_span_of_indefinite_ones_and_only_there(random):
    for _ in range(20):
        v, others = random.normal(size=(5, 5)), random.normal(size=(2, 5, 5))
        others = others + others.transpose(0, 2, 1)
        found = semidefinite(np.einsum("ab,bij->aij", random.normal(size=(3, 3)), [v @ v.T, *others]))
        assert found is not None
        assert np.linalg.eigvalsh(found)[0] > -1e-5
        assert semidefinite(others - np.trace(others, axis1=1, axis2=2)[:, None, None] * np.eye(5) / 5) is None


ANGLE = {(i, j): math.sqrt(2 * (1 + 0.31869)) for i, j in itertools.combinations(range(1, 5), 2)}
CONTRADICTORY = {
    "six equal angles": ([(0, 0, 0), *(np.array(TETRAHEDRON) / 3**0.5)], pairs(5), ANGLE | {(0, k): 1.0 for k in range(1, 5)}),
    "a triangle": ([(0, 0, 0), (1, 0, 0), (0, 1, 0)], pairs(3), {(0, 1): 1.0, (1, 2): 1.0, (0, 2): 2.1}),
    "a regular five-cell in space": ([(0, 0, 0), *TETRAHEDRON], pairs(5), dict.fromkeys(pairs(5), 1.0)),
}


@pytest.mark.sampled(by=lambda case: case == "a triangle-10000000.0")
@pytest.mark.parametrize("unit", UNITS, ids=str)
@pytest.mark.parametrize("shape", CONTRADICTORY.values(), ids=CONTRADICTORY)
def test_a_contradiction_is_named_with_the_least_residual(shape, unit):
    body = points(*shape[:2], distances=shape[2], unit=unit)
    for check in (require_consistent, projected):
        with refused("constraints-contradict") as caught:
            check(body)
        assert re.search(r"\|g\d+\| = \S+;", str(caught.value))


def test_a_check_names_a_contradiction_of_given_parameters_too():
    q, p = coordinates(2)
    radius = sp.Symbol("radius", positive=True)
    g = [q[0] ** 2 + q[1] ** 2 - radius**2, q[0] ** 2 + q[1] ** 2 - q[0]]
    circles = ConstrainedHamiltonian(q=q, p=p, M=sp.eye(2), U=0, g=g, parameters={radius: 1}, cases={"a": Case(q=(1, 0), p=(0, 0))})
    told = [contradiction(make_ivp(source_of(circles, "circles"), "a", {"radius": r})) for r in (0.5, 2)]
    assert (told[0], bool(told[1])) == ("", True)
    faults = [finding.fault for finding in held(make_ivp(source_of(circles, "circles"), "a", {"radius": 2}))]
    assert any("no configuration" in fault for fault in faults)


def test_of_residuals_that_differ_by_rounding_the_first_is_named(monkeypatch):
    shape = CONTRADICTORY["a triangle"]
    body = points(*shape[:2], distances=shape[2])
    for residuals, named in (((0.5, 0.5, 0.1), "g1"), ((0.1, 0.5, 0.5), "g2"), ((0.49, 0.5, 0.5), "g2"), ((0.5, 0.49, 0.51), "g3")):
        for larger in range(3):
            rounded = np.array(residuals)
            rounded[larger] *= 1 + 1e-12
            monkeypatch.setattr("daebench.diagnostics.contradiction._least_squares", lambda *_, rounded=rounded: rounded)
            assert f"|{named}| = " in contradiction(body), (residuals, larger)


@pytest.mark.parametrize("shape", [REDUNDANT["methane"], (line(-1, 0, 1.3), pairs(3), 5)], ids=["methane", "line"])
def test_a_bad_start_of_a_body_that_exists_is_no_contradiction(shape, random):
    body = points(*shape[:2])
    for shift in (1e-6, 0.05, 0.3):
        moved = make_ivp(body.source, "a", q0=body.q0 + shift * random.normal(size=body.d))
        with pytest.raises(InconsistentStart):
            require_consistent(moved)
