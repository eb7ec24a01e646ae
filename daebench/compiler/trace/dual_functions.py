"""Functions that generated modules of dual numbers call: of numbers, of nested tuples of them, and of arrays of their derivatives."""

from typing import Any

from daebench.compiler.trace.arrays import Array
from daebench.compiler.trace.dual import Dual, value
from daebench.compiler.trace.ir import FLOAT64, TRUTH, Value, entries_of

SETTLED = 16 * 2.0**-52
"""Derivatives have converged if an iteration changes them by at most this fraction of their size."""

STALLED = 1e4 * 2.0**-52
"""They have also converged if the change is no smaller than in the iteration before and at most this fraction of values and derivatives."""


def with_tangents(x: Any, y: Any) -> Any:
    """Return the values of x with the derivatives of y, a nested tuple of the same form."""
    if isinstance(y, tuple):
        return tuple([with_tangents(*both) for both in zip(x, y, strict=True)])
    return Dual(y.code, value(x), y.tangents) if isinstance(y, Dual) else x


def rescaled(x: Any, factor: Any) -> Any:
    """Return a nested tuple with the same values and derivatives times a factor."""
    if isinstance(x, tuple):
        return tuple([rescaled(item, factor) for item in x])
    return x.chained(x.value, factor) if isinstance(x, Dual) else x


def square(x: Any, units: Any) -> Any:
    """Return the sum of the squares of first derivatives times units, a nested tuple of numbers of the same form."""
    if not isinstance(x, tuple):
        return (entries_of(x.tangents)[0] * units) ** 2 if isinstance(x, Dual) else 0.0
    terms = [square(*both) for both in zip(x, units, strict=True)]
    return sum(terms[1:], terms[0]) if terms else 0.0


def modulus(x: Any) -> Any:
    """Return |x|, with the absolute values of the derivatives too. Norms, which measure increments, are sums of these."""
    return Dual(x.code, abs(x.value), abs(x.tangents)) if isinstance(x, Dual) else abs(x)


def put(array: Array, i: Any, j: Any, x: Any) -> None:
    """Write the derivatives of a number into a row of an array from [i, j] on. For a real number nothing is written."""
    if isinstance(x, Dual):
        x.code.effect("store", "", (*array.entry((i, j)), x.tangents))


def take(array: Array, i: Any, j: Any, x: Any, k: int) -> Dual:
    """Return the number with value x whose k derivatives are in a row of an array from [i, j] on."""
    return Dual(array.code, x, array.code.effect("load", f"{FLOAT64}{k}", array.entry((i, j))))


def spread(array: Array, i: Any, j: Any, x: Any) -> None:
    """Write the derivatives of a number into an array at [0, i, j], [1, i, j] and so on. For a real number nothing is written."""
    for c, entry in enumerate(entries_of(x.tangents) if isinstance(x, Dual) else ()):
        array[c, i, j] = entry


def unsettled(size: Any, scale: Any, last: Any) -> Any:
    """Return the change in an iteration; its derivatives are -1 in directions in which they have converged, now or before.

    ``size`` is the change in this iteration, ``scale`` the size that it is measured against, ``last`` the result for the one before.
    """
    if not isinstance(size, Dual):
        return size
    code, change = size.code, size.tangents
    before, part = size.of(last).tangents, size.of(scale).tangents
    stalled = code.both(change >= before, change <= STALLED * (part + value(scale)))
    settled = code.either(change <= SETTLED * part, stalled)
    return Dual(code, size.value, code.select(settled, -1.0, change))


def lifted(x: Any, dx: Any) -> Any:
    """Return a nested tuple of real numbers with derivatives: in place of each number, a tuple of k derivatives or None."""
    if dx is None:
        return x
    if isinstance(x, tuple):
        return tuple([lifted(*both) for both in zip(x, dx, strict=True)])
    code = next(number.code for number in (x, *dx) if isinstance(number, Value))
    return Dual(code, x, code.emit("vset", f"{FLOAT64}{len(dx)}", tuple(code.as_kind(entry, FLOAT64) for entry in dx)))


def values(x: Any) -> Any:
    """Return the values of the numbers in a nested tuple."""
    return tuple([values(item) for item in x]) if isinstance(x, tuple) else value(x)


def tangents(x: Any) -> Any:
    """Return the derivatives of the numbers in a nested tuple: in place of each number, a tuple of k derivatives or None."""
    if isinstance(x, tuple):
        return tuple([tangents(item) for item in x])
    return tuple(entries_of(x.tangents)) if isinstance(x, Dual) else None


def at_rest(x: Any) -> Any:
    """Return whether all derivatives of a number are negative."""
    return _all_below(x, 0.0)


def finite_tangents(x: Any) -> Any:
    """Return whether all derivatives of a number are below infinity."""
    return _all_below(x, float("inf"))


def _all_below(x: Any, bound: float) -> Any:
    if not isinstance(x, Dual):
        return True
    return x.code.negated(x.code.emit("any", TRUTH, (x.code.negated(x.tangents < bound),)))


FUNCTIONS = (
    with_tangents,
    rescaled,
    square,
    modulus,
    put,
    take,
    spread,
    unsettled,
    value,
    lifted,
    values,
    tangents,
    at_rest,
    finite_tangents,
)
"""What generated modules of dual numbers call, besides ``select``."""
