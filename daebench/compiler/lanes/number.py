"""The type of lanes: W doubles, integers or truth values in one LLVM vector, with their arithmetic and comparisons.

No operation is contracted or reordered, so that each lane has the same bits as a scalar computation. A plain number is the same in all
lanes.
"""

import operator
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.datamodel.models import PrimitiveModel
from numba.core.imputils import lower_cast
from numba.core.typeconv import Conversion
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin, register_model

INT32 = ir.IntType(32)
SCALAR = (types.Float, types.Integer, types.Boolean)
ELEMENTS = {types.float64: ir.DoubleType(), types.int64: ir.IntType(64), types.boolean: ir.IntType(1)}
"""LLVM's types of the entries of lanes."""


class Lanes(types.Type):  # type: ignore[misc]
    """The type of W numbers of one type: float64, int64 or boolean."""

    def __init__(self, dtype: Any, width: int) -> None:
        self.dtype, self.width = dtype, width
        super().__init__(name=f"Lanes{width}({dtype})")

    @property
    def key(self) -> Any:
        """Type of the numbers, and their count."""
        return self.dtype, self.width

    def can_convert_from(self, typingctx: Any, other: Any) -> Any:
        """Return how a number of another type is converted to this type."""
        wider = isinstance(other, Lanes) and other.width == self.width and common([self, other]) == self.dtype
        return Conversion.promote if wider or (isinstance(other, SCALAR) and common([self, other]) == self.dtype) else None

    def unify(self, typingctx: Any, other: Any) -> Any:
        """Return the common type of this type and another."""
        return Lanes(common([self, other]), self.width) if isinstance(other, (Lanes, *SCALAR)) else None


@register_model(Lanes)
class LanesModel(PrimitiveModel):  # type: ignore[misc]
    """Lanes are an LLVM vector."""

    def __init__(self, dmm: Any, fe_type: Lanes) -> None:
        super().__init__(dmm, fe_type, vector(fe_type))


def vector(of: Lanes) -> Any:
    """Return LLVM's type."""
    return ir.VectorType(ELEMENTS[of.dtype], of.width)


def element(of: Any) -> Any:
    """Return the type of the numbers in a type: float64, int64 or boolean."""
    if isinstance(of, Lanes):
        return of.dtype
    return types.boolean if isinstance(of, types.Boolean) else types.float64 if isinstance(of, types.Float) else types.int64


def common(several: Any) -> Any:
    """Return the type to which numbers of several types can be converted."""
    elements = {element(of) for of in several}
    return next(of for of in (types.float64, types.int64, types.boolean) if of in elements)


def width_of(several: Any) -> int:
    """Return the number of lanes of several types; 0 if none has lanes."""
    return max((of.width for of in several if isinstance(of, Lanes)), default=0)


def repeated(of: Lanes, value: float) -> Any:
    """Return the vector of W equal constants."""
    return ir.Constant(vector(of), [value] * of.width)


@lower_cast(types.Float, Lanes)  # type: ignore[untyped-decorator]
@lower_cast(types.Integer, Lanes)  # type: ignore[untyped-decorator]
@lower_cast(types.Boolean, Lanes)  # type: ignore[untyped-decorator]
def spread(context: Any, builder: Any, fromty: Any, toty: Lanes, val: Any) -> Any:
    """Return a plain number as lanes."""
    number = context.cast(builder, val, fromty, toty.dtype)
    if toty.dtype == types.boolean:  # numba computes with i1, and passes i8
        number = builder.trunc(number, ir.IntType(1)) if number.type.width > 1 else number
    nothing = ir.Constant(vector(toty), ir.Undefined)
    first = builder.insert_element(nothing, number, ir.Constant(INT32, 0))
    return builder.shuffle_vector(first, nothing, ir.Constant(ir.VectorType(INT32, toty.width), [0] * toty.width))


