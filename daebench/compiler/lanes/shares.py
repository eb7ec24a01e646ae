"""Smallest relative pivots in lanes, with divisions delayed until a value is needed.

Each iteration tests whether a pivot exceeds a bound, but only the last one needs its value. If the bound is
a power of two, a / s > bound, rounded, and a > bound s are equivalent, except for numbers that overflow or underflow.
"""

import operator
from functools import reduce
from typing import Any

from llvmlite import ir
from numba import types
from numba.core.datamodel.models import StructModel
from numba.core.imputils import lower_cast
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, register_model

from daebench.compiler.lanes.number import INT32, Lanes, repeated, spread, width_of


class Share(Lanes):
    """The type of the smallest of several quotients a_k / s_k in each lane, and of 1 if ``first`` is positive and finite, else 0."""

    def __init__(self, width: int, count: int) -> None:
        super().__init__(types.float64, width)
        self.count = count
        self.name = f"Share{width}({count})"

    @property
    def key(self) -> Any:
        """Numbers of lanes and of quotients."""
        return "share", self.width, self.count

    @property
    def value(self) -> Lanes:
        """The type of its value."""
        return Lanes(types.float64, self.width)


@register_model(Share)
class ShareModel(StructModel):  # type: ignore[misc]
    """First, numerators and denominators."""

    def __init__(self, dmm: Any, fe_type: Share) -> None:
        names = ["first", *(f"a{k}" for k in range(fe_type.count)), *(f"s{k}" for k in range(fe_type.count))]
        super().__init__(dmm, fe_type, [(name, fe_type.value) for name in names])


@intrinsic  # type: ignore[untyped-decorator]
def smallest_share(typingctx: Any, first: Any, a: Any, s: Any) -> Any:
    """Return the smallest of a_k / s_k, and of 1 if ``first`` is positive and finite, else 0."""
    kinds = [first, *a, *s]
    of = Share(max(1, width_of(kinds)), len(a))
    plain = not width_of(kinds)

    def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        items = [args[0], *(builder.extract_value(args[side], k) for side in (1, 2) for k in range(of.count))]
        made = context.get_constant_null(of)
        for k, (item, kind) in enumerate(zip(items, kinds, strict=True)):
            made = builder.insert_value(made, context.cast(builder, item, kind, of.value), k)
        if not plain:
            return made
        return builder.extract_element(context.cast(builder, made, of, of.value), ir.Constant(INT32, 0))

    return (types.float64 if plain else of)(first, a, s), lowered


def _parts(builder: Any, of: Share, x: Any) -> tuple[Any, list[tuple[Any, Any]]]:
    return builder.extract_value(x, 0), [
        (builder.extract_value(x, 1 + k), builder.extract_value(x, 1 + of.count + k)) for k in range(of.count)
    ]


@lower_cast(Share, Lanes)  # type: ignore[untyped-decorator]
def _value(context: Any, builder: Any, fromty: Share, toty: Lanes, x: Any) -> Any:
    """Divide, and return the smallest quotient."""
    if fromty == toty:
        return x
    first, quotients = _parts(builder, fromty, x)
    zero, one = repeated(fromty.value, 0.0), repeated(fromty.value, 1.0)
    finite = builder.fcmp_ordered("<", first, repeated(fromty.value, float("inf")))
    smallest = builder.select(builder.and_(builder.fcmp_ordered(">", first, zero), finite), one, zero)
    for a, s in quotients:
        share = builder.select(builder.fcmp_ordered(">", s, zero), builder.fdiv(a, s), zero)
        smallest = builder.select(builder.fcmp_ordered("<", share, smallest), share, smallest)
    return smallest


@infer_global(operator.gt)
class _Larger(AbstractTemplate):  # type: ignore[misc]
    """Whether a share is larger than a number."""

    def generic(self, args: Any, kws: Any) -> Any:
        """Return the type of a test of a share and a plain number."""
        if len(args) == 2 and isinstance(args[0], Share) and isinstance(args[1], types.Float):
            return signature(Lanes(types.boolean, args[0].width), args[0], types.float64)
        return None


@lower_builtin(operator.gt, Share, types.Float)  # type: ignore[untyped-decorator]
def _larger(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    of = sig.args[0]
    bound = spread(context, builder, types.float64, of.value, args[1])
    first, quotients = _parts(builder, of, args[0])
    finite = builder.fcmp_ordered("<", first, repeated(of.value, float("inf")))
    tests = [builder.fcmp_ordered(">", first, repeated(of.value, 0.0)), finite]
    tests += [builder.fcmp_ordered(">", a, builder.fmul(bound, s)) for a, s in quotients]
    return reduce(builder.and_, tests)
