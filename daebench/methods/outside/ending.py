"""How a process that runs code from outside came to its end, and that it does come to it when daebench does."""

import contextlib
import os
import signal
import subprocess
import sys
from collections.abc import Iterator

HINTS = {"SIGKILL": ", as the system does where memory runs out"}
"""What else is to be said of a signal."""


def ending(status: int) -> str:
    """Return how a process ended, by its status."""
    if status >= 0:
        return f"exited with status {status}"
    try:
        name = signal.Signals(-status).name
    except ValueError:
        return f"was ended by signal {-status}"
    words = (signal.strsignal(-status) or "").lower()
    return f"was ended by signal {name} ({words}{HINTS.get(name, '')})"


def kill(process: subprocess.Popen[bytes] | subprocess.Popen[str]) -> None:
    """End a process with all that it has started, and wait until it has ended."""
    with contextlib.suppress(ProcessLookupError, PermissionError):
        if hasattr(os, "killpg"):
            os.killpg(process.pid, signal.SIGKILL)
        else:
            process.kill()
    process.wait()


@contextlib.contextmanager
def lifeline() -> Iterator[tuple[list[int], list[int]]]:
    """Yield the two ends of a pipe, the first to be inherited by a process that is started in the block; none but on Linux.

    The second is to be closed when the process has ended; with daebench, it is closed by the system.
    """
    if sys.platform != "linux":
        yield [], []
        return
    end, held = os.pipe()
    try:
        yield [end], [held]
    finally:
        os.close(end)


def tie(process: subprocess.Popen[bytes] | subprocess.Popen[str], ends: list[int]) -> None:
    """Have the system kill the group of a process once nobody holds the other end of its lifeline any more, whatever it is doing."""
    if sys.platform == "linux":
        import fcntl

        for end in ends:
            fcntl.fcntl(end, fcntl.F_SETOWN, -process.pid)
            fcntl.fcntl(end, fcntl.F_SETSIG, signal.SIGKILL)
            fcntl.fcntl(end, fcntl.F_SETFL, fcntl.fcntl(end, fcntl.F_GETFL) | os.O_ASYNC)
