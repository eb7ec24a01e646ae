"""The domain of H: whether a state can leave it without making the forces undefined."""

from collections.abc import Collection, Iterable
from typing import Any

import sympy as sp

TELLING: tuple[type, ...] = (sp.exp, sp.sin, sp.cos, sp.tan, sp.cot, sp.sec, sp.csc, sp.sinh, sp.cosh, sp.tanh, sp.asinh)
TELLING += (sp.atan, sp.atan2, sp.acot, sp.asin, sp.acos)
"""Functions whose derivatives are undefined wherever the functions are. Powers and quotients are of this kind too.

The logarithm is not: log(q) ends at 0, but its derivative 1/q is defined on both sides.
"""


def may_be_left_unseen(expressions: Iterable[Any], state: Collection[sp.Symbol], positive: Collection[Any] = ()) -> bool:
    """Return whether one of the expressions may be undefined at a state where its derivatives are defined."""
    functions = {function for expression in expressions if expression is not None for function in sp.sympify(expression).atoms(sp.Function)}
    return any(
        function.free_symbols & set(state) and not isinstance(function, TELLING) and not _safe(function, positive) for function in functions
    )


def _safe(function: sp.Function, positive: Collection[Any]) -> bool:
    """Return whether a function is the logarithm of a positive expression."""
    return isinstance(function, sp.log) and (bool(function.args[0].is_positive) or function.args[0] in positive)
