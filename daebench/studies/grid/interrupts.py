"""Interruptions that wait for the end of what is under way, so that it is never torn."""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def held_back() -> Iterator[Callable[[], bool]]:
    """Hold back Ctrl-C and SIGTERM until the block has ended, and give what tells whether one came; only in the main thread.

    What is ignored outside is ignored inside.
    """
    came: list[int] = []
    old = {signum: signal.getsignal(signum) for signum in (signal.SIGINT, signal.SIGTERM)}
    for signum in old:
        if old[signum] is not signal.SIG_IGN:
            signal.signal(signum, lambda number, _: came.append(number))
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
