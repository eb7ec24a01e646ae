"""Expressions in sines and cosines made shorter by sin^2 + cos^2 = 1, which is all it takes for most charts."""

import sympy as sp

LONG, SHORT = 1000, 60
"""Operations beyond which nothing is shortened, and those up to which SymPy's own simplification is tried last."""


def shortened(expression: sp.Expr) -> sp.Expr:
    """Return an expression simplified, after powers of sines or of cosines were replaced where that makes it shorter.

    Of polynomials in sines and cosines, which is what a chart by angles gives, the replacement leaves little for SymPy's own, much slower
    simplification to do; its result is kept where it is no longer than what it began with.

    Parameters
    ----------
    expression : Expr
        Any expression; of one so long that simplification would take minutes nothing is changed.
    """
    if expression.count_ops() > LONG:
        return expression
    if expression.is_rational_function():
        return min((expression, sp.factor(expression)), key=sp.count_ops)
    expanded = sp.expand(expression)
    forms = [expression, *(sp.factor(_without(expanded, function, other)) for function, other in ((sp.sin, sp.cos), (sp.cos, sp.sin)))]
    short = min(forms, key=sp.count_ops)
    return sp.simplify(short) if short.count_ops() <= SHORT else short


def _without(expression: sp.Expr, function: type[sp.Function], other: type[sp.Function]) -> sp.Expr:
    """Return an expanded expression in which no square of one of the functions, sine or cosine, is left."""

    def squares(power: sp.Pow) -> sp.Expr:
        base, exponent = power.as_base_exp()
        return base ** (exponent % 2) * (1 - other(base.args[0]) ** 2) ** (exponent // 2)

    def is_power(part: sp.Basic) -> bool:
        return isinstance(part, sp.Pow) and isinstance(part.base, function) and bool(part.exp.is_Integer) and part.exp >= 2

    return sp.expand(expression.replace(is_power, squares))
