"""Work that is put off until this process would wait for others: figures of one page, and lessons, while the next page is computed.

None of it is done where something is timed, because only what waits for other processes calls :func:`meanwhile`.
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
    """Work that waits."""

    works: list[Work] = field(default_factory=list)
    """What is left to do, in order."""
    spare: list[Work] = field(default_factory=list)
    """What is done when nothing else is left, and not at all after an interruption: nothing of it has been begun."""
    seconds: float = 0.0
    """How long others waited for what was put off and is done."""


_WAITING: ContextVar[Waiting | None] = ContextVar("waiting", default=None)


@contextmanager
def putting_off() -> Iterator[Waiting]:
    """Put off the work given to :func:`later` in this block, and do the rest when it ends, however that is; yield the waiting work."""
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
    """Do the work that was put off, in this process, which would wait for others otherwise."""
    waiting = _WAITING.get()
    if waiting is None:
        return
    began, ends = time.perf_counter(), list[float]()
    for future in awaited:
        future.add_done_callback(lambda _: ends.append(time.perf_counter()))
    try:
        while waiting.works or (waiting.spare and not (awaited and len(ends) == len(awaited))):
            (waiting.works or waiting.spare).pop(0)()
    finally:
        if len(ends) == len(awaited):
            waiting.seconds += time.perf_counter() - max([began, *ends])


def clock() -> float:
    """Return the time, s, on a clock that stands still while one's own work waits for what others put off."""
    waiting = _WAITING.get()
    return time.perf_counter() - (waiting.seconds if waiting else 0.0)
