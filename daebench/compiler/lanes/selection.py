"""Operations on lanes in nested tuples, which hold states and reports: selection, negation, and NaN for inactive runs."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from daebench.compiler.lanes.number import SCALAR, Lanes, common, repeated, width_of


def _merged(first: Any, x: Any, y: Any) -> Any:
    """Return the common type of x and y, with lanes if ``first`` is lanes."""
    if isinstance(x, types.BaseTuple):
        return types.Tuple(tuple(_merged(first, a, b) for a, b in zip(x, y, strict=True)))
    if not isinstance(x, (Lanes, *SCALAR)):
        return x
    width = width_of([first, x, y])
    return Lanes(common([x, y]), width) if width else common([x, y])


@intrinsic  # type: ignore[untyped-decorator]
def select(typingctx: Any, first: Any, x: Any, y: Any) -> Any:
    """Return x where the truth value ``first`` is true, else y, for each number in nested tuples of the same form."""

    def chosen(context: Any, builder: Any, test: Any, of: Any, x: tuple[Any, Any], y: tuple[Any, Any]) -> Any:
        (kind_x, a), (kind_y, b) = x, y
        if isinstance(of, types.BaseTuple):
            items = [
                chosen(
                    context,
                    builder,
                    test,
                    part,
                    (tuple(kind_x)[i], builder.extract_value(a, i)),
                    (tuple(kind_y)[i], builder.extract_value(b, i)),
                )
                for i, part in enumerate(of)
            ]
            return context.make_tuple(builder, of, items)
        if not isinstance(of, (Lanes, *SCALAR)):
            return a
        return builder.select(test, context.cast(builder, a, kind_x, of), context.cast(builder, b, kind_y, of))

    def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return chosen(context, builder, args[0], sig.return_type, (x, args[1]), (y, args[2]))

    return _merged(first, x, y)(first, x, y), lowered


@intrinsic  # type: ignore[untyped-decorator]
def anyof(typingctx: Any, truths: Any) -> Any:
    """Return whether a truth value is true in any lane."""

    def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        if not isinstance(truths, Lanes):
            return args[0]
        bits = ir.IntType(truths.width)
        return builder.icmp_unsigned("!=", builder.bitcast(args[0], bits), ir.Constant(bits, 0))

    return types.boolean(truths), lowered


@intrinsic  # type: ignore[untyped-decorator]
def negated(typingctx: Any, truths: Any) -> Any:
    """Return whether a truth value is false, lane by lane."""
    of = truths if isinstance(truths, Lanes) else types.boolean
    return of(of), lambda context, builder, sig, args: builder.not_(args[0])


@intrinsic  # type: ignore[untyped-decorator]
def absent(typingctx: Any, function: Any, arguments: Any) -> Any:
    """Return zeros in place of the result of a function, which is not called."""
    of = typingctx.resolve_function_type(function, tuple(arguments), {}).return_type
    return of(function, arguments), lambda context, builder, sig, args: context.get_constant_null(sig.return_type)


@intrinsic  # type: ignore[untyped-decorator]
def spoiled(typingctx: Any, live: Any, x: Any) -> Any:
    """Return numbers with NaN in the inactive lanes, so that no iteration continues for them."""

    def rule(builder: Any, mask: Any, of: Any, a: Any) -> Any:
        if isinstance(of, types.BaseTuple):
            for i, part in enumerate(of):
                a = builder.insert_value(a, rule(builder, mask, part, builder.extract_value(a, i)), i)
            return a
        if not isinstance(of, Lanes) or of.dtype != types.float64:
            return a
        return builder.select(mask, a, repeated(of, float("nan")))

    return x(live, x), lambda context, builder, sig, args: rule(builder, args[0], x, args[1])
