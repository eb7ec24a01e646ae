"""Work that is put off until this process would wait for others: figures of one page are drawn while the next page is computed.

They are never drawn where something is timed, because only what waits for other processes calls :func:`meanwhile`.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

Work = Callable[[], object]

_WAITING: ContextVar[list[Work] | None] = ContextVar("waiting", default=None)


@contextmanager
def putting_off() -> Iterator[list[Work]]:
    """Put off what is given to :func:`later` in this block, and do what is left when it ends, however that is; yield what waits."""
    waiting: list[Work] = []
    token = _WAITING.set(waiting)
    try:
        yield waiting
    finally:
        try:
            meanwhile()
        finally:
            _WAITING.reset(token)


@contextmanager
def at_once() -> Iterator[None]:
    """Put nothing off in this block."""
    token = _WAITING.set(None)
    try:
        yield
    finally:
        _WAITING.reset(token)


def later(work: Work) -> None:
    """Do some work when this process would wait for others, or at once where nothing is put off."""
    waiting = _WAITING.get()
    if waiting is None:
        work()
    else:
        waiting.append(work)


def meanwhile() -> None:
    """Do what was put off, in this process, which would wait for others otherwise."""
    waiting = _WAITING.get()
    while waiting:
        waiting.pop(0)()
