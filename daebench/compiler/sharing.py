"""Compilation of generated modules: functions of equal text are compiled once per process, without garbage collection meanwhile."""

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FunctionType
from typing import Any

_MADE: dict[str, Any] = {}


def shared(text: str, *, inlined: bool = False, numeric: bool = False) -> Callable[[Callable[..., Any]], Any]:
    """Return the decorator of a function that only other functions of generated modules call.

    Modules of one problem, or of one scheme, have most of their functions in common. Functions of equal text are one function here, which
    numba compiles for a type when it is first called. LLVM inlines it into its callers as before.

    For numba it is a function of this file, under a name that contains the hash. Machine code on disk names the module of each function
    in it, to be imported by a process that may never have seen it, and no two functions may ever have the same name.

    Parameters
    ----------
    text : str
        Hash of its text, of the texts of all functions that it calls, and of the constants that it reads.
    inlined : bool
        Whether it is inlined into its callers regardless of its length: for dual numbers a call costs more than the computation.
    numeric : bool
        Whether it makes and returns no arrays: numba then does not count the references to them, and compiles in less time.
    """
    from daebench.compiler.linked_only import linked_only

    def made(function: Any) -> Any:
        key = text + "_inlined" * inlined + "_numeric" * numeric
        if key not in _MADE:
            name = f"{function.__name__}_{key}"
            clone = FunctionType(function.__code__, {**function.__globals__, "__name__": __name__}, name)
            clone.__module__, clone.__qualname__ = __name__, name
            _MADE[key] = linked_only(clone, forceinline=inlined, _nrt=not numeric)
        return _MADE[key]

    return made


@contextmanager
def uncollected() -> Iterator[None]:
    """Disable garbage collection in a block that may compile: scanning the objects that a compiler makes takes a tenth of its time."""
    collecting = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collecting:
            gc.enable()
