"""Work that is put off until this process would wait for others: figures of one page are drawn while the next page is computed.

They are never drawn where something is timed, because only what waits for other processes calls :func:`meanwhile`.
"""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field

Work = Callable[[], object]


@dataclass
class Waiting:
    """What waits.

    Parameters
    ----------
    works : list of callable
        What is left to do, in order.
    spare : list of callable
        What is done when nothing else is left, and not at all after an interruption: nothing of it has been begun.
    seconds : float
        How long took what was put off and is done.
    """

    works: list[Work] = field(default_factory=list)
    spare: list[Work] = field(default_factory=list)
    seconds: float = 0.0


_WAITING: ContextVar[Waiting | None] = ContextVar("waiting", default=None)


@contextmanager
def putting_off() -> Iterator[Waiting]:
    """Put off what is given to :func:`later` in this block, and do what is left when it ends, however that is; yield what waits."""
    waiting = Waiting()
    token = _WAITING.set(waiting)
    try:
        yield waiting
        meanwhile()
    finally:
        waiting.spare.clear()
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
        waiting.works.append(work)


def meanwhile() -> None:
    """Do what was put off, in this process, which would wait for others otherwise."""
    waiting = _WAITING.get()
    if waiting is None:
        return
    began = time.perf_counter()
    try:
        while left := waiting.works or waiting.spare:
            left.pop(0)()
    finally:
        waiting.seconds += time.perf_counter() - began


def clock() -> float:
    """Return the time, s, on a clock that stands still while something is done that was put off: what is measured with it is one's own."""
    waiting = _WAITING.get()
    return time.perf_counter() - (waiting.seconds if waiting else 0.0)
