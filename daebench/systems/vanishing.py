"""Whether expressions vanish identically: by algebra where that is cheap, else by numbers of 50 digits at random points.

An expression of moderate size that SymPy expands to 0 is zero, and that is a proof. Every other one is evaluated with 50 digits at three
random points inside the declared domain, all its symbols of order one; it is taken to vanish if at each of them it is below 1e-30 times one
plus the sum of the moduli of its terms. An analytic function that is not zero passes only by an accident of probability zero. The points
come from a fixed seed, so that a verdict does not change from one run to the next.
"""

import random
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import sympy as sp

from daebench.errors import InvalidProblem

DIGITS, ZERO = 50, "1e-30"
POINTS, TRIES = 3, 400
SMALL = 60
"""Operations up to which an expression is expanded before it is evaluated."""

Found = tuple[str, str]
Point = list[Any]


def first_nonzero(claims: Mapping[str, sp.Expr], symbols: Sequence[sp.Symbol], domain: Sequence[sp.Expr]) -> Found | None:
    """Return the name of the first expression that does not vanish, and what it is instead; None if all vanish.

    Parameters
    ----------
    claims : mapping of str to Expr
        Named expressions in ``symbols``.
    symbols : sequence of Symbol
        All that vary independently, parameters too; those that are declared positive are sampled so.
    domain : sequence of Expr
        Expressions in ``symbols`` that are positive where the claims are to hold.

    Raises
    ------
    InvalidProblem
        If no points are found in the domain at which the expressions have values.
    """
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
    """Return for each expression its largest modulus over the points, and whether that counts as zero everywhere."""
    import mpmath as mp

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
                size, scale = abs(mp.fsum(parts)), 1 + mp.fsum(abs(part) for part in parts)
                verdicts[k] = max(verdicts[k][0], size), verdicts[k][1] and bool(size <= mp.mpf(ZERO) * scale)
            left -= 1
            if not left:
                return verdicts
    raise InvalidProblem(
        f"no {POINTS} points were found inside the domain at which the identities of the problem have values; "
        "declare the domain in coordinates of order one, or the coordinates as positive symbols."
    )


def _at(values: Any, inside: Any, point: Point) -> list[list[Any]] | None:
    """Return the terms of all expressions at a point, or None if it is outside the domain or one of them has no finite value there."""
    import mpmath as mp

    try:
        if not all(mp.im(bound) == 0 and mp.re(bound) > 0 for bound in inside(*point)):
            return None
        terms: list[list[Any]] = values(*point)
    except (ArithmeticError, ValueError):
        return None
    return terms if all(mp.isfinite(part) for parts in terms for part in parts) else None


def _candidates(symbols: Sequence[sp.Symbol]) -> Iterator[Point]:
    """Yield points of exact numbers: by turns with signs where the symbols allow them and all positive, and of four sizes."""
    import mpmath as mp

    draw = random.Random(1)
    for k in range(TRIES):
        point = [mp.mpf(draw.randrange(2**18, 2**20 + 2**19)) / 2**20 for _ in symbols]
        signs = [-1 if draw.random() < 0.5 and k % 2 == 0 and not symbol.is_positive else 1 for symbol in symbols]
        yield [sign * value / 2 ** (k // 2 % 4) for sign, value in zip(signs, point, strict=True)]


def _text(expression: sp.Expr, size: Any) -> str:
    """Return a short expression as it is, and of a long one its size."""
    import mpmath as mp

    text = str(sp.expand(expression)) if expression.count_ops() <= SMALL else ""
    return text if 0 < len(text) <= 80 else f"an expression as large as {mp.nstr(size, 3)} at random points"
