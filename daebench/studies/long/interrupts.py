"""Interruptions that wait for the end of what is under way, so that it is never torn."""

import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

PATIENCE = 2.0
"""Seconds after which what is under way is taken to hang, where somebody interrupts it again."""


@contextmanager
def held_back() -> Iterator[Callable[[], bool]]:
    """Hold back Ctrl-C and SIGTERM until the block has ended, and give what tells whether one came; only in the main thread.

    What is ignored outside is ignored inside. What does not end is ended by another one that comes :data:`PATIENCE` later.
    """
    came: list[int] = []
    times: list[float] = []

    def hold(number: int, _: Any) -> None:
        came.append(number)
        times.append(time.monotonic())
        if times[-1] - times[0] > PATIENCE:
            raise KeyboardInterrupt

    old = {signum: signal.getsignal(signum) for signum in (signal.SIGINT, signal.SIGTERM)}
    for signum in old:
        if old[signum] is not signal.SIG_IGN:
            signal.signal(signum, hold)
    try:
        yield lambda: bool(came)
    finally:
        for signum, handler in old.items():
            signal.signal(signum, handler)
        if came:
            signal.raise_signal(signal.Signals(came[0]))


@contextmanager
def terminated_as_interrupted() -> Iterator[None]:
    """Have SIGTERM end the block as Ctrl-C does, by :class:`KeyboardInterrupt`."""
    old = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, old)
