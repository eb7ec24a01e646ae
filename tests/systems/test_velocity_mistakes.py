"""Mistakes in constraints on velocities: each is one sentence that says what is wrong, where, and what to do."""

import numpy as np
import pytest
import sympy as sp

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
    "no v": ({"v": None}, "velocity has constraints on velocities, but v does not name these; give v=, one symbol for each position."),
    "too few v": ({"v": V[:2]}, "v has 2 entries, but there are 3 positions; give one for each."),
    "v that are positions": ({"v": Q}, "q1, q2, q3 stands for more than one position, momentum, velocity, time or parameter; rename one."),
    "v that are texts": ({"v": ("a", "b", "c")}, "v contains 'a', which is not a SymPy Symbol."),
    "quadratic": (
        {"velocity": [EDGE, V[0] ** 2 - V[1]]},
        "velocity[1] is v1**2 - v2, which is not linear in the velocities; only A(q, t) v + a(q, t) is supported.",
    ),
    "a speed": ({"velocity": [sp.sqrt(V[0] ** 2 + V[1] ** 2) - 1]}, "which is not linear in the velocities"),
    "momenta": (
        {"velocity": [P[0] - P[1]]},
        "velocity contains p1, p2, which it may not depend on; a constraint on velocities is a function of v, q, t and parameters; "
        "write momenta as velocities, p = M v.",
    ),
    "an undeclared symbol": ({"velocity": [V[0] - sp.Symbol("w")]}, "velocity contains w, which it may not depend on; declare it."),
    "an undeclared time": (
        {"velocity": [V[0] - sp.Symbol("t")]},
        "velocity contains t, which it may not depend on; declare the time with",
    ),
    "no sequence": ({"velocity": EDGE}, "velocity is v1*sin(q3) - v2*cos(q3), but must be a sequence; write [v1*sin(q3) - v2*cos(q3)]."),
    "a text": ({"velocity": "v1 - v2"}, "velocity is 'v1 - v2', but must be a sequence"),
    "an equation": ({"velocity": [sp.Eq(V[0], V[1])]}, "velocity is the equation Eq(v1, v2); give the difference of its sides."),
    "a row of A": ({"velocity": [[1, 0, 0]]}, "velocity is [1, 0, 0], which is not a number or an expression."),
    "an array": (
        {"velocity": np.array([1.0, 0.0])},
        "velocity[0] is 1.0, which contains no velocity; give a constraint on positions in g.",
    ),
    "an empty row": ({"velocity": [0 * V[0]]}, "velocity[0] is 0, which contains no velocity; leave it out."),
    "positions": ({"velocity": [Q[0] - Q[1]]}, "velocity[0] is q1 - q2, which contains no velocity; give a constraint on positions in g."),
    "a kink": (
        {"velocity": [sp.Abs(Q[0]) * V[0]]},
        "velocity[0] contains Abs(q1), which is not twice differentiable; write velocity[0] with smooth functions only.",
    ),
    "infinity": ({"velocity": [sp.oo * V[0]]}, "velocity is not a real number everywhere"),
}


@pytest.mark.parametrize(("parts", "sentence"), MISTAKES.values(), ids=MISTAKES)
def test_a_mistake_in_a_constraint_on_velocities_is_named(parts, sentence):
    with pytest.raises(InvalidProblem) as caught:
        defined(**parts)
    assert sentence in str(caught.value)
    assert "\n" not in str(caught.value)


def test_what_is_linear_only_after_simplification_is_accepted():
    assert defined(velocity=[(V[0] ** 2 - V[1] ** 2) / (V[0] + V[1])]).m == 1


def test_linearity_is_seen_without_simplification(monkeypatch):
    # sympy.simplify took minutes of rows with exponentials.
    monkeypatch.setattr(sp, "simplify", lambda _: pytest.fail("simplified"))
    defined(velocity=[(1 + Q[0]) * (sp.exp(Q[1] * sp.sin(Q[2])) * V[0] + V[1]) + Q[2]], H=sum(p**2 for p in P), M=None, U=None)


def test_a_row_that_follows_from_another_is_named():
    doubled = make_ivp(source_of(defined(velocity=[EDGE, (2 + Q[0]) * EDGE]), "doubled"), "a")
    faults = [finding.fault for finding in held(doubled) if finding.fault]
    assert len(faults) == 1
    assert "G has rank 1 of 2: velocity2 is a combination of velocity1, also nearby, so the constraints are redundant" in faults[0]
    assert "remove velocity2" in faults[0]
