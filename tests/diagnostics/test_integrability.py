"""Integrability of constraints on velocities: distributions whose derived flag is in textbooks, and integrals in disguise."""

import numpy as np
import pytest
import sympy as sp

from daebench.compiler.definition import source_of
from daebench.diagnostics.integrability import derived_flag, integrability
from daebench.diagnostics.problem.check import held
from daebench.runs.make_ivp import make_ivp
from daebench.systems.constrained import Case, ConstrainedHamiltonian, coordinates

x, y, z, u, w = sp.symbols("x y z u w", real=True)

FLAGS = {
    "contact form in R^3": ([[-y, 0, 1]], (x, y, z), [1, 0]),
    "Engel in R^4": ([[-z, 1, 0, 0], [-u, 0, 1, 0]], (x, y, z, u), [2, 1, 0]),
    "Goursat in R^5": ([[-z, 1, 0, 0, 0], [-u, 0, 1, 0, 0], [-w, 0, 0, 1, 0]], (x, y, z, u, w), [3, 2, 1, 0]),
    "(2, 3, 5) of Cartan": ([[-y, 0, 1, 0, 0], [-(y**2), 0, 0, 1, 0], [-z, 0, 0, 0, 1]], (x, y, z, u, w), [3, 2, 0]),
    "two contact forms": ([[-y, 0, 1, 0, 0], [0, 0, 0, 1, -x]], (x, y, z, u, w), [2, 0]),
    "an exact form": ([[y * z * sp.exp(x), z * sp.exp(x), y * sp.exp(x)]], (x, y, z), [1]),
    "Chaplygin's sleigh": ([[sp.sin(z), -sp.cos(z), 0]], (x, y, z), [1, 0]),
    "rolling disc": ([[1, 0, 0, -sp.cos(z)], [0, 1, 0, -sp.sin(z)]], (x, y, z, u), [2, 1, 0]),
    "ball on a plane": ([[1, 0, 0, -1, 0], [0, 1, 0, 0, -1]], (x, y, z, u, w), [2]),
}


def forms(rows, q):
    call = sp.lambdify([q], [list(row) for row in rows], "mpmath")
    return lambda at: np.array(call(list(at)), dtype=object)


@pytest.mark.parametrize(("rows", "q", "expected"), FLAGS.values(), ids=FLAGS)
def test_the_derived_flag_has_the_dimensions_of_the_textbook(random, rows, q, expected):
    assert derived_flag(forms(rows, q), random.standard_normal(len(q))) == expected


def posed(q, rows, g=(), start=None, parameters=None, time=None, more=()):
    """Return a case with the rows as constraints on velocities; ``more`` are their terms without one."""
    d = len(q)
    p, v = sp.symbols(f"p1:{d + 1}", real=True), sp.symbols(f"v1:{d + 1}", real=True)
    velocity = list(sp.Matrix(rows) * sp.Matrix(v) + sp.Matrix([*more] or [0] * len(rows)))
    given = {"q": q, "p": p, "v": v, "t": time, "M": sp.eye(d), "U": sp.S.Zero, "g": list(g), "velocity": velocity}
    problem = ConstrainedHamiltonian(**given, parameters=parameters or {}, cases={"a": Case(q=start or [0] * d, p=[0] * d)})
    return make_ivp(source_of(problem, "posed"), "a")


def in_any_coordinates(random, q, degree=1):
    """Return a random polynomial."""
    value = sum(sp.Rational(int(random.integers(-9, 10)), 4) * a for a in (1, *q))
    pairs = [random.choice(len(q), 2) for _ in range(2 * (degree - 1))]
    return value + sum(sp.Rational(int(random.integers(-9, 10)), 4) * q[a] * q[b] for a, b in pairs)


def drawn(random):
    """Return h rows that are differentials times functions, n that are not, all combined by functions, and h.

    Two directions or more are left free: polynomial rows drawn at random then leave no combination that is a differential.
    """
    h, n = random.choice([(0, 1), (1, 0), (1, 1), (2, 0), (0, 2), (2, 1)])
    q = coordinates(int(h + n + 2 + random.integers(2)))[0]
    hidden = [in_any_coordinates(random, q, 2) for _ in range(h)]
    factors = [sp.exp(in_any_coordinates(random, q) / 8), 2 + sp.sin(in_any_coordinates(random, q)), 1 + in_any_coordinates(random, q) ** 2]
    rows = [random.choice(factors) * sp.Matrix([f]).jacobian(q) for f in hidden]
    rows = sp.Matrix.vstack(*rows, *(sp.Matrix([[in_any_coordinates(random, q) for _ in q]]) for _ in range(n)))
    mixing = sp.Matrix(h + n, h + n, lambda i, j: 1 if i == j else in_any_coordinates(random, q) / 4)
    return q, (mixing * rows).tolist(), hidden


