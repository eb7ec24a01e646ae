"""Mistakes in constraints on velocities: each is one sentence that says what is wrong, where, and what to do."""

import numpy as np
import pytest
import sympy as sp
from refusals import refused

from daebench.compiler.definition import source_of
from daebench.diagnostics.problem.check import held
from daebench.errors import InvalidProblem
from daebench.runs.make_ivp import make_ivp
from daebench.systems.constrained import Case, ConstrainedHamiltonian, coordinates

Q, P = coordinates(3)
V = sp.symbols("v1:4", real=True)
EDGE = sp.sin(Q[2]) * V[0] - sp.cos(Q[2]) * V[1]


def defined(**parts):
    case = Case(q=(0, 0, 0), p=(1, 0, 1))
    usual = {"q": Q, "p": P, "v": V, "M": sp.eye(3), "U": sp.S.Zero, "g": [], "velocity": [EDGE], "cases": {"a": case}}
    return ConstrainedHamiltonian(**usual | parts)


MISTAKES = {
    "no v": ({"v": None}, "velocity-without-v", ["v="]),
    "too few v": ({"v": V[:2]}, "entries-not-per-position", ["v", "2", "3"]),
    "v that are positions": ({"v": Q}, "name-stands-for-two", ["q1, q2, q3"]),
    "v that are texts": ({"v": ("a", "b", "c")}, "not-a-symbol", ["v", "'a'"]),
    "quadratic": (
        {"velocity": [EDGE, V[0] ** 2 - V[1]]},
        "velocity-not-linear",
        ["velocity[1]", "v1**2 - v2"],
    ),
    "momenta": (
        {"velocity": [P[0] - P[1]]},
        "symbol-undeclared",
        ["velocity", "p1, p2", "p = M v"],
    ),
    "an undeclared symbol": ({"velocity": [V[0] - sp.Symbol("w")]}, "symbol-undeclared", ["velocity", "w"]),
    "no sequence": ({"velocity": EDGE}, "not-a-sequence", ["velocity", "v1*sin(q3) - v2*cos(q3)"]),
    "an equation": ({"velocity": [sp.Eq(V[0], V[1])]}, "equation-for-expression", ["velocity", "Eq(v1, v2)"]),
    "a row of A": ({"velocity": [[1, 0, 0]]}, "not-an-expression", ["velocity", "[1, 0, 0]"]),
    "an array": (
        {"velocity": np.array([1.0, 0.0])},
        "velocity-absent",
        ["velocity[0]", "1.0", "g"],
    ),
    "an empty row": ({"velocity": [0 * V[0]]}, "velocity-absent", ["velocity[0]", "0"]),
    "a kink": ({"velocity": [sp.Abs(Q[0]) * V[0]]}, "function-not-differentiable", ["velocity[0]", "Abs(q1)"]),
    "positions": ({"velocity": [Q[0] - Q[1]]}, "velocity-absent", ["velocity[0]", "q1 - q2", "g"]),
}


@pytest.mark.parametrize(("parts", "code", "names"), MISTAKES.values(), ids=MISTAKES)
def test_a_mistake_in_a_constraint_on_velocities_is_named(parts, code, names):
    with refused(code, InvalidProblem, names) as caught:
        defined(**parts)
    assert "\n" not in str(caught.value)


def test_what_is_linear_only_after_simplification_is_accepted():
    assert defined(velocity=[(V[0] ** 2 - V[1] ** 2) / (V[0] + V[1])]).m == 1


def test_linearity_is_seen_without_simplification(monkeypatch):
    # sympy.simplify took minutes of rows with exponentials.
    monkeypatch.setattr(sp, "simplify", lambda _: pytest.fail("simplified"))
    defined(velocity=[(1 + Q[0]) * (sp.exp(Q[1] * sp.sin(Q[2])) * V[0] + V[1]) + Q[2]], H=sum(p**2 for p in P), M=None, U=None)


def test_a_row_that_follows_from_another_is_named():
    doubled = make_ivp(source_of(defined(velocity=[EDGE, (2 + Q[0]) * EDGE]), "doubled"), "a")
    (fault,) = [finding.fault for finding in held(doubled) if finding.fault]
    assert all(part in fault for part in ("rank 1 of 2", "velocity2 is a combination of velocity1", "remove velocity2"))
