"""Interruptions that wait until they are asked for, so that what is under way is never torn."""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def held() -> Iterator[Callable[[], bool]]:
    """Give what tells whether Ctrl-C or SIGTERM came inside the block, where they do nothing else; only in the main thread."""
    came: list[int] = []
    old = {each: signal.signal(each, lambda number, _: came.append(number)) for each in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield lambda: bool(came)
    finally:
        for each, handler in old.items():
            signal.signal(each, handler)


@contextmanager
def alike() -> Iterator[None]:
    """Have SIGTERM end the block as Ctrl-C does, by :class:`KeyboardInterrupt`."""
    old = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, old)
