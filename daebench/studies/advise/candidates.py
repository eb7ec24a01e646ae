"""Methods that advice chooses from, in the order in which they are tried: the likely cheapest comes first."""

import math
from collections.abc import Sequence

from daebench.errors import BadInput
from daebench.runs.state import CONSTRAINED, POISSON
from daebench.studies.advise.question import Question
from daebench.studies.grid.claimed import claimed, feasible
from daebench.studies.measurable import claimed_order

ON_MANIFOLD = (
    *("rattle", "symplectic_euler", "rattle/suzuki4", "rattle/kahan_li8", "lobatto3", "lobatto4", "lobatto3/kahan_li8"),
    *("strang", "strang/suzuki4", "rk4", "rk4+proj", "local:rk4", "local:gauss3", "local:gauss4"),
    *("radau3_ggl", "generalized_alpha", "rattle_conformal"),
    *("heyoka:taylor", "cvode:adams", "ida:index1", "ida:index2", "ida:ggl", "ida:ode", "scipy:DOP853", "solve_dae:Radau"),
)
"""Methods for constrained problems: one to three of each family."""

ON_POISSON = (
    *("symplectic_euler", "strang", "strang/suzuki4", "strang/kahan_li8", "midpoint", "midpoint/suzuki4", "midpoint/kahan_li8", "rk4"),
    *("heyoka:taylor", "cvode:adams", "ida:ode", "scipy:DOP853"),
)
"""Methods for Poisson systems."""

METHODS = {CONSTRAINED: ON_MANIFOLD, POISSON: ON_POISSON}

SHARP = 1e-4
"""Accuracy from which on methods of high order are tried first."""

FIRST = ("heyoka:taylor", "local:rk4", "rk4")
"""Methods that are tried before all others. They are often the cheapest, and what they take bounds how far others are followed."""

OF_SOLVERS = {"cvode:adams": 7, "scipy:DOP853": 6}
"""Where solvers that choose their steps stand among orders; others stand with order 3."""


def candidates(question: Question, methods: Sequence[str] | None, also: Sequence[str]) -> tuple[list[str], dict[str, str]]:
    """Return the methods that are tried, in order, and why others are not."""
    usual = METHODS[question.ivp.state]
    names = list(dict.fromkeys((*(usual if methods is None else methods), *also)))
    for name in (*(methods or ()), *also):
        question.solver(name)
    accepted, left_out = feasible(question.ivp, names, anyway=question.anyway)
    for name in list(accepted):
        if lacking := set(question.keep) - claimed(question.ivp, question.solver(name)):
            accepted.remove(name)
            left_out[name] = f"{name} does not claim to keep {', '.join(sorted(lacking)).replace('_', '-')}"
    if not accepted:
        raise BadInput(f"no method is left for {question.problem}: {'; '.join(why.rstrip('.') for why in left_out.values())}.")
    return sorted(accepted, key=lambda name: _rank(question, name)), left_out


def _rank(question: Question, name: str) -> tuple[float, int]:
    """Return where a method stands: the first three, and then by its order, high orders first where accuracy is high."""
    if name in FIRST:
        return -math.inf, FIRST.index(name)
    solver = question.solver(name)
    order = (claimed_order(solver) or 2) if solver.knob == "h" else OF_SOLVERS.get(name, 3)
    return float(-order if question.accuracy < SHARP else order), 0
