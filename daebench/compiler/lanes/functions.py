"""Elementary functions, powers, minima and maxima of lanes: LLVM's own if it is exact for vectors, otherwise the function of float64.

sqrt is exact by IEEE 754. No vector function for sin, exp and the like gives the bits of the C library, so these are called for one lane
after another.
"""

import operator
from functools import reduce
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing import signature
from numba.extending import intrinsic, overload

from daebench.compiler.lanes.number import Lanes, common, intrinsic_of, vector, width_of


def one_by_one(scalar: Any, arguments: str) -> Any:
    """Return the function of lanes that calls a function of numbers for each lane."""

    @intrinsic  # type: ignore[untyped-decorator]
    def mapped(typingctx: Any, xs: Any) -> Any:
        of = Lanes(types.float64, width_of(xs))

        def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            single = signature(types.float64, *[types.float64] * len(xs))
            vectors = [cgutils.alloca_once(builder, vector(of)) for _ in range(len(xs) + 1)]
            places = [builder.bitcast(place, ir.ArrayType(ir.DoubleType(), of.width).as_pointer()) for place in vectors]
            for i, x in enumerate(xs):
                builder.store(context.cast(builder, builder.extract_value(args[0], i), x, of), vectors[i])
            with cgutils.for_range(builder, ir.Constant(ir.IntType(64), of.width)) as loop:
                *inputs, output = (cgutils.gep_inbounds(builder, place, 0, loop.index) for place in places)
                builder.store(context.compile_internal(builder, scalar, single, [builder.load(one) for one in inputs]), output)
            return builder.load(vectors[-1])

        return of(xs), lowered

    namespace: dict[str, Any] = {"mapped": mapped}
    exec(f"def lanewise({arguments}):\n    return mapped(({arguments},))", namespace)
    return namespace["lanewise"]


FUNCTIONS: dict[Any, Any] = {
    np.exp: lambda x: np.exp(x),
    np.expm1: lambda x: np.expm1(x),
    np.exp2: lambda x: np.exp2(x),
    np.log: lambda x: np.log(x),
    np.log1p: lambda x: np.log1p(x),
    np.log2: lambda x: np.log2(x),
    np.log10: lambda x: np.log10(x),
    np.sin: lambda x: np.sin(x),
    np.cos: lambda x: np.cos(x),
    np.tan: lambda x: np.tan(x),
    np.arcsin: lambda x: np.arcsin(x),
    np.arccos: lambda x: np.arccos(x),
    np.arctan: lambda x: np.arctan(x),
    np.sinh: lambda x: np.sinh(x),
    np.cosh: lambda x: np.cosh(x),
    np.tanh: lambda x: np.tanh(x),
    np.arcsinh: lambda x: np.arcsinh(x),
    np.arccosh: lambda x: np.arccosh(x),
    np.arctanh: lambda x: np.arctanh(x),
    np.sign: lambda x: np.sign(x),
    np.floor: lambda x: np.floor(x),
}
"""Functions of one number that are called for one lane after another."""


def _of_one(function: Any, scalar: Any) -> None:
    lanewise = one_by_one(scalar, "x")

    @overload(function, strict=False)  # type: ignore[untyped-decorator]
    def typed(x: Any) -> Any:
        return lanewise if isinstance(x, Lanes) else None


def _of_two(function: Any, scalar: Any) -> None:
    lanewise = one_by_one(scalar, "x, y")

    @overload(function, strict=False)  # type: ignore[untyped-decorator]
    def typed(x: Any, y: Any) -> Any:
        return lanewise if isinstance(x, Lanes) or isinstance(y, Lanes) else None


for _function, _scalar in FUNCTIONS.items():
    _of_one(_function, _scalar)
_of_two(operator.pow, lambda x, y: x**y)
_of_two(np.arctan2, lambda x, y: np.arctan2(x, y))


@intrinsic  # type: ignore[untyped-decorator]
def square_root(typingctx: Any, x: Any) -> Any:
    """Return the square root in each lane."""
    return x(x), lambda context, builder, sig, args: intrinsic_of(builder, "sqrt", args[0])


@overload(np.sqrt, strict=False)  # type: ignore[untyped-decorator]
def _sqrt(x: Any) -> Any:
    return (lambda x: square_root(x)) if isinstance(x, Lanes) else None


def _extreme(function: Any, sign: str) -> None:
    """Extend a minimum or a maximum to lanes: each number in turn replaces the result so far if it exceeds it."""

    @intrinsic  # type: ignore[untyped-decorator]
    def chosen(typingctx: Any, xs: Any) -> Any:
        of = Lanes(common(xs), width_of(xs))

        def further(builder: Any, x: Any, y: Any) -> Any:
            beyond = builder.fcmp_ordered(sign, y, x) if of.dtype == types.float64 else builder.icmp_signed(sign, y, x)
            return builder.select(beyond, y, x)

        def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            items = [context.cast(builder, builder.extract_value(args[0], i), x, of) for i, x in enumerate(xs)]
            return reduce(lambda x, y: further(builder, x, y), items)

        return of(xs), lowered

    @overload(function, strict=False)  # type: ignore[untyped-decorator]
    def typed(*x: Any) -> Any:
        return (lambda *x: chosen(x)) if width_of(x) else None


_extreme(max, ">")
_extreme(min, "<")
