"""What takes long before a run begins, for progress that is shown beside it."""

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
    """Return what is compiled now, "" where nothing is."""
    return f"compiling {_compiled[0]}" if _compiled else ""
