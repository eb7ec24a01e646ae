"""Exact numbers and vectors, and their values at the parameters that a mechanism is declared with."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import sympy as sp
from numpy.typing import NDArray
from sympy.functions.elementary.trigonometric import TrigonometricFunction

from daebench.errors import InvalidProblem
from daebench.systems.picture import Exact

Array = NDArray[np.float64]

Values = Mapping[sp.Symbol, float]
"""Parameters with the values at which ranks are decided."""

CLOSE = 1e-9
"""Part of the size of a body or mechanism below which a difference is one of rounding."""

UNIT = 1e-12
"""Difference of a squared length from 1 that is one of decimals."""

ROUNDED = 64 * 2.0**-52
"""Part of their coordinates within which points are at one place."""


def exact(x: Exact) -> sp.Expr:
    """Return an exact number: 0.1 and "0.1" are one tenth, expressions stay."""
    if isinstance(x, sp.Expr):
        # A Float by its decimal text: 0.1 in an expression is one tenth, as it is alone.
        return x.replace(lambda part: isinstance(part, sp.Float), lambda part: sp.Rational(str(part)))
    try:
        return sp.Rational(str(x))
    except (TypeError, ValueError, ZeroDivisionError) as error:
        raise InvalidProblem(f"{x!r} is not a number of a mechanism; give a number or an expression.", "not-a-mechanism-number") from error


def vector(what: str, x: Sequence[Exact]) -> sp.Matrix:
    """Return a point or direction of the plane or of space as a column, shape(2, 1) or shape(3, 1)."""
    if isinstance(x, str) or not hasattr(x, "__len__") or len(x) not in (2, 3):
        raise InvalidProblem(f"{what} is {x!r}; give two coordinates in the plane, three in space.", "vector-of-wrong-size")
    return sp.Matrix([exact(entry) for entry in x])


def simplified(x: sp.Expr) -> sp.Expr:
    """Return an expression multiplied out; sums of squares of sines and cosines go too."""
    plain = sp.expand(x)
    # simplify is slow, and helps only where squares of sines and cosines add up to one.
    return sp.expand(sp.simplify(plain)) if plain.has(TrigonometricFunction) else plain


def length_of(axis: sp.Matrix) -> sp.Expr:
    """Return the length of a direction; a unit vector in decimals, such as (0.70710678118655, 0.70710678118655, 0), has length 1."""
    square = simplified(axis.dot(axis))
    return sp.S.One if square.is_Rational and abs(square - 1) < UNIT else sp.sqrt(square)


def number(x: Exact, values: Values) -> float:
    """Return the value of an expression in the parameters."""
    return float(numbers(sp.Matrix([x]), values)[0, 0])


def numbers(matrix: Any, values: Values) -> Array:
    """Return the values of a matrix of expressions in the parameters."""
    substituted = sp.Matrix(matrix).xreplace({symbol: sp.sympify(value) for symbol, value in values.items()})
    if substituted.free_symbols:
        names = ", ".join(sorted(map(str, substituted.free_symbols)))
        raise InvalidProblem(
            f"{names} of the mechanism has no value; declare it in parameters, or use daebench.joints.t for the time.",
            "mechanism-symbol-undeclared",
        )
    return np.array(substituted.evalf(), dtype=float)


def spread(places: Array) -> float:
    """Return the largest distance of points, shape(n, k), from the first of them; 0 if it is one of rounding, or if there are no points."""
    if not places.size:
        return 0.0
    size = float(np.linalg.norm(places - places[:, :1], axis=0).max())
    return size if size > ROUNDED * float(np.abs(places).max()) else 0.0


def levelled(columns: Array) -> Array:
    """Return points (x, 1) and directions (x, 0), as columns, with the points about the first of them and in units of their spread.

    Whether one is a combination of others then depends neither on the unit of length nor on the origin.
    """
    at = columns[-1] != 0
    size = spread(columns[:-1, at])
    scaled: Array = np.array(columns, dtype=float)
    if at.any():
        first = columns[:-1, at][:, :1]
        scaled[:-1, at] = (columns[:-1, at] - first) / size if size else 0.0
    lengths = np.linalg.norm(scaled[:, ~at], axis=0)
    scaled[:, ~at] /= np.where(lengths > 0, lengths, 1.0)
    return scaled


def rank(matrix: Array) -> int:
    """Return the rank of a matrix whose columns are of any size."""
    if matrix.size == 0:
        return 0
    # Columns of length one, so that the threshold depends on no unit.
    scale = np.linalg.norm(matrix, axis=0)
    return int(np.linalg.matrix_rank(matrix / np.where(scale > 0, scale, 1.0), tol=CLOSE))
