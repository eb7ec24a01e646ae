"""Dual numbers in a program: a value, and its derivatives in k directions as one vector, which follow by the rules of calculus.

Values are computed as those of real numbers are.
"""

import operator as op
from collections.abc import Callable, Mapping
from typing import Any

from daebench.compiler.trace.arrays import Array
from daebench.compiler.trace.code import Code, Functions
from daebench.compiler.trace.complex import Pair, of_numbers
from daebench.compiler.trace.ir import FLOAT64, TRUTH, Value, entries_of
from daebench.compiler.values import mapped


def _compared(comparison: Callable[[Any, Any], Any]) -> Any:
    """Return a comparison of the values of two numbers."""
    return lambda x, y: comparison(x.value, value(y))


class Dual(Pair):
    """A number with derivatives: a value, and a value whose kind is a vector."""

    __slots__ = ("tangents", "value")

    def __init__(self, code: Code, value: Any, tangents: Value) -> None:
        self.code, self.value, self.tangents = code, code.as_kind(value, FLOAT64), tangents

    @property
    def parts(self) -> tuple[Any, Any]:
        """Its value and its derivatives."""
        return self.value, self.tangents

    @property
    def kind(self) -> str:
        """Kind of its derivatives."""
        return self.tangents.kind

    @property
    def real(self) -> Value:
        """Its value, as the real part of a complex number."""
        return self.value

    def of(self, x: Any) -> "Dual":
        """Return a number with derivatives, those of a real one being 0."""
        return x if isinstance(x, Dual) else Dual(self.code, x, self.code.constant(0.0, self.kind))

    def chained(self, value: Any, slope: Any) -> "Dual":
        """Return the number f(x), given the values of f and of f' here."""
        return Dual(self.code, value, slope * self.tangents)

    @of_numbers
    def __add__(self, y: Any) -> Any:
        if not isinstance(y, Dual):
            return Dual(self.code, self.value + y, self.tangents)
        return Dual(self.code, self.value + y.value, self.tangents + y.tangents)

    @of_numbers
    def __radd__(self, x: Any) -> Any:
        return Dual(self.code, x + self.value, self.tangents)

    @of_numbers
    def __sub__(self, y: Any) -> Any:
        if not isinstance(y, Dual):
            return Dual(self.code, self.value - y, self.tangents)
        return Dual(self.code, self.value - y.value, self.tangents - y.tangents)

    @of_numbers
    def __rsub__(self, x: Any) -> Any:
        return Dual(self.code, x - self.value, -self.tangents)

    @of_numbers
    def __mul__(self, y: Any) -> Any:
        if not isinstance(y, Dual):
            return self.chained(self.value * y, y)
        return Dual(self.code, self.value * y.value, y.value * self.tangents + self.value * y.tangents)

    @of_numbers
    def __rmul__(self, x: Any) -> Any:
        return self.chained(x * self.value, x)

    @of_numbers
    def __truediv__(self, y: Any) -> Any:
        if not isinstance(y, Dual):
            return self.chained(self.code.quotient(self.value, y), self.code.quotient(1.0, y))
        value, inverse = self.value / y.value, 1.0 / y.value
        return Dual(self.code, value, inverse * (self.tangents - value * y.tangents))

    @of_numbers
    def __rtruediv__(self, x: Any) -> Any:
        value, inverse = x / self.value, 1.0 / self.value
        return Dual(self.code, value, inverse * -(value * self.tangents))

    def __neg__(self) -> "Dual":
        return Dual(self.code, -self.value, -self.tangents)

    def __abs__(self) -> "Dual":
        return self.chained(abs(self.value), self.code.select(self.value >= 0.0, 1.0, -1.0))

    @of_numbers
    def __pow__(self, y: Any) -> Any:
        power = self.code.functions.pow
        if not isinstance(y, Dual):
            return self.chained(self.code.power(self.value, y), y * power(self.value, y - 1.0))
        a, b = self.value, y.value
        return self.chained(power(a, b), b * power(a, b - 1.0)) + y.chained(0.0, self.code.functions.log(a) * power(a, b))

    @of_numbers
    def __rpow__(self, x: Any) -> Any:
        power = self.code.functions.pow(x, self.value)
        return self.chained(power, self.code.functions.log(x) * power)

    __lt__, __le__, __gt__, __ge__, __eq__, __ne__ = map(_compared, (op.lt, op.le, op.gt, op.ge, op.eq, op.ne))
    __hash__ = object.__hash__


