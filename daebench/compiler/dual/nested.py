"""Dual numbers in arrays and in nested tuples, which hold states and parameters.

A nested tuple may contain real numbers and integers besides dual ones. Those have no derivatives, and ``None`` takes their place.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, overload

from daebench.compiler.codegen import pack
from daebench.compiler.dual.functions import chained, modulus, value
from daebench.compiler.dual.number import INT32, Dual, constant, joined, split, times

__all__ = [
    "at_rest",
    "finite_tangents",
    "lifted",
    "modulus",
    "put",
    "rescaled",
    "select",
    "spread",
    "square",
    "take",
    "tangents",
    "unsettled",
    "value",
    "values",
    "with_tangents",
]

MOST_ITEMS = 30
"""Number of items up to which Python makes a tuple at once; numba does not support longer tuples in one expression."""

SETTLED = 16 * 2.0**-52
"""Derivatives have converged if an iteration changes them by at most this fraction of their size."""

STALLED = 1e4 * 2.0**-52
"""They have also converged if the change is no smaller than in the iteration before and at most this fraction of values and derivatives."""


def values(x: Any) -> Any:
    """Return the values of the numbers in a nested tuple."""


def lifted(x: Any, dx: Any) -> Any:
    """Return a nested tuple of real numbers with derivatives: in place of each number, a tuple of k derivatives or None."""


def with_tangents(x: Any, y: Any) -> Any:
    """Return the values of x with the derivatives of y, a nested tuple of the same form."""


def rescaled(x: Any, factor: Any) -> Any:
    """Return a nested tuple with the same values and derivatives times a factor."""


def square(x: Any, units: Any) -> Any:
    """Return the sum of the squares of first derivatives times units, a nested tuple of numbers of the same form."""


def tangents(x: Any) -> Any:
    """Return the derivatives of the numbers in a nested tuple: in place of each number, a tuple of k derivatives or None."""


def _itemwise(function: str, arguments: str, of: types.BaseTuple, handed: str = "") -> Any:
    """Return a function of nested tuples that calls itself for each item, with one further argument that it passes on unchanged."""
    items = [f"{function}({', '.join(f'{name}[{i}]' for name in arguments.split(', '))}{handed})" for i in range(len(of))]
    parts = [pack(items[k : k + MOST_ITEMS]) for k in range(0, len(items), MOST_ITEMS)]
    namespace: dict[str, Any] = {}
    exec(f"def itemwise({arguments}{handed}):\n    return {' + '.join(parts) or '()'}", globals(), namespace)
    return namespace["itemwise"]


@overload(values, strict=False)  # type: ignore[untyped-decorator]
def _values(x: Any) -> Any:
    if isinstance(x, types.BaseTuple):
        return _itemwise("values", "x", x)
    return (lambda x: value(x)) if isinstance(x, Dual) else (lambda x: x)


@overload(lifted, strict=False)  # type: ignore[untyped-decorator]
def _lifted(x: Any, dx: Any) -> Any:
    if isinstance(dx, types.NoneType):
        return lambda x, dx: x
    if isinstance(x, types.BaseTuple):
        return _itemwise("lifted", "x, dx", x)
    return lambda x, dx: _dual(x, dx)


@overload(with_tangents, strict=False)  # type: ignore[untyped-decorator]
def _with_tangents(x: Any, y: Any) -> Any:
    if isinstance(y, types.BaseTuple):
        return _itemwise("with_tangents", "x, y", y)
    return (lambda x, y: _with(value(x), y)) if isinstance(y, Dual) else (lambda x, y: x)


@overload(tangents, strict=False)  # type: ignore[untyped-decorator]
def _tangents(x: Any) -> Any:
    if isinstance(x, types.BaseTuple):
        return _itemwise("tangents", "x", x)
    return (lambda x: _tuple(x)) if isinstance(x, Dual) else (lambda x: None)


@overload(rescaled, strict=False)  # type: ignore[untyped-decorator]
def _rescaled(x: Any, factor: Any) -> Any:
    if isinstance(x, types.BaseTuple):
        return _itemwise("rescaled", "x", x, ", factor")
    return (lambda x, factor: chained(value(x), factor, x)) if isinstance(x, Dual) else (lambda x, factor: x)


@overload(square, strict=False)  # type: ignore[untyped-decorator]
def _square(x: Any, units: Any) -> Any:
    if isinstance(x, types.BaseTuple):
        namespace: dict[str, Any] = {}
        terms = [f"square(x[{i}], units[{i}])" for i in range(len(x))]
        exec(f"def summed(x, units):\n    return {' + '.join(terms) or '0.0'}", globals(), namespace)
        return namespace["summed"]
    return (lambda x, units: (_tuple(x)[0] * units) ** 2) if isinstance(x, Dual) else (lambda x, units: 0.0)


@intrinsic  # type: ignore[untyped-decorator]
def _dual(typingctx: Any, x: Any, dx: Any) -> Any:
    """Return the dual number of a value and a tuple of derivatives."""
    of = Dual(len(dx))

    def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        vector = constant(of.k, 0.0)
        for i in range(of.k):
            vector = builder.insert_element(vector, builder.extract_value(args[1], i), ir.Constant(INT32, i))
        return joined(context, builder, of, args[0], vector)

    return of(types.float64, types.UniTuple(types.float64, of.k)), lowered


@intrinsic  # type: ignore[untyped-decorator]
def _with(typingctx: Any, x: Any, y: Any) -> Any:
    """Return the dual number of a value and the derivatives of another."""

    def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return joined(context, builder, sig.return_type, args[0], split(context, builder, sig.args[1], args[1])[1])

    return y(types.float64, y), lowered


@intrinsic  # type: ignore[untyped-decorator]
def _tuple(typingctx: Any, x: Any) -> Any:
    """Return the derivatives of a dual number as a tuple."""
    of = types.UniTuple(types.float64, x.k)

    def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        vector = split(context, builder, sig.args[0], args[0])[1]
        return context.make_tuple(builder, of, [builder.extract_element(vector, ir.Constant(INT32, i)) for i in range(x.k)])

    return of(x), lowered


def _place(context: Any, builder: Any, of: Any, args: Any, k: int) -> Any:
    """Return the address of k numbers in a row of an array, given the array and leading indices of the first of them, others 0."""
    array = context.make_array(of)(context, builder, args[0])
    indices = [*args[1:], *[context.get_constant(types.intp, 0)] * (of.ndim - len(args) + 1)]
    pointer = cgutils.get_item_pointer(context, builder, of, array, indices)
    return builder.bitcast(pointer, ir.VectorType(ir.DoubleType(), k).as_pointer())


@intrinsic  # type: ignore[untyped-decorator]
def put(typingctx: Any, array: Any, i: Any, j: Any, x: Any) -> Any:
    """Write the derivatives of a dual number into a row of an array from [i, j] on. For a real number nothing is written."""

    def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        number = split(context, builder, sig.args[3], args[3])[1]
        if number is not None:
            builder.store(number, _place(context, builder, sig.args[0], args[:3], number.type.count)).align = 8
        return context.get_dummy_value()

    return types.none(array, types.intp, types.intp, x), lowered


@intrinsic  # type: ignore[untyped-decorator]
def spread(typingctx: Any, array: Any, i: Any, j: Any, x: Any) -> Any:
    """Write the derivatives of a dual number into an array at [0, i, j], [1, i, j] and so on. For a real number nothing is written."""

    def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        number, of = split(context, builder, sig.args[3], args[3])[1], sig.args[0]
        for c in range(number.type.count if number is not None else 0):
            place = [context.get_constant(types.intp, c), *args[1:3]]
            pointer = cgutils.get_item_pointer(context, builder, of, context.make_array(of)(context, builder, args[0]), place)
            builder.store(builder.extract_element(number, ir.Constant(INT32, c)), pointer)
        return context.get_dummy_value()

    return types.none(array, types.intp, types.intp, x), lowered


@intrinsic(prefer_literal=True)  # type: ignore[untyped-decorator]
def take(typingctx: Any, array: Any, i: Any, j: Any, x: Any, k: Any) -> Any:
    """Return the dual number with value x whose k derivatives are in a row of an array from [i, j] on."""
    of = Dual(k.literal_value)

    def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        vector = builder.load(_place(context, builder, sig.args[0], args[:3], of.k))
        vector.align = 8
        return joined(context, builder, of, args[3], vector)

    return of(array, types.intp, types.intp, types.float64, k), lowered


@intrinsic  # type: ignore[untyped-decorator]
def unsettled(typingctx: Any, size: Any, scale: Any, last: Any) -> Any:
    """Return the change in an iteration; its derivatives are -1 in directions in which they have converged, now or before.

    Parameters
    ----------
    size, scale : number
        Change in this iteration, and the size that it is measured against.
    last : number
        Result of this function for the iteration before.
    """

    def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        (number, change), (whole, part), (_, before) = (split(context, builder, of, x) for of, x in zip(sig.args, args, strict=True))
        if change is None:
            return number
        k = change.type.count
        part = constant(k, 0.0) if part is None else part
        settled = builder.fcmp_ordered("<=", change, builder.fmul(constant(k, SETTLED), part))
        small = builder.fmul(constant(k, STALLED), builder.fadd(part, times(builder, whole, constant(k, 1.0))))
        stalled = builder.and_(builder.fcmp_ordered(">=", change, before), builder.fcmp_ordered("<=", change, small))
        return joined(context, builder, sig.return_type, number, builder.select(builder.or_(settled, stalled), constant(k, -1.0), change))

    result = size if isinstance(size, Dual) else types.float64
    return result(result, scale, result), lowered


@intrinsic  # type: ignore[untyped-decorator]
def at_rest(typingctx: Any, last: Any) -> Any:
    """Return whether the derivatives have converged in every direction, given the result of :func:`unsettled`."""

    def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        vector = split(context, builder, sig.args[0], args[0])[1]
        if vector is None:
            return context.get_constant(types.boolean, True)
        return _everywhere(builder, builder.fcmp_ordered("<", vector, constant(vector.type.count, 0.0)))

    return types.boolean(last), lowered


@intrinsic  # type: ignore[untyped-decorator]
def finite_tangents(typingctx: Any, size: Any) -> Any:
    """Return whether the derivatives of a number are finite."""

    def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        vector = split(context, builder, sig.args[0], args[0])[1]
        if vector is None:
            return context.get_constant(types.boolean, True)
        return _everywhere(builder, builder.fcmp_ordered("<", vector, constant(vector.type.count, float("inf"))))

    return types.boolean(size), lowered


@intrinsic  # type: ignore[untyped-decorator]
def select(typingctx: Any, first: Any, x: Any, y: Any) -> Any:
    """Return x if the truth value ``first`` is true, else y, without a branch."""
    of = next((number for number in (x, y) if isinstance(number, Dual)), types.float64)

    def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        (a, da), (b, db) = (split(context, builder, number, value) for number, value in zip(sig.args[1:], args[1:], strict=True))
        chosen = builder.select(args[0], a, b)
        if da is None and db is None:
            return chosen
        vectors = (constant(of.k, 0.0) if vector is None else vector for vector in (da, db))
        return joined(context, builder, of, chosen, builder.select(args[0], *vectors))

    return of(types.boolean, x, y), lowered


def _everywhere(builder: Any, truths: Any) -> Any:
    """Return whether all entries of a vector of truth values are true."""
    k = truths.type.count
    return builder.icmp_unsigned("==", builder.bitcast(truths, ir.IntType(k)), ir.Constant(ir.IntType(k), 2**k - 1))
