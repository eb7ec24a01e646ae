"""The module that is being compiled, for progress that is shown meanwhile; garbage collection waits until it is done."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager

_compiled: list[str] = []


@contextmanager
def compiling(what: str) -> Iterator[None]:
    """Have progress say that something is compiled, in this context; where others are inside of it, the outermost counts."""
    _compiled.append(what)
    try:
        yield
    finally:
        _compiled.pop()


def under_way() -> str:
    """Return a phrase on the module that is compiled now, "" where none is."""
    return f"compiling {_compiled[0]}" if _compiled else ""


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
