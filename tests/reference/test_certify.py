"""Certification: the digits are right, what was found about them is right, and wrong motions are refused."""

from dataclasses import replace
from functools import cache

import definitions
import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from ivps import ivp
from kept_stages import computations, computations_at, spoiled, times
from measures import error_of
from refusals import refused

from daebench.compiler.definition import source_of
from daebench.errors import RunFailed
from daebench.methods.solvers import taylor_equations
from daebench.methods.solvers.taylor_equations import Translation, library, orthogonally
from daebench.problems import knife_edge
from daebench.reference.keep.definition import Definition, define
from daebench.reference.make import constrained, coordinates
from daebench.reference.make.certify import NotCertified, amplification, certify, double_horizon, largest_so_far, smallest_singular_values
from daebench.reference.make.certify import growth as growth_of
from daebench.reference.make.constrained import Functions
from daebench.reference.make.coordinates import Along, Local
from daebench.reference.make.independent_computations import integrated
from daebench.runs.make_ivp import make_ivp
from daebench.systems.constrained import Case

GRAVITY = mp.fraction(981, 100)  # with as many digits as are worked with


@pytest.fixture(autouse=True)
def fifty_digits():
    with mp.workdps(50):
        yield


def extrapolated(rates, y, t, steps):
    """Return the solution of y' = rates(y) at t by Gragg's midpoint rule, extrapolated in 18 columns: about 45 digits."""
    H = t / steps
    for _ in range(steps):
        table = []
        for k in range(1, 19):
            h, before, now = H / (2 * k), y, y + H / (2 * k) * rates(y)
            for _ in range(2 * k - 1):
                before, now = now, before + 2 * h * rates(now)
            row = [now]
            for j, last in enumerate(table[-1] if table else [], 1):
                row.append(row[-1] + (row[-1] - last) / ((mp.mpf(k) / (k - j)) ** 2 - 1))
            table.append(row)
        y = table[-1][-1]
    return y


def double_pendulum_in_angles(t, angle):
    """Return positions of the double pendulum with unit masses and rods, gravity 981/100, released at rest, straight."""

    def rates(y):
        a, b, u, w = y
        c, s = mp.cos(a - b), mp.sin(a - b)
        f, k = -s * w**2 - 2 * GRAVITY * mp.sin(a), s * u**2 - GRAVITY * mp.sin(b)
        return np.array([u, w, (f - c * k) / (2 - c**2), (2 * k - c * f) / (2 - c**2)])

    a, b, *_ = extrapolated(rates, np.array([angle, angle, mp.mpf(0), mp.mpf(0)]), t, 32)
    return [mp.sin(a), -mp.cos(a), mp.sin(a) + mp.sin(b), -mp.cos(a) - mp.cos(b)]


def rotating():
    """Return the motions of the rotating pendulum up to t = 2."""
    return computations("planar_pendulum", "rotating", 2, 16)


def apart(found, expected):
    """Return the largest difference of two rows of numbers."""
    return max(abs(x - y) for x, y in zip(found, expected, strict=True))


@cache
def swing():
    """Return the motions of a double pendulum from the horizontal, and its positions at t = 1 by hand."""
    with mp.workdps(50):
        return computations("double_pendulum", "horizontal", 1, 16), double_pendulum_in_angles(mp.mpf(1), mp.pi / 2)


def test_taylor_series_in_both_coordinates_agree_with_a_motion_written_by_hand():
    found, expected = swing()
    for way in (found.own(), found.other()):
        assert apart(way.parts["q"][-1], expected) < 1e-31


def test_velocities_along_the_manifold_give_the_motion_written_by_hand_through_more_than_a_right_angle():
    found, expected = swing()
    along = Along(found.definition)
    start = along.entered([x for part in found.definition.start_numbers() for x in part])
    rows = along.left(integrated(along.equations, start, found.times, pieces=along))
    assert expected[0] < 0  # the upper rod, horizontal at the start, has passed the vertical
    assert apart(rows[-1][:4], expected) < 1e-31