@lower_cast(Lanes, Lanes)  # type: ignore[untyped-decorator]
def converted(context: Any, builder: Any, fromty: Lanes, toty: Lanes, val: Any) -> Any:
    """Return lanes converted to another type of number."""
    if fromty == toty:
        return val
    if fromty.dtype == types.boolean:
        val = builder.zext(val, vector(Lanes(types.int64, fromty.width)))
    return val if toty.dtype == types.int64 else builder.sitofp(val, vector(toty))


def _binary(operation: Any, instructions: dict[Any, Any], result: Any = None) -> None:
    """Define an operation on two numbers of which at least one is lanes, given LLVM's instruction for each type of number."""

    class Typed(AbstractTemplate):  # type: ignore[misc]
        key = operation

        def generic(self, args: Any, kws: Any) -> Any:
            width = width_of(args)
            if len(args) != 2 or not width or not all(isinstance(of, (Lanes, *SCALAR)) for of in args):
                return None
            dtype = common(args)
            if dtype not in instructions:
                dtype = types.float64
            of = Lanes(dtype, width)
            return signature(Lanes(result or dtype, width), of, of) if dtype in instructions else None

    infer_global(operation)(Typed)

    @lower_builtin(operation, Lanes, Lanes)  # type: ignore[untyped-decorator]
    def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return instructions[sig.args[0].dtype](builder, *args)


for _names, _float, _whole in (
    (("add", "iadd"), "fadd", "add"),
    (("sub", "isub"), "fsub", "sub"),
    (("mul", "imul"), "fmul", "mul"),
):
    for _name in _names:
        _binary(
            getattr(operator, _name),
            {
                types.float64: lambda builder, x, y, instruction=_float: getattr(builder, instruction)(x, y),
                types.int64: lambda builder, x, y, instruction=_whole: getattr(builder, instruction)(x, y),
            },
        )
for _name in ("truediv", "itruediv"):
    _binary(getattr(operator, _name), {types.float64: lambda builder, x, y: builder.fdiv(x, y)})
for _names, _instruction in ((("and_", "iand"), "and_"), (("or_", "ior"), "or_")):
    for _name in _names:
        _binary(
            getattr(operator, _name),
            {types.boolean: lambda builder, x, y, instruction=_instruction: getattr(builder, instruction)(x, y)},
        )


def _compared(sign: str) -> dict[Any, Any]:
    """Return the comparisons for a sign; among floats, NaN is unequal to every number and unordered."""

    def floats(builder: Any, x: Any, y: Any) -> Any:
        return builder.fcmp_unordered(sign, x, y) if sign == "!=" else builder.fcmp_ordered(sign, x, y)

    return {types.float64: floats, types.int64: lambda builder, x, y: builder.icmp_signed(sign, x, y)}


for _name, _sign in (("lt", "<"), ("le", "<="), ("gt", ">"), ("ge", ">="), ("eq", "=="), ("ne", "!=")):
    _binary(getattr(operator, _name), _compared(_sign), types.boolean)


def _unary(operation: Any, instructions: dict[Any, Any]) -> None:
    """Define an operation on lanes."""

    class Typed(AbstractTemplate):  # type: ignore[misc]
        key = operation

        def generic(self, args: Any, kws: Any) -> Any:
            known = len(args) == 1 and isinstance(args[0], Lanes) and args[0].dtype in instructions
            return signature(args[0], args[0]) if known else None

    infer_global(operation)(Typed)

    @lower_builtin(operation, Lanes)  # type: ignore[untyped-decorator]
    def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return instructions[sig.args[0].dtype](builder, *args)


def intrinsic_of(builder: Any, name: str, x: Any) -> Any:
    """Return the result of LLVM's own function of doubles for each lane."""
    function = cgutils.get_or_insert_function(builder.module, ir.FunctionType(x.type, [x.type]), f"llvm.{name}.v{x.type.count}f64")
    return builder.call(function, [x])


_unary(operator.neg, {types.float64: lambda builder, x: builder.fneg(x), types.int64: lambda builder, x: builder.neg(x)})
_unary(operator.pos, {types.float64: lambda builder, x: x, types.int64: lambda builder, x: x})
_unary(abs, {types.float64: lambda builder, x: intrinsic_of(builder, "fabs", x)})
