"""The type of dual numbers, and their arithmetic.

::

    x = x + x_1 e_1 + ... + x_k e_k,      e_i e_j = 0

The value x is a double, and x_1 ... x_k are one LLVM vector of k doubles. No operation on values is contracted or reordered.
Comparisons compare values.
"""

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core.datamodel.models import PrimitiveModel, StructModel
from numba.core.imputils import lower_cast
from numba.core.typeconv import Conversion
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin, register_model

DOUBLE, INT32 = ir.DoubleType(), ir.IntType(32)
REAL = (types.Float, types.Integer)


class Tangents(types.Type):  # type: ignore[misc]
    """The type of the derivatives in k directions."""

    def __init__(self, k: int) -> None:
        self.k = k
        super().__init__(name=f"Tangents{k}")

    @property
    def key(self) -> int:
        """Number of directions."""
        return self.k


class Dual(types.Type):  # type: ignore[misc]
    """The type of numbers with derivatives in k directions; a real number has derivatives 0."""

    def __init__(self, k: int) -> None:
        self.k = k
        super().__init__(name=f"Dual{k}")

    @property
    def key(self) -> int:
        """Number of directions."""
        return self.k

    def can_convert_from(self, typingctx: Any, other: Any) -> Any:
        """Return how a number of another type is converted to this type."""
        return Conversion.promote if isinstance(other, REAL) else None

    def unify(self, typingctx: Any, other: Any) -> Any:
        """Return the common type of this type and another."""
        return self if isinstance(other, REAL) else None


@register_model(Tangents)
class TangentsModel(PrimitiveModel):  # type: ignore[misc]
    """Derivatives are an LLVM vector."""

    def __init__(self, dmm: Any, fe_type: Tangents) -> None:
        super().__init__(dmm, fe_type, ir.VectorType(DOUBLE, fe_type.k))


@register_model(Dual)
class DualModel(StructModel):  # type: ignore[misc]
    """A dual number is a double and a vector of doubles."""

    def __init__(self, dmm: Any, fe_type: Dual) -> None:
        super().__init__(dmm, fe_type, [("value", types.float64), ("tangents", Tangents(fe_type.k))])


def split(context: Any, builder: Any, of: Any, x: Any) -> tuple[Any, Any]:
    """Return value and derivatives of a number of the given type; the derivatives of a real number are None."""
    if not isinstance(of, Dual):
        return context.cast(builder, x, of, types.float64), None
    return builder.extract_value(x, 0), builder.extract_value(x, 1)


def joined(context: Any, builder: Any, of: Dual, value: Any, tangents: Any) -> Any:
    """Return the dual number of the given type with this value and these derivatives."""
    empty = ir.Constant(context.get_value_type(of), ir.Undefined)
    return builder.insert_value(builder.insert_value(empty, value, 0), tangents, 1)


def constant(k: int, x: float) -> Any:
    """Return the vector with k equal entries."""
    return ir.Constant(ir.VectorType(DOUBLE, k), [x] * k)


def times(builder: Any, factor: Any, tangents: Any) -> Any:
    """Return derivatives times a number."""
    k = tangents.type.count
    nothing = ir.Constant(tangents.type, ir.Undefined)
    first = builder.insert_element(nothing, factor, ir.Constant(INT32, 0))
    everywhere = builder.shuffle_vector(first, nothing, ir.Constant(ir.VectorType(INT32, k), [0] * k))
    return builder.fmul(everywhere, tangents)


def _sum(builder: Any, x: Any, dx: Any, y: Any, dy: Any) -> tuple[Any, Any]:
    value = builder.fadd(x, y)
    return value, dx if dy is None else dy if dx is None else builder.fadd(dx, dy)


def _difference(builder: Any, x: Any, dx: Any, y: Any, dy: Any) -> tuple[Any, Any]:
    value = builder.fsub(x, y)
    return value, dx if dy is None else builder.fneg(dy) if dx is None else builder.fsub(dx, dy)


