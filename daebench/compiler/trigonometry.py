"""Simplification of expressions in sines and cosines by sin^2 + cos^2 = 1, which suffices for most charts."""

from collections.abc import Iterator
from contextlib import contextmanager

import sympy as sp
from sympy.core.random import rng

from daebench.systems.definition_parts import extent

LONG, SHORT = 1000, 60
"""Number of operations above which nothing is shortened, and number up to which SymPy's own simplification is tried last."""

VERY_LONG = 10 * LONG
"""Number of nodes, written out, above which operations are not even counted."""


def shortened(expression: sp.Expr) -> sp.Expr:
    """Return an expression simplified, after powers of sines or of cosines were replaced if that makes it shorter.

    A chart by angles gives polynomials in sines and cosines. After the replacement, little is left for SymPy's own, much slower
    simplification. Its result is used unless it is longer than its input.
    """
    if extent(expression)[0] > VERY_LONG or expression.count_ops() > LONG:
        return expression
    with _repeatable():
        return _shortened(expression)


@contextmanager
def _repeatable() -> Iterator[None]:
    """Let SymPy draw the same random numbers each time, so that the factors of a polynomial take the same time.

    It chooses points at random. One run had not found factors after ten minutes that are found within a second otherwise.
    """
    state = rng.getstate()
    rng.seed(0)
    try:
        yield
    finally:
        rng.setstate(state)


def _shortened(expression: sp.Expr) -> sp.Expr:
    """Return the shorter one of an expression and what it is simplified to."""
    if expression.is_rational_function():
        return min((expression, sp.factor(expression)), key=sp.count_ops)
    expanded = sp.expand(expression)
    forms = [expression, *(sp.factor(_without(expanded, function, other)) for function, other in ((sp.sin, sp.cos), (sp.cos, sp.sin)))]
    short = min(forms, key=sp.count_ops)
    return sp.simplify(short) if short.count_ops() <= SHORT else short


def _without(expression: sp.Expr, function: type[sp.Function], other: type[sp.Function]) -> sp.Expr:
    """Return an expanded expression without squares of one of the functions, sine or cosine."""

    def squares(power: sp.Pow) -> sp.Expr:
        base, exponent = power.as_base_exp()
        return base ** (exponent % 2) * (1 - other(base.args[0]) ** 2) ** (exponent // 2)

    def is_power(part: sp.Basic) -> bool:
        return isinstance(part, sp.Pow) and isinstance(part.base, function) and bool(part.exp.is_Integer) and part.exp >= 2

    return sp.expand(expression.replace(is_power, squares))
