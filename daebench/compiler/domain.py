"""The domain of H: whether a state may have left it where the forces do not tell."""

from collections.abc import Collection, Iterable
from typing import Any

import sympy as sp

TELLING: tuple[type, ...] = (sp.exp, sp.sin, sp.cos, sp.tan, sp.cot, sp.sec, sp.csc, sp.sinh, sp.cosh, sp.tanh, sp.asinh)
TELLING += (sp.atan, sp.atan2, sp.acot, sp.asin, sp.acos)
"""Functions whose derivatives have no value where they have none themselves; powers and quotients are so too.

The logarithm is not: log(q) ends at 0, and 1/q has a value on both sides.
"""


def may_be_left_unseen(expressions: Iterable[Any], state: Collection[sp.Symbol], positive: Collection[Any] = ()) -> bool:
    """Return whether one of the expressions may have no value at a state where its derivatives have one.

    Parameters
    ----------
    expressions : iterable of Expr
        H, or what it is made of.
    state : collection of Symbol
        What it is a function of, the parameters apart.
    positive : collection of Expr
        Expressions that a run keeps greater than 0 anyway: the domain that a Poisson system declares.
    """
    functions = {function for expression in expressions if expression is not None for function in sp.sympify(expression).atoms(sp.Function)}
    return any(
        function.free_symbols & set(state) and not isinstance(function, TELLING) and not _safe(function, positive) for function in functions
    )


def _safe(function: sp.Function, positive: Collection[Any]) -> bool:
    """Return whether it is the logarithm of what is positive."""
    return isinstance(function, sp.log) and (bool(function.args[0].is_positive) or function.args[0] in positive)
