"""Test whether expressions vanish identically: by algebra if that is cheap, otherwise with 50 digits at random points.

If SymPy expands an expression of moderate size to 0, that proves that it is zero. Every other expression is evaluated with 50 digits at
three random points inside the declared domain, with all symbols of order one. It counts as zero if at each point it is below 1e-30 times
one plus the sum of the moduli of its terms. A nonzero analytic function passes only with probability zero. The points come from a fixed
seed, so that a verdict does not change from run to run.
"""

import random
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import mpmath as mp
import sympy as sp

from daebench.errors import InvalidProblem

DIGITS, ZERO = 50, "1e-30"
POINTS, TRIES = 3, 400
SMALL = 60
"""Largest number of operations of an expression that is expanded before it is evaluated."""

Violation = tuple[str, str]
Point = list[Any]


def first_nonzero(claims: Mapping[str, sp.Expr], symbols: Sequence[sp.Symbol], domain: Sequence[sp.Expr]) -> Violation | None:
    """Return the name of the first expression that does not vanish, and its value; None if all vanish."""
    open_ = {name: expression for name, expression in claims.items() if not expands_to_zero(expression)}
    if not open_:
        return None
    sizes = _evaluate(list(open_.values()), symbols, domain)
    for (name, expression), (size, zero) in zip(open_.items(), sizes, strict=True):
        if not zero:
            return name, _text(expression, size)
    return None


def expands_to_zero(expression: sp.Expr) -> bool:
    """Return whether expanding proves that an expression of moderate size is zero."""
    expression = sp.sympify(expression)
    if expression == 0:
        return True
    return bool(expression.count_ops() <= SMALL and sp.expand(expression) == 0)


def _evaluate(expressions: Sequence[sp.Expr], symbols: Sequence[sp.Symbol], domain: Sequence[sp.Expr]) -> list[tuple[Any, bool]]:
    """Return for each expression its largest modulus over the points, and whether that counts as zero."""
    terms = [list(sp.Add.make_args(expression)) for expression in expressions]
    values = sp.lambdify(list(symbols), terms, "mpmath", cse=True)
    inside = sp.lambdify(list(symbols), list(domain), "mpmath")
    verdicts: list[tuple[Any, bool]] = [(mp.mpf(0), True)] * len(expressions)
    left = POINTS
    with mp.workdps(DIGITS):
        for point in _candidates(symbols):
            summands = _at(values, inside, point)
            if summands is None:
                continue
            for k, parts in enumerate(summands):
                # Relative to the terms, which may cancel; the 1 covers a single term that cancels within itself.
                size, scale = abs(mp.fsum(parts)), 1 + mp.fsum(abs(part) for part in parts)
                verdicts[k] = max(verdicts[k][0], size), verdicts[k][1] and bool(size <= mp.mpf(ZERO) * scale)
            left -= 1
            if not left:
                return verdicts
    raise InvalidProblem(
        f"no {POINTS} points were found inside the domain at which the identities of the problem are defined; "
        "declare the domain in coordinates of order one, or the coordinates as positive symbols.",
        "no-points-inside-domain",
    )


def _at(values: Any, inside: Any, point: Point) -> list[list[Any]] | None:
    """Return the terms of all expressions at a point; None if it is outside the domain or a value there is not finite."""
    try:
        # Outside of real numbers a bound may be complex, which cannot be compared with 0.
        if not all(mp.im(bound) == 0 and mp.re(bound) > 0 for bound in inside(*point)):
            return None
        terms: list[list[Any]] = values(*point)
    except (ArithmeticError, ValueError):
        return None
    return terms if all(mp.isfinite(part) for parts in terms for part in parts) else None


def _candidates(symbols: Sequence[sp.Symbol]) -> Iterator[Point]:
    """Yield points of exact numbers, of four sizes, alternately with any signs that the symbols allow and all positive."""
    draw = random.Random(1)
    for k in range(TRIES):
        # Dyadic numbers, exact in binary: the points themselves have no rounding.
        point = [mp.mpf(draw.randrange(2**18, 2**20 + 2**19)) / 2**20 for _ in symbols]
        signs = [-1 if draw.random() < 0.5 and k % 2 == 0 and not symbol.is_positive else 1 for symbol in symbols]
        # Four sizes, because a domain may be small; and every other point is positive, which random signs rarely make all coordinates.
        yield [sign * value / 2 ** (k // 2 % 4) for sign, value in zip(signs, point, strict=True)]


def _text(expression: sp.Expr, size: Any) -> str:
    """Return a short expression unchanged, and the size of a long one."""
    text = str(sp.expand(expression)) if expression.count_ops() <= SMALL else ""
    return text if 0 < len(text) <= 80 else f"an expression as large as {mp.nstr(size, 3)} at random points"
