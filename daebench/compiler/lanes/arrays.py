"""Lanes read from and written to arrays.

Arrays of nested tuples have a column for each run: lane w of a block that begins at column b is in column b + w.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.imputils import impl_ret_borrowed
from numba.extending import intrinsic, overload

from daebench.compiler.lanes.number import INT32, Lanes, vector, width_of


def leaves(of: Any) -> int:
    """Return how many numbers there are in nested tuples of a type."""
    return sum(map(leaves, of)) if isinstance(of, types.BaseTuple) else 1


@intrinsic  # type: ignore[untyped-decorator]
def length_of(typingctx: Any, x: Any) -> Any:
    """Return how many numbers there are in nested tuples."""
    return types.intp(x), lambda context, builder, sig, args: context.get_constant(types.intp, leaves(x))


def _address(context: Any, builder: Any, of: Any, array: Any, indices: Any, lanes: Lanes) -> Any:
    """Return the address of lanes in an array, given the array's type and all indices of the first of them."""
    struct = context.make_array(of)(context, builder, array)
    return builder.bitcast(cgutils.get_item_pointer(context, builder, of, struct, indices), vector(lanes).as_pointer())


def _read(builder: Any, address: Any) -> Any:
    value = builder.load(address)
    value.align = 8
    return value


@intrinsic(prefer_literal=True)  # type: ignore[untyped-decorator]
def take_all(typingctx: Any, like: Any, array: Any, row: Any, column: Any, width: Any) -> Any:
    """Return nested tuples of the form of ``like``, whose numbers are read from rows of an array, one row for each number."""
    lanes = Lanes(array.dtype, width.literal_value)

    def form(of: Any) -> Any:
        return types.Tuple(tuple(map(form, of))) if isinstance(of, types.BaseTuple) else lanes

    def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        first, b = context.cast(builder, args[2], row, types.intp), context.cast(builder, args[3], column, types.intp)

        def made(of: Any, place: int) -> Any:
            if not isinstance(of, types.BaseTuple):
                at = builder.add(first, context.get_constant(types.intp, place))
                return _read(builder, _address(context, builder, array, args[1], [at, b], lanes))
            places = [place + sum(map(leaves, tuple(of)[:i])) for i in range(len(of))]
            return context.make_tuple(builder, of, [made(part, at) for part, at in zip(of, places, strict=True)])

        return made(sig.return_type, 0)

    return form(like)(like, array, row, column, width), lowered


@intrinsic  # type: ignore[untyped-decorator]
def put_all(typingctx: Any, array: Any, row: Any, column: Any, live: Any, x: Any) -> Any:
    """Write the numbers of nested tuples into rows of an array, in the active lanes only."""
    lanes = Lanes(array.dtype, live.width)

    def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        first, b = context.cast(builder, args[1], row, types.intp), context.cast(builder, args[2], column, types.intp)

        def written(of: Any, a: Any, place: int) -> None:
            if isinstance(of, types.BaseTuple):
                for i, part in enumerate(of):
                    written(part, builder.extract_value(a, i), place + sum(map(leaves, tuple(of)[:i])))
                return
            at = builder.add(first, context.get_constant(types.intp, place))
            address = _address(context, builder, array, args[0], [at, b], lanes)
            new = builder.select(args[3], context.cast(builder, a, of, lanes), _read(builder, address))
            builder.store(new, address).align = 8

        written(x, args[4], 0)
        return context.get_dummy_value()

    return types.none(array, row, column, live, x), lowered


