"""Assumptions about symbols. SymPy simplifies by them, so each must hold wherever a run goes."""

from collections.abc import Iterable, Sequence
from typing import Any

import sympy as sp

from daebench.errors import InvalidProblem

TOLD_FIRST = ("positive", "negative", "zero", "integer", "nonnegative", "nonpositive", "nonzero")
"""Assumptions from which others follow, in the order in which messages name them."""


def require_plain(what: str, symbols: Iterable[Any], domain: Sequence[Any] = (), *, advice: str = "") -> None:
    """Check that symbols are assumed to be real, and that a run preserves any further assumption.

    A run goes where its equations lead it, possibly through zero. If sqrt(q**2) has become q because q was declared positive, the forces
    beyond zero are those of another system.
    """
    for symbol in symbols:
        assumption = "positive" if symbol in domain else "negative" if -symbol in domain else "real"
        # What follows from an allowed assumption, such as finite from real, is allowed, too.
        allowed = sp.Symbol("x", **{assumption: True}).assumptions0
        if extra := [name for name, value in symbol.assumptions0.items() if allowed.get(name) is not value]:
            excess = next((name for name in TOLD_FIRST if symbol.assumptions0.get(name)), extra[0])
            raise InvalidProblem(
                f"the {what} {symbol} is declared {excess}, which a run need not preserve: SymPy simplifies by it, as sqrt(x**2) to x, and "
                f"where it does not hold the equations differ; declare it with real=True only{advice}.",
                "symbol-assumed-too-much",
            )


def require_checked(parameters: Iterable[Any]) -> None:
    """Check that parameters are declared real or positive, as their values are checked to be; InvalidProblem names any other assumption."""
    for symbol in parameters:
        allowed = sp.Symbol("x", real=True, positive=symbol.is_positive).assumptions0
        if any(allowed.get(name) is not value for name, value in symbol.assumptions0.items()):
            declaration = next((name for name in TOLD_FIRST if symbol.assumptions0.get(name)), "not to be a real number")
            raise InvalidProblem(
                f"the parameter {symbol} is declared {declaration}, but its values are checked only against real=True and positive=True; "
                "use one of these.",
                "parameter-assumption",
            )
