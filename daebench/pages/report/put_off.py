"""Work that is put off until this process would wait for others: figures of one page are drawn while the next page is computed.

They are never drawn where something is timed, because only what waits for other processes calls :func:`meanwhile`.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Any

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
        How long others waited for what was put off and is done.
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


def meanwhile(awaited: Sequence[Future[Any]] = ()) -> None:
    """Do what was put off, in this process, which would wait for others otherwise.

    Parameters
    ----------
    awaited : sequence of Future
        What it would wait for: what is spare is begun only before all of that is done, and only what is done later is time of others, see
        :func:`clock`. Without it, everything is done and is time of others.
    """
    waiting = _WAITING.get()
    if waiting is None:
        return
    ended = [time.perf_counter()]
    for future in awaited:
        future.add_done_callback(lambda _: ended.append(time.perf_counter()))
    try:
        while left := waiting.works or (waiting.spare if not awaited or len(ended) <= len(awaited) else []):
            left.pop(0)()
    finally:
        if len(ended) > len(awaited):
            waiting.seconds += time.perf_counter() - max(ended)


def clock() -> float:
    """Return the time, s, on a clock that stands still while one's own work waits for what others put off."""
    waiting = _WAITING.get()
    return time.perf_counter() - (waiting.seconds if waiting else 0.0)