def test_a_knife_edge_on_a_belt_that_moves_is_certified_with_the_energy_that_the_belt_gives():
    """In axes that move with the belt it is the knife edge on an incline at rest: velocities along the manifold take affine terms."""
    still, w = knife_edge.problem(), sp.Rational(1, 2)
    m, theta, _ = still.parameters
    belt = replace(
        still,
        velocity=[still.velocity[0] - sp.sin(still.q[2]) * w],
        cases={"riding": Case(q=(0, 0, 0), p=(m * w, 0, theta * sp.pi / 3))},
        integrals={},
        closed_form=None,
    )
    made = computations_at(make_ivp(source_of(belt, "belt"), "riding"), 1, 8)
    found = certify(made)
    assert "velocities along the manifold" in found.checks[-1]["against"]
    values = made.definition.values()
    q, p = still.closed_form(mp.mpf(1), [0, 0, 0], [0, 0, values["inertia"] * mp.pi / 3], values)
    mass, parts = values["mass"], {part: rows[-1] for part, rows in found.states.parts.items()}
    moving = [p[0] + mass / 2, p[1]]
    assert apart(parts["q"], [q[0] + mp.mpf(1) / 2, q[1], q[2], 1]) < 1e-31
    assert apart(parts["p"][:3], [*moving, p[2]]) < 1e-31
    energy = (moving[0] ** 2 + moving[1] ** 2) / (2 * mass) - mass * values["gravity"] * mp.sin(mp.pi / 4) * parts["q"][0]
    assert abs(parts["p"][3] - (mass / 8 - energy)) < 1e-30
    assert abs(parts["p"][3]) > 1


def test_a_problem_with_a_redundant_constraint_is_certified_with_multipliers_of_least_norm():
    """Links in parallel: the motion is that of one pendulum, theta'' = -gravity sin theta, whatever is redundant."""
    links = definitions.parallelogram()
    scaled = replace(links, g=[links.g[0], 3 * links.g[1], *links.g[2:]])  # so that the norm matters, which is that of runs
    where = make_ivp(source_of(scaled, "parallelogram_scaled"), "thrown")
    found = certify(computations_at(where, 1, 16))
    assert found.states.mathematics.redundant
    theta, _ = extrapolated(lambda y: np.array([y[1], -GRAVITY * mp.sin(y[0])]), np.array([mp.mpf(0), mp.mpf(2)]), mp.mpf(1), 16)
    expected = [mp.sin(theta), -mp.cos(theta), 2 + mp.sin(theta), -mp.cos(theta)]
    assert apart(found.states.parts["q"][-1], expected) < 1e-31
    for row in zip(*found.states.parts.values(), strict=True):
        q, p, lam = (np.array(part, dtype=float) for part in row)
        G, of_runs = where.value("G", q), where.value("lam", p, q)
        A = G @ where.value("H_pp", p, q) @ G.T
        W = np.abs(A / np.abs(A).max(axis=1)[:, None]).max(axis=0)
        assert error_of(W * lam, np.linalg.lstsq(G.T / W, G.T @ of_runs, rcond=1e-9)[0]) < 1e-12
        assert error_of(lam, of_runs) < 1e-12


def test_certified_digits_of_a_motion_without_a_closed_form_lie_within_their_bounds():
    made, expected = swing()
    found = certify(made)
    errors = np.abs(np.array(found.states.parts["q"][-1]) - expected).astype(float)
    assert np.all(errors <= found.bound["q"][-1])
    assert found.bound["q"].max() < 1e-29


def test_a_closed_form_is_the_truth_where_there_is_one_and_multipliers_are_those_of_newton():
    found = certify(computations("planar_pendulum", "iftomm_a01", 2, 16))
    assert found.method.startswith("closed form")
    for q, p, lam in zip(*found.states.parts.values(), strict=True):
        assert abs(2 * lam[0] - (p[0] ** 2 + p[1] ** 2 - GRAVITY * q[1])) < 1e-33  # the rod's pull, centripetal


def test_the_second_run_has_other_rounding_and_the_start_has_none():
    found = computations("double_pendulum", "swing", 1, 16)
    again = integrated(taylor_equations.own_coordinates(found.definition), found.own().rows[0], found.times, parts=3)
    assert 0 < apart(found.own().rows[-1], again[-1]) < 1e-31
    assert [found.own().parts[part][0] for part in "qp"] == found.definition.start_numbers()


