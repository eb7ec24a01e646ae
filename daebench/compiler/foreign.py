"""Numbers at addresses, for generated modules of complex numbers, which numba compiles."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

POINTER = types.uintp


def _pointer(kind: Any) -> Any:
    """Return the lowering of an address as a pointer to numbers of a kind."""

    def codegen(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return builder.inttoptr(values[0], context.get_value_type(signature.return_type))

    return types.CPointer(kind)(POINTER), codegen


@intrinsic  # type: ignore[untyped-decorator]
def real_pointer(typing: Any, address: Any) -> Any:
    """Return an address as a pointer to doubles."""
    return _pointer(types.float64)


def _content(place: int) -> Any:
    """Return the lowering of a call of ``double *f(void *)``, whose address is at a given place in the memory of callbacks."""

    def codegen(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        user, container = values
        word, double = user.type, ir.DoubleType()
        address = builder.load(builder.gep(builder.inttoptr(user, word.as_pointer()), [ir.Constant(ir.IntType(64), place)]))
        function = ir.FunctionType(double.as_pointer(), [word])
        return builder.call(builder.inttoptr(address, function.as_pointer()), [container])

    return types.CPointer(types.float64)(POINTER, POINTER), codegen


@intrinsic  # type: ignore[untyped-decorator]
def numbers_of_vector(typing: Any, user: Any, vector: Any) -> Any:
    """Return a pointer to the numbers of a vector of SUNDIALS, from the function whose address is first in the memory."""
    return _content(0)


@intrinsic  # type: ignore[untyped-decorator]
def numbers_of_matrix(typing: Any, user: Any, matrix: Any) -> Any:
    """Return a pointer to the numbers of a matrix of SUNDIALS, from the function whose address is second in the memory."""
    return _content(1)
