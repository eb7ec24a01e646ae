"""The end of code from outside: its limit of time, how Python code that exceeds it is ended, and the end of processes."""

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
import types
from collections.abc import Iterator

from daebench.errors import Overdue

if sys.platform == "linux":
    import fcntl

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
        for end in ends:
            fcntl.fcntl(end, fcntl.F_SETOWN, -process.pid)
            fcntl.fcntl(end, fcntl.F_SETSIG, signal.SIGKILL)
            fcntl.fcntl(end, fcntl.F_SETFL, fcntl.fcntl(end, fcntl.F_GETFL) | os.O_ASYNC)


SILENCE = 600.0
"""Seconds that code may go on without giving a state, where its run has no limit."""

AGAIN = 0.1
"""Seconds after which code is told once more that its time is over, where it has caught what told it so."""

SOON = 1e-3
"""Seconds until a timer goes off that should have gone off already: none at all would switch it off."""


class Limit:
    """A limit of wall-clock time, which begins to run when it is made."""

    def __init__(self, seconds: float | None, silence: float | None = None, over: str = "") -> None:
        self.seconds, self._silence, self._over = seconds, silence, over
        self._end = None if seconds is None else time.perf_counter() + seconds

    @property
    def left(self) -> float:
        """Seconds that code may still go on without giving a state."""
        if self._end is None:
            return SILENCE if self._silence is None else self._silence
        return max(0.0, self._end - time.perf_counter())

    @property
    def over(self) -> str:
        """The sentence on a limit of time that is over, with advice."""
        if self._over:
            return self._over
        if self.seconds is None:
            return f"the code has given no state for {SILENCE:g} s; check whether it hangs, or allow more time by seconds_limit"
        return f"the limit of {self.seconds:g} s is reached; allow more time, or check whether the code hangs"


class Alarm:
    """Ends Python code that goes on for too long, by an exception that is raised where the code is.

    That takes the main thread, and a system that has interval timers, as Windows has not; elsewhere, and within a function of C that does
    not return, code goes on. It is raised only while :attr:`armed`, and not in the function that calls the code, so that nothing of
    daebench itself is torn.
    """

    armed = False

    def __init__(self, caller: types.CodeType) -> None:
        self._caller = caller

    @contextlib.contextmanager
    def after(self, seconds: float) -> Iterator[None]:
        """Have the block ended after so many seconds; a timer that is set already goes on afterwards."""
        if not hasattr(signal, "setitimer") or threading.current_thread() is not threading.main_thread():
            yield
            return
        began, handler = time.monotonic(), signal.signal(signal.SIGALRM, self._ring)
        left, interval = signal.setitimer(signal.ITIMER_REAL, max(seconds, SOON), AGAIN)
        try:
            yield
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(signal.SIGALRM, handler or signal.SIG_DFL)
            if left:
                signal.setitimer(signal.ITIMER_REAL, max(left - (time.monotonic() - began), SOON), interval)

    def _ring(self, _: int, frame: types.FrameType | None) -> None:
        if self.armed and frame is not None and frame.f_code is not self._caller:
            raise Overdue