def test_orthogonalised_columns_solve_where_every_pivot_vanishes():
    hy = library()
    x = hy.make_vars("x")
    numbers = [[0, 2, 1], [3, 0, -2], [1, 1, 0]], [5, -1, 4]
    A, b = ([[x * k for k in row] for row in numbers[0]], [x * k for k in numbers[1]])
    found = hy.cfunc(orthogonally(A, b), vars=[x])([1.5])
    np.testing.assert_allclose(found, np.linalg.solve(*numbers), rtol=1e-14, atol=1e-14)


@pytest.mark.parametrize(
    ("problem", "case", "way"), [("double_pendulum", "horizontal", "solved"), ("rigid_body_rotation", "free", "orthogonally")]
)
def test_columns_are_orthogonalised_where_rates_are_not_those_of_the_angles(problem, case, way, monkeypatch):
    used = []
    for name in ("solved", "orthogonally"):
        monkeypatch.setattr(coordinates, name, lambda A, b, name=name: used.append(name) or b)
    assert Local(define(problem, case)).equations
    assert set(used) == {way}


@pytest.mark.slow
def test_the_heavy_top_goes_on_where_a_pivot_of_its_chart_vanishes():
    found = computations("rigid_body_rotation", "heavy_top", 0.5, 8)
    assert apart(found.own().rows[-1], found.other().rows[-1]) < 1e-26


def test_a_function_without_a_counterpart_is_named():
    x = sp.Symbol("x")
    with refused("no-quadruple-counterpart", says=("gamma",)):
        Translation({x: library().make_vars("x")})(sp.gamma(x))


def test_a_series_that_blows_up_says_where():
    x = library().make_vars("x")
    with refused("taylor-series-stopped", RunFailed, says=("1.0", "1.125")):
        integrated([(x, x * x)], [mp.mpf(1)], times(2, 16))


# ---- wrong motions -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("case", [("planar_pendulum", "rotating"), ("double_pendulum", "horizontal")], ids=lambda case: case[0])
@pytest.mark.parametrize("share", ["1e-3", "1e-26"])
def test_an_equation_that_is_wrong_by_a_little_is_refused(case, share, monkeypatch):
    right = taylor_equations.own_coordinates
    monkeypatch.setattr(constrained, "own_coordinates", lambda definition: spoiled(right(definition), definition.derivation.d, share))
    with refused("reference-computations-differ", NotCertified):
        certify(computations(*case, 1, 16))


@pytest.mark.parametrize(
    ("coordinates", "rate", "definition"),
    [(Local, 0, ("double_pendulum", "horizontal")), (Along, 4, definitions.double_pendulum)],
    ids=["chart", "velocities along the manifold"],
)
def test_other_coordinates_with_a_wrong_rate_are_refused(coordinates, rate, definition, monkeypatch):
    right = coordinates.equations.func
    monkeypatch.setattr(coordinates, "equations", property(lambda self: spoiled(right(self), rate, "1e-25")))
    made = (
        computations_at(make_ivp(source_of(definition(), "tied"), "bent"), 1, 16)
        if callable(definition)
        else computations(*definition, 1, 16)
    )
    with refused("reference-computations-differ", NotCertified):
        certify(made)


def test_a_closed_form_that_is_wrong_is_refused(monkeypatch):
    found = rotating()
    problem = found.definition.derivation.problem
    monkeypatch.setitem(vars(problem), "closed_form", lambda t, *rest, form=problem.closed_form: form(t * (1 + mp.mpf("1e-27")), *rest))
    with refused("reference-computations-differ", NotCertified):
        certify(found)


def test_what_has_neither_closed_form_nor_chart_is_refused():
    with refused("reference-not-certifiable", NotCertified):
        certify(computations_at(make_ivp(source_of(definitions.relativistic(), "tied"), "tied"), 1, 16))


def test_lost_rank_is_refused_with_its_time(monkeypatch):
    found, states = rotating(), iter(range(100))
    certified = certify(found)
    monkeypatch.setattr(Functions, "smallest_singular_value", lambda *_: 1e-9 if next(states) == 4 else 4.0)
    with refused("reference-nearly-singular", NotCertified, says=("1e-09", "0.5")):
        smallest_singular_values(found.definition.name, found, certified)


