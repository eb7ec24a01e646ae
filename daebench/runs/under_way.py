"""What takes long before a run begins, for progress that is shown beside it."""

from collections.abc import Iterator
from contextlib import contextmanager

_compiled: list[str] = []


@contextmanager
def compiling(name: str, problem: str) -> Iterator[None]:
    """Have progress say that a method is compiled for a problem, in this context."""
    words = f"compiling {name} for {problem}"
    _compiled.append(words)
    try:
        yield
    finally:
        _compiled.remove(words)


def under_way() -> str:
    """Return what is compiled now, "" where nothing is."""
    return _compiled[-1] if _compiled else ""
