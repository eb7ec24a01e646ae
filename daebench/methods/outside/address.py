"""Calls of C functions by their addresses, for generated modules: nothing is looked up by a name, so nothing has to be declared first."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic


def _step(vectors: int) -> Any:
    """Return the lowering of a call of ``int step(const double *par, double *state..., double h)``, all pointers as addresses."""
    arguments = (types.uintp, types.uintp, *[types.uintp] * vectors, types.float64)

    def codegen(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        address, *pointers, h = values
        word, real = address.type, ir.DoubleType()
        function = ir.FunctionType(ir.IntType(32), [*[word] * len(pointers), real])
        return builder.call(builder.inttoptr(address, function.as_pointer()), [*pointers, h])

    return types.int32(*arguments), codegen


@intrinsic  # type: ignore[untyped-decorator]
def call1(typing: Any, address: Any, par: Any, y: Any, h: Any) -> Any:
    """Call ``step(par, y, h)``."""
    return _step(1)


@intrinsic  # type: ignore[untyped-decorator]
def call2(typing: Any, address: Any, par: Any, p: Any, q: Any, h: Any) -> Any:
    """Call ``step(par, p, q, h)``."""
    return _step(2)