def _product(builder: Any, x: Any, dx: Any, y: Any, dy: Any) -> tuple[Any, Any]:
    terms = [times(builder, factor, tangents) for factor, tangents in ((y, dx), (x, dy)) if tangents is not None]
    return builder.fmul(x, y), terms[0] if len(terms) == 1 else builder.fadd(*terms)


def _quotient(builder: Any, x: Any, dx: Any, y: Any, dy: Any) -> tuple[Any, Any]:
    value, inverse = builder.fdiv(x, y), builder.fdiv(ir.Constant(DOUBLE, 1.0), y)
    if dy is None:
        return value, times(builder, inverse, dx)
    back = times(builder, value, dy)
    return value, times(builder, inverse, builder.fneg(back) if dx is None else builder.fsub(dx, back))


Rule = Callable[[Any, Any, Any, Any, Any], Any]
"""A function from value and derivatives of two numbers to those of the result, or to a truth value."""


def _binary(operation: Any, rule: Rule, result: Any = None) -> None:
    """Define an operation on two numbers of which at least one is dual; the result is dual unless another type is given."""

    class Typed(AbstractTemplate):  # type: ignore[misc]
        key = operation

        def generic(self, args: Any, kws: Any) -> Any:
            duals = [of for of in args if isinstance(of, Dual)]
            if len(args) != 2 or not duals or not all(isinstance(of, (Dual, *REAL)) for of in args):
                return None
            return signature(result or duals[0], *(of if isinstance(of, Dual) else types.float64 for of in args))

    infer_global(operation)(Typed)

    def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        (x, dx), (y, dy) = (split(context, builder, of, number) for of, number in zip(sig.args, args, strict=True))
        made = rule(builder, x, dx, y, dy)
        return made if result else joined(context, builder, sig.return_type, *made)

    for left, right in ((Dual, Dual), (Dual, types.Float), (types.Float, Dual)):
        lower_builtin(operation, left, right)(lowered)


def _comparison(sign: str) -> Rule:
    """Return the rule of a comparison of values. As for floats, NaN is unequal to every number and unordered."""
    compared = "fcmp_unordered" if sign == "!=" else "fcmp_ordered"
    return lambda builder, x, dx, y, dy: getattr(builder, compared)(sign, x, y)


for _rule, *_operations in (
    (_sum, operator.add, operator.iadd),
    (_difference, operator.sub, operator.isub),
    (_product, operator.mul, operator.imul),
    (_quotient, operator.truediv, operator.itruediv),
):
    for _operation in _operations:
        _binary(_operation, _rule)

for _name, _sign in (("lt", "<"), ("le", "<="), ("gt", ">"), ("ge", ">="), ("eq", "=="), ("ne", "!=")):
    _binary(getattr(operator, _name), _comparison(_sign), types.boolean)


@infer_global(operator.neg)
class Negative(AbstractTemplate):  # type: ignore[misc]
    """The type of -x."""

    def generic(self, args: Any, kws: Any) -> Any:
        """Return the signature, which exists for a dual number only."""
        return signature(args[0], args[0]) if len(args) == 1 and isinstance(args[0], Dual) else None


@lower_builtin(operator.neg, Dual)  # type: ignore[untyped-decorator]
def negative(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    """Return -x."""
    value, tangents = split(context, builder, sig.args[0], args[0])
    return joined(context, builder, sig.return_type, builder.fneg(value), builder.fneg(tangents))


@lower_cast(types.Float, Dual)  # type: ignore[untyped-decorator]
@lower_cast(types.Integer, Dual)  # type: ignore[untyped-decorator]
def cast(context: Any, builder: Any, fromty: Any, toty: Dual, val: Any) -> Any:
    """Return a real number as a dual one."""
    return joined(context, builder, toty, context.cast(builder, val, fromty, types.float64), constant(toty.k, 0.0))
