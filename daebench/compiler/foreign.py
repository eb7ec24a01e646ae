"""Calls of C functions by address, for generated modules: no symbol is looked up, so none has to be declared first."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

POINTER, REAL, INTEGER = types.uintp, types.float64, types.int32


def _call(result: Any, *arguments: Any) -> Any:
    """Return the lowering of a call of a C function with this result and these arguments; pointers are addresses."""

    def codegen(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        address, *given = values
        function = ir.FunctionType(context.get_value_type(result), [context.get_value_type(each) for each in arguments])
        return builder.call(builder.inttoptr(address, function.as_pointer()), given)

    return result(POINTER, *arguments), codegen


def _pointer(kind: Any) -> Any:
    """Return the lowering of an address as a pointer to numbers of a kind."""

    def codegen(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return builder.inttoptr(values[0], context.get_value_type(signature.return_type))

    return types.CPointer(kind)(POINTER), codegen


@intrinsic  # type: ignore[untyped-decorator]
def real_pointer(typing: Any, address: Any) -> Any:
    """Return an address as a pointer to doubles."""
    return _pointer(types.float64)


@intrinsic  # type: ignore[untyped-decorator]
def word_pointer(typing: Any, address: Any) -> Any:
    """Return an address as a pointer to words, which are addresses or indices."""
    return _pointer(types.uintp)


@intrinsic  # type: ignore[untyped-decorator]
def call1(typing: Any, address: Any, par: Any, y: Any, h: Any) -> Any:
    """Call ``int step(const double *par, double *y, double h)``."""
    return _call(INTEGER, POINTER, POINTER, REAL)


@intrinsic  # type: ignore[untyped-decorator]
def call2(typing: Any, address: Any, par: Any, p: Any, q: Any, h: Any) -> Any:
    """Call ``int step(const double *par, double *p, double *q, double h)``."""
    return _call(INTEGER, POINTER, POINTER, POINTER, REAL)


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


@intrinsic  # type: ignore[untyped-decorator]
def ida_solve(typing: Any, address: Any, mem: Any, t_end: Any, t: Any, y: Any, yp: Any, task: Any) -> Any:
    """Call ``int IDASolve(void *mem, double t_end, double *t, N_Vector y, N_Vector yp, int task)``."""
    return _call(INTEGER, POINTER, REAL, POINTER, POINTER, POINTER, INTEGER)


@intrinsic  # type: ignore[untyped-decorator]
def cvode_solve(typing: Any, address: Any, mem: Any, t_end: Any, y: Any, t: Any, task: Any) -> Any:
    """Call ``int CVode(void *mem, double t_end, N_Vector y, double *t, int task)``."""
    return _call(INTEGER, POINTER, REAL, POINTER, POINTER, INTEGER)


@intrinsic  # type: ignore[untyped-decorator]
def interpolate(typing: Any, address: Any, mem: Any, t: Any, order: Any, y: Any) -> Any:
    """Call ``int IDAGetDky(void *mem, double t, int order, N_Vector y)``, or that of CVODE."""
    return _call(INTEGER, POINTER, REAL, INTEGER, POINTER)


@intrinsic  # type: ignore[untyped-decorator]
def ask(typing: Any, address: Any, mem: Any, place: Any) -> Any:
    """Call ``int IDAGetLastStep(void *mem, double *h)``, or another function that returns one property of a solver."""
    return _call(INTEGER, POINTER, POINTER)


@intrinsic  # type: ignore[untyped-decorator]
def look(typing: Any, address: Any, t: Any, y: Any, user: Any) -> Any:
    """Call ``int look(double t, double *y, void *user)``."""
    return _call(INTEGER, REAL, POINTER, POINTER)