SLOPES: Mapping[str, Callable[[Functions, Any], Any]] = {
    "sqrt": lambda f, x: 0.5 / f.sqrt(x),
    "exp": lambda f, x: f.exp(x),
    "exp2": lambda f, x: 0.6931471805599453 * f.exp2(x),
    "expm1": lambda f, x: f.exp(x),
    "log": lambda f, x: 1.0 / x,
    "log1p": lambda f, x: 1.0 / (1.0 + x),
    "log2": lambda f, x: 1.4426950408889634 / x,
    "log10": lambda f, x: 0.4342944819032518 / x,
    "sin": lambda f, x: f.cos(x),
    "cos": lambda f, x: -f.sin(x),
    "tan": lambda f, x: 1.0 / f.cos(x) ** 2,
    "asin": lambda f, x: 1.0 / f.sqrt((1.0 - x) * (1.0 + x)),
    "acos": lambda f, x: -1.0 / f.sqrt((1.0 - x) * (1.0 + x)),
    "atan": lambda f, x: 1.0 / (1.0 + x * x),
    "sinh": lambda f, x: f.cosh(x),
    "cosh": lambda f, x: f.sinh(x),
    "tanh": lambda f, x: 1.0 / f.cosh(x) ** 2,
    "asinh": lambda f, x: 1.0 / f.sqrt(1.0 + x * x),
    "acosh": lambda f, x: 1.0 / (f.sqrt(x - 1.0) * f.sqrt(x + 1.0)),
    "atanh": lambda f, x: 1.0 / ((1.0 - x) * (1.0 + x)),
}
"""Derivatives of functions of one number, by the names of the platform."""


def function_of(code: Code, name: str, args: tuple[Any, ...]) -> Any:
    """Return a function of numbers of which at least one has derivatives."""
    if name == "atan2":
        y, x = args
        a, b = value(x), value(y)
        square = a * a + b * b
        like = x if isinstance(x, Dual) else y
        turned = like.of(y).chained(code.functions.atan2(b, a), a / square)
        return turned + like.of(x).chained(0.0, -b / square)
    if name not in SLOPES:
        raise TypeError(f"{name} is no function of dual numbers")
    (x,) = args
    return x.chained(getattr(code.functions, name)(x.value), SLOPES[name](code.functions, x.value))


def extreme(code: Code, op: str, x: Any, y: Any) -> Any:
    """Return the larger or smaller of two numbers. If one is real, the derivatives are those of the other.

    Kernels use it only for sizes: changes of q are measured against max(LENGTH, |q|), and those of dq against |dq|.
    """
    if isinstance(x, Dual) and isinstance(y, Dual):
        return code.select(code.compare(op, x.value, y.value), x, y)
    extreme, dual = code.extreme(op, value(x), value(y)), x if isinstance(x, Dual) else y
    return dual.chained(extreme, 1.0) if isinstance(dual, Dual) else extreme


def value(x: Any) -> Any:
    """Return the value of a number."""
    return x.value if isinstance(x, Dual) else x


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
    return mapped(lambda number: number.chained(number.value, factor) if isinstance(number, Dual) else number, x)


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
    return mapped(value, x)


def tangents(x: Any) -> Any:
    """Return the derivatives of the numbers in a nested tuple: in place of each number, a tuple of k derivatives or None."""
    return mapped(lambda number: tuple(entries_of(number.tangents)) if isinstance(number, Dual) else None, x)


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
