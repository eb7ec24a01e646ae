"""How generated modules are compiled: functions of the same text once a process, and without looking for garbage meanwhile."""

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FunctionType
from typing import Any

_MADE: dict[str, Any] = {}


def shared(text: str, *, inlined: bool = False) -> Callable[[Callable[..., Any]], Any]:
    """Return the decorator of a function that only other functions of generated modules call.

    Modules of one problem, or of one scheme, have most of their functions in common. Those of the same text are one function here, which
    numba compiles for a type when it is first called; what calls it has it inlined as before.

    To numba it is a function of this file, under a name that has the hash in it: machine code on disk names the module of each function
    that is in it, to be imported by a process that may never have seen it, and no two functions may ever have the same name.

    Parameters
    ----------
    text : str
        Hash of its text, of the texts of all that it calls, and of the constants that it reads.
    inlined : bool
        Whether it is put into what calls it, however long it is: of dual numbers calls cost more than what is computed.
    """
    from numba import njit

    def made(function: Any) -> Any:
        key = f"{text}_inlined" if inlined else text
        if key not in _MADE:
            name = f"{function.__name__}_{key}"
            clone = FunctionType(function.__code__, {**function.__globals__, "__name__": __name__}, name)
            clone.__module__, clone.__qualname__ = __name__, name
            options = {"forceinline": True} if inlined else {}
            _MADE[key] = njit(error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True, **options)(clone)
        return _MADE[key]

    return made


@contextmanager
def uncollected() -> Iterator[None]:
    """Collect no garbage in a block that may compile: to look through all objects that a compiler makes takes a tenth of its time."""
    collecting = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collecting:
            gc.enable()