@intrinsic(prefer_literal=True)  # type: ignore[untyped-decorator]
def mixed(typingctx: Any, x: Any, array: Any, column: Any, width: Any) -> Any:
    """Return nested tuples in which each integer is replaced by the row of an array that it denotes; other entries stay."""
    lanes = Lanes(array.dtype, width.literal_value)

    def form(of: Any) -> Any:
        if isinstance(of, types.BaseTuple):
            return types.Tuple(tuple(map(form, of)))
        return lanes if isinstance(of, types.Integer) else of

    def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        b = context.cast(builder, args[2], column, types.intp)

        def made(of: Any, a: Any, result: Any) -> Any:
            if isinstance(of, types.BaseTuple):
                items = [made(part, builder.extract_value(a, i), tuple(result)[i]) for i, part in enumerate(of)]
                return context.make_tuple(builder, result, items)
            if not isinstance(of, types.Integer):
                return a
            return _read(builder, _address(context, builder, array, args[1], [context.cast(builder, a, of, types.intp), b], lanes))

        return impl_ret_borrowed(context, builder, sig.return_type, made(x, args[0], sig.return_type))

    return form(x)(x, array, column, width), lowered


def _each_address(context: Any, builder: Any, sig: Any, args: Any, lanes: Lanes) -> list[Any]:
    """Return the address of each lane at [row, place] of an array with a last axis for the lanes, given array, row and place."""
    struct = context.make_array(sig.args[0])(context, builder, args[0])
    addresses = []
    for lane in range(lanes.width):
        at = ir.Constant(INT32, lane)
        indices = [
            builder.extract_element(x, at) if isinstance(of, Lanes) else context.cast(builder, x, of, types.intp)
            for of, x in zip(sig.args[1:3], args[1:3], strict=True)
        ]
        indices.append(context.get_constant(types.intp, lane))
        addresses.append(cgutils.get_item_pointer(context, builder, sig.args[0], struct, indices))
    return addresses


@intrinsic(prefer_literal=True)  # type: ignore[untyped-decorator]
def entry_of(typingctx: Any, array: Any, row: Any, place: Any, width: Any) -> Any:
    """Return the lanes at [row, place] of an array, where row and place may be lanes themselves."""
    lanes = Lanes(array.dtype, width.literal_value)

    def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        if not width_of([row, place]):
            indices = [context.cast(builder, x, of, types.intp) for of, x in ((row, args[1]), (place, args[2]))]
            return _read(builder, _address(context, builder, array, args[0], [*indices, context.get_constant(types.intp, 0)], lanes))
        result = ir.Constant(vector(lanes), ir.Undefined)
        for lane, address in enumerate(_each_address(context, builder, sig, args, lanes)):
            result = builder.insert_element(result, builder.load(address), ir.Constant(INT32, lane))
        return result

    return lanes(array, row, place, width), lowered


@intrinsic(prefer_literal=True)  # type: ignore[untyped-decorator]
def _put(typingctx: Any, array: Any, row: Any, place: Any, column: Any, x: Any, width: Any) -> Any:
    """Write lanes, or a number for each, into an array at [row, place, column] and after it; from column 0 on if a place is lanes."""
    lanes = Lanes(array.dtype, width.literal_value)

    def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        value = context.cast(builder, args[4], x, lanes)
        if width_of([row, place]):
            for lane, address in enumerate(_each_address(context, builder, sig, args, lanes)):
                builder.store(builder.extract_element(value, ir.Constant(INT32, lane)), address)
            return context.get_dummy_value()
        indices = [context.cast(builder, y, of, types.intp) for of, y in zip((row, place, column), args[1:4], strict=True)]
        builder.store(value, _address(context, builder, array, args[0], indices, lanes)).align = 8
        return context.get_dummy_value()

    return types.none(array, row, place, column, x, width), lowered


def put(array: Any, row: Any, place: Any, x: Any, width: Any) -> None:
    """Write lanes, or a number for each, into an array whose last axis is the lanes, or into columns of (array, column)."""


@overload(put, strict=False, prefer_literal=True)  # type: ignore[untyped-decorator]
def _putting(array: Any, row: Any, place: Any, x: Any, width: Any) -> Any:
    lanes = width.literal_value
    if isinstance(array, types.BaseTuple):
        return lambda array, row, place, x, width: _put(array[0], row, place, array[1], x, lanes)
    return lambda array, row, place, x, width: _put(array, row, place, 0, x, lanes)
