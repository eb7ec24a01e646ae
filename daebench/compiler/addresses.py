"""Functions of addresses that generated code has, see :mod:`daebench.compiler.trace.foreign`: declared for code that is read as text."""

from typing import Any


def carray(numbers: Any, shape: Any) -> Any:
    """Return an array of the numbers at an address."""
    raise NotImplementedError


def real_pointer(address: Any) -> Any:
    """Return an address as that of doubles."""
    raise NotImplementedError


def word_pointer(address: Any) -> Any:
    """Return an address as that of words, which are addresses or indices."""
    raise NotImplementedError


def numbers_of_vector(user: Any, vector: Any) -> Any:
    """Return the numbers of a vector of SUNDIALS, from the function whose address is first in the memory of callbacks."""
    raise NotImplementedError


def ida_solve(address: Any, mem: Any, t_end: float, t: Any, y: Any, yp: Any, task: int) -> int:
    """Call ``int IDASolve(void *mem, double t_end, double *t, N_Vector y, N_Vector yp, int task)``."""
    raise NotImplementedError


def cvode_solve(address: Any, mem: Any, t_end: float, y: Any, t: Any, task: int) -> int:
    """Call ``int CVode(void *mem, double t_end, N_Vector y, double *t, int task)``."""
    raise NotImplementedError


def interpolate(address: Any, mem: Any, t: float, order: int, y: Any) -> int:
    """Call ``int IDAGetDky(void *mem, double t, int order, N_Vector y)``, or that of CVODE."""
    raise NotImplementedError


def ask(address: Any, mem: Any, place: Any) -> int:
    """Call ``int IDAGetLastStep(void *mem, double *h)``, or another function that returns one property of a solver."""
    raise NotImplementedError


def look(address: Any, t: float, y: Any, user: Any) -> int:
    """Call ``int look(double t, double *y, void *user)``."""
    raise NotImplementedError
