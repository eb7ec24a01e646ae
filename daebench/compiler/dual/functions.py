"""Elementary functions of dual numbers, by the chain rule; absolute values, minima and maxima.

Values are computed by the functions of float64.
"""

import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, overload, overload_attribute, register_jitable

from daebench.compiler.dual.number import DOUBLE, Dual, cast, joined, split, times


@intrinsic  # type: ignore[untyped-decorator]
def value(typingctx: Any, x: Any) -> Any:
    """Return the value of a number, which may be real."""
    if isinstance(x, Dual):
        return types.float64(x), lambda context, builder, sig, args: split(context, builder, sig.args[0], args[0])[0]
    return x(x), lambda context, builder, sig, args: args[0]


@intrinsic  # type: ignore[untyped-decorator]
def dual_like(typingctx: Any, x: Any, y: Any) -> Any:
    """Return a number as a dual one; at least one of x and y is dual."""
    if isinstance(x, Dual):
        return x(x, y), lambda context, builder, sig, args: args[0]
    return y(types.float64, y), lambda context, builder, sig, args: cast(context, builder, types.float64, sig.return_type, args[0])


@intrinsic  # type: ignore[untyped-decorator]
def chained(typingctx: Any, result: Any, slope: Any, x: Any) -> Any:
    """Return the dual number f(x), given the values of f and of f' at x."""

    def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        tangents = split(context, builder, sig.args[2], args[2])[1]
        return joined(context, builder, sig.return_type, args[0], times(builder, args[1], tangents))

    return x(types.float64, types.float64, x), lowered


@intrinsic  # type: ignore[untyped-decorator]
def modulus(typingctx: Any, x: Any) -> Any:
    """Return |x|, with the absolute values of the derivatives too. Norms, which measure increments, are sums of these."""

    def absolute(builder: Any, of: Any, name: str, number: Any) -> Any:
        function = cgutils.get_or_insert_function(builder.module, ir.FunctionType(of, [of]), f"llvm.fabs.{name}")
        return builder.call(function, [number])

    def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        number, tangents = split(context, builder, sig.args[0], args[0])
        made = absolute(builder, DOUBLE, "f64", number)
        if tangents is None:
            return made
        return joined(context, builder, sig.return_type, made, absolute(builder, tangents.type, f"v{tangents.type.count}f64", tangents))

    of = x if isinstance(x, Dual) else types.float64
    return of(of), lowered


def _elementary(function: Any, slope: Callable[[Any], Any]) -> None:
    """Extend a function of one number to dual numbers, given its derivative."""
    differentiated = register_jitable(slope)

    @overload(function, strict=False)  # type: ignore[untyped-decorator]
    def typed(x: Any) -> Any:
        if not isinstance(x, Dual):
            return None
        return lambda x: chained(function(value(x)), differentiated(value(x)), x)


ELEMENTARY: dict[Any, Callable[[Any], Any]] = {
    np.sqrt: lambda x: 0.5 / np.sqrt(x),
    np.exp: lambda x: np.exp(x),
    np.expm1: lambda x: np.exp(x),
    np.exp2: lambda x: 0.6931471805599453 * np.exp2(x),
    np.log: lambda x: 1.0 / x,
    np.log1p: lambda x: 1.0 / (1.0 + x),
    np.log2: lambda x: 1.4426950408889634 / x,
    np.log10: lambda x: 0.4342944819032518 / x,
    np.sin: lambda x: np.cos(x),
    np.cos: lambda x: -np.sin(x),
    np.tan: lambda x: 1.0 / np.cos(x) ** 2,
    np.arcsin: lambda x: 1.0 / np.sqrt((1.0 - x) * (1.0 + x)),
    np.arccos: lambda x: -1.0 / np.sqrt((1.0 - x) * (1.0 + x)),
    np.arctan: lambda x: 1.0 / (1.0 + x * x),
    np.sinh: lambda x: np.cosh(x),
    np.cosh: lambda x: np.sinh(x),
    np.tanh: lambda x: 1.0 / np.cosh(x) ** 2,
    np.arcsinh: lambda x: 1.0 / np.sqrt(1.0 + x * x),
    np.arccosh: lambda x: 1.0 / (np.sqrt(x - 1.0) * np.sqrt(x + 1.0)),
    np.arctanh: lambda x: 1.0 / ((1.0 - x) * (1.0 + x)),
    abs: lambda x: 1.0 if x >= 0.0 else -1.0,
    np.sign: lambda x: 0.0,
}
"""Functions of one number, and their derivatives."""

for _function, _slope in ELEMENTARY.items():
    _elementary(_function, _slope)


@overload(np.arctan2, strict=False)  # type: ignore[untyped-decorator]
def arctan2(y: Any, x: Any) -> Any:
    """Return the angle of the point (x, y)."""
    if not isinstance(x, Dual) and not isinstance(y, Dual):
        return None

    def angle(y: Any, x: Any) -> Any:
        a, b = value(x), value(y)
        square = a * a + b * b
        return chained(np.arctan2(b, a), a / square, dual_like(y, x)) + chained(0.0, -b / square, dual_like(x, y))

    return angle


@overload(operator.pow, strict=False)  # type: ignore[untyped-decorator]
def power(x: Any, y: Any) -> Any:
    """Return x^y. If y is real, x may be negative or 0 wherever x^y is defined."""
    if isinstance(x, Dual) and not isinstance(y, Dual):
        return lambda x, y: chained(value(x) ** y, y * value(x) ** (y - 1.0), x)
    if isinstance(y, Dual) and not isinstance(x, Dual):
        return lambda x, y: chained(x ** value(y), np.log(x) * x ** value(y), y)
    if isinstance(x, Dual):

        def raised(x: Any, y: Any) -> Any:
            a, b = value(x), value(y)
            return chained(a**b, b * a ** (b - 1.0), x) + chained(0.0, np.log(a) * a**b, y)

        return raised
    return None


def _extreme(function: Any, first: Callable[[Any, Any], Any]) -> None:
    """Extend a minimum or a maximum to numbers of which at least one is dual; ``first`` is numba's own choice between two values.

    Kernels use them only for sizes. If one number is real, the derivatives are those of the dual number: changes of q are measured
    against max(LENGTH, |q|), and those of dq against |dq|.
    """
    chosen = register_jitable(first)

    @overload(function, strict=False)  # type: ignore[untyped-decorator]
    def typed(x: Any, y: Any, *others: Any) -> Any:
        if others and any(isinstance(number, Dual) for number in (x, y, *others)):
            return lambda x, y, *others: function(function(x, y), *others)
        if isinstance(x, Dual) and isinstance(y, Dual):
            return lambda x, y, *others: x if chosen(value(x), value(y)) else y
        if isinstance(x, Dual):
            return lambda x, y, *others: chained(function(value(x), y), 1.0, x)
        if isinstance(y, Dual):
            return lambda x, y, *others: chained(function(x, value(y)), 1.0, y)
        return None


_extreme(max, lambda x, y: x > y)
_extreme(min, lambda x, y: x < y)


@overload_attribute(Dual, "real", strict=False)  # type: ignore[untyped-decorator]
def real(x: Any) -> Any:
    """Return the value, as the real part of a complex number."""
    return lambda x: value(x)