def test_hidden_differentials_are_counted_and_written_whatever_their_factors(random):
    # Hundreds of draws, also of functions that are not written, are an experiment: none of them was counted wrongly.
    for _ in range(2):
        q, rows, hidden = drawn(random)
        found = integrability(posed(q, rows))
        assert found.count == len(found.functions) == len(hidden)
        at = dict(zip(q, random.standard_normal(len(q)), strict=True))
        slopes = [[f.diff(a).subs(at) for a in q] for f in (*hidden, *(one.function for one in found.functions))]
        assert not hidden or np.linalg.matrix_rank(np.array(slopes, dtype=float), tol=1e-6) == len(hidden)


def robot(radius, half):
    """Return rows of a robot with two wheels: at the left wheel, across, at the right wheel."""
    along, across = [sp.cos(z), sp.sin(z)], [sp.sin(z), -sp.cos(z)]
    return [[*along, -half, -radius, 0], [*across, 0, 0, 0], [*along, half, 0, -radius]]


def test_the_constraint_on_positions_of_a_robot_with_two_wheels_is_found_with_its_parameters_by_a_check_and_not_by_a_run(monkeypatch):
    r, c = sp.symbols("r c", positive=True)
    ivp = posed((x, y, z, u, w), robot(r, c), parameters={r: 0.05, c: 0.2})
    found = integrability(ivp)
    assert (found.count, found.flag) == (1, (3, 2, 1))
    (one,) = found.functions
    assert one.constraints == (0, 2)
    assert sp.expand(one.function**2 - (r * (u - w) + 2 * c * z) ** 2) == 0
    (note,) = [finding.note for finding in held(ivp) if finding.note]
    assert all(part in note for part in ("2 degrees of freedom", "velocity1 and velocity3", "= const"))
    monkeypatch.setattr("daebench.diagnostics.problem.check.integrability", lambda _: pytest.fail("a run asked"))
    assert not any(finding.note or finding.fault for finding in held(ivp, noted=False))


ANGLED = {"sleigh": [sp.sin(z), -sp.cos(z), 0, 0], "cart": [sp.cos(z) * (1 + y**2), sp.sin(z) * (1 + y**2), 0, -1 - y**2]}


@pytest.mark.parametrize("row", ANGLED.values(), ids=ANGLED)
def test_a_constraint_that_is_none_on_positions_is_said_to_be_nonholonomic(row):
    found = integrability(posed((x, y, z, u), [row]))
    assert (found.count, found.functions) == (0, ())
    assert "nonholonomic" in found.words


def test_what_is_a_differential_only_where_g_is_zero_is_found_there():
    # (1 + g) dz + g z dy, with g = x^2 + y^2 - 1, and two further positions: z = const on the circle, and no function of all positions.
    g = x**2 + y**2 - 1
    found = integrability(posed((x, y, z, u), [[0, g * z, 1 + g, 0]], g=[g], start=[1, 0, 2, 0]))
    assert (found.count, found.flag) == (1, (2,))
    assert [str(one.function) for one in found.functions] == ["z"]


def test_an_angle_that_is_no_position_is_counted_and_not_written_and_a_row_that_follows_from_g_is_not_counted():
    # x dy - y dx on the circle is the differential of its angle.
    g = [x**2 + y**2 - 1]
    found = integrability(posed((x, y, z, u), [[-y, x, -2, 0]], g=g, start=[1, 0, 0, 0]))
    assert (found.count, found.functions, "1 of these as no function" in found.words) == (1, (), True)
    assert integrability(posed((x, y, z), [[x, y, 0]], g=g, start=[1, 0, 0])).count == 0


def test_a_prescribed_velocity_is_a_position_in_time():
    speed, t = sp.Symbol("speed", real=True), sp.Symbol("t", real=True)
    found = integrability(posed((x, y, z), [[1, 0, 0]], parameters={speed: 0.3}, time=t, more=[-speed * t]))
    assert found.count == 1
    assert sp.expand(found.functions[0].function) in (2 * x - speed * t**2, speed * t**2 - 2 * x)
    assert integrability(posed((x, y, z), [[1, 0, 0]], parameters={speed: 0.3}, more=[-speed * y])).count == 0


def test_a_problem_of_many_positions_is_said_not_to_be_examined():
    q = coordinates(41)[0]
    (note,) = [finding.note for finding in held(posed(q, [[sp.sin(q[2]), -sp.cos(q[2]), *[0] * 39]])) if finding.note]
    assert "not examined" in note