def test_a_bound_never_falls_and_is_never_below_rounding():
    states = rotating().own()
    found = {part: np.zeros((17, 2 if part != "lam" else 1)) for part in ("q", "p", "lam")}
    found["q"][3, 0] = 1e-20
    bound = largest_so_far([found], states)["q"]
    assert np.all(np.diff(bound, axis=0) >= 0)
    assert [bound[2, 0], *bound[16]] == pytest.approx([1e-33, 1e-19, 1e-33])


def test_a_reference_ends_where_its_bound_is_no_better_than_a_double(monkeypatch):
    monkeypatch.setattr("daebench.reference.make.certify.WORTH", 1e-31)
    found = certify(computations("double_pendulum", "horizontal", 4, 64))
    assert 8 <= len(found.t) == len(found.bound["q"]) < 65


# ---- multiprecision functions and amplification --------------------------------------------------------------------------


@pytest.mark.parametrize("place", ["spherical-fast", "stretched-M", "relativistic", "double-pendulum", "coupled-rods"])
def test_functions_in_mpmath_and_the_index_reduced_equation_are_those_of_the_kernels_off_the_manifold_too(place):
    where, hy = ivp(place), library()
    definition, q, p = Definition(where, {}), where.q0 + 0.01, where.p0 + 0.02
    functions, state = Functions(definition), (list(q), list(p))
    for name, values, rtol, atol in (
        ("H", [functions.energy(*state)], 1e-12, 0),
        ("lam", functions.lam(*state), 1e-12, 0),
        ("g", functions.g(state[0]), 0, 1e-14),
        ("Gv", functions.Gv(*state), 1e-12, 1e-14),
    ):
        expected = np.ravel(where.value(name, *((q,) if name == "g" else (p, q))))
        np.testing.assert_allclose(np.array(values, dtype=float), expected, rtol, atol)
    variables, rates = zip(*taylor_equations.own_coordinates(definition), strict=True)
    compiled = hy.cfunc([hy.expression(rate) if isinstance(rate, hy.real128) else rate for rate in rates], vars=list(variables))
    force = -where.value("H_q", p, q) - where.value("G", q).T @ where.value("lam", p, q)
    np.testing.assert_allclose(compiled(np.concatenate([q, p])), [*where.value("H_p", p, q), *force], rtol=1e-12, atol=1e-13)


def test_amplification_is_that_of_neighbours_by_the_closed_form():
    found = rotating()
    certified = certify(found)
    growth = amplification(found, certified).start
    form, eps = found.definition.derivation.problem.closed_form, mp.mpf("1e-15")
    size = max(abs(x) for row in certified.states.parts["p"] for x in row)

    def state(t, turn, faster):
        """The state from the lowest point, turned by an angle, at some speed; momenta in units of the largest."""
        v = mp.mpf(5) / 2 + faster
        start = [mp.sin(turn), -mp.cos(turn)], [v * mp.cos(turn), v * mp.sin(turn)]
        q, p = form(mp.mpf(t), *start, {"mass": 1, "length": 1, "gravity": 1})
        return np.array([*q, *(x / size for x in p)])

    def tangent(t):
        return np.array([(state(t, *beside) - state(t, 0, 0)) / eps for beside in ((eps, 0), (0, eps))], dtype=float).T

    assert growth[0] == pytest.approx(1, rel=1e-9)
    assert growth[-1] == pytest.approx(np.linalg.norm(tangent(2) @ np.linalg.pinv(tangent(0)), 2), rel=1e-9)


def test_growth_from_a_time_on_the_way_is_found_where_the_motion_converges_again():
    C = np.array([np.eye(2), np.diag([10, 0.1]), np.diag([1, 1]), np.diag([0.5, 2])])
    found = growth_of(C)
    np.testing.assert_allclose(found.start, [1, 10, 1, 2])
    np.testing.assert_allclose(found.worst, [1, 10, 10, 20])
    np.testing.assert_allclose(found.step, [1, 10, 10, 2])


def test_the_horizon_of_double_precision_is_where_a_rounded_start_is_lost():
    growth = np.array([1.0, 1e10, 2e14, 1e16])
    assert double_horizon([0, 1, 2, 3], growth) == 2.0
    assert double_horizon([0, 1], growth[:2]) is None
