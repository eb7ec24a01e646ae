"""The wall-clock limit of code from outside, and the ways to end code that exceeds it."""

import contextlib
import queue
import signal
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from types import CodeType, FrameType
from typing import Any

from daebench.errors import Overdue
from daebench.methods.solvers.monitor import Stopped

SILENCE = 600.0
"""Seconds that code may go on without giving a state, where its run has no limit."""

AGAIN = 0.1
"""Seconds after which code is told once more that its time is over, where it has caught what told it so."""

SOON = 1e-3
"""Seconds until a timer goes off that should have gone off already: none at all would switch it off."""


class Limit:
    """A limit of wall-clock time, which begins to run when it is made.

    Parameters
    ----------
    seconds : float, optional
        That of the run, s; by default there is none, and code may go on for :data:`SILENCE` without giving a state.
    """

    def __init__(self, seconds: float | None) -> None:
        self.seconds = seconds
        self._end = None if seconds is None else time.perf_counter() + seconds

    @property
    def left(self) -> float:
        """Seconds that code may still go on without giving a state."""
        return SILENCE if self._end is None else max(0.0, self._end - time.perf_counter())

    @property
    def over(self) -> str:
        """What is said when the time is over, and what to do."""
        if self.seconds is None:
            return f"the code has given no state for {SILENCE:g} s; check whether it hangs, or allow more time by seconds_limit"
        return f"the limit of {self.seconds:g} s is reached; allow more time, or check whether the code hangs"


class Alarm:
    """Ends Python code that goes on for too long, by an exception that is raised where the code is.

    That takes the main thread, and a system that has interval timers, as Windows has not; elsewhere, and within a function of C that does
    not return, code goes on. It is raised only while :attr:`armed` and not in the function that calls the code, so that nothing of daebench
    itself is torn.

    Parameters
    ----------
    caller : code
        The function that calls the code.
    """

    def __init__(self, caller: CodeType) -> None:
        self.caller, self.armed = caller, False

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

    def _ring(self, _: int, frame: FrameType | None) -> None:
        if self.armed and not (frame and frame.f_code is self.caller):
            raise Overdue


class Worker:
    """A thread that makes calls one after another, so that one which does not return can be left."""

    def __init__(self) -> None:
        self._calls: queue.SimpleQueue[tuple[Future[Any], Callable[[], Any]] | None] = queue.SimpleQueue()
        threading.Thread(target=self._work, daemon=True).start()

    def __enter__(self) -> "Worker":
        return self

    def __exit__(self, *_: object) -> None:
        self._calls.put(None)

    def _work(self) -> None:
        for future, call in iter(self._calls.get, None):
            try:
                future.set_result(call())
            except BaseException as error:  # noqa: BLE001 - it is raised where the result is asked for
                future.set_exception(error)

    def result(self, call: Callable[[], Any], limit: Limit) -> Any:
        """Return what a call returns; raise :class:`Stopped` where it takes too long, and leave it."""
        future: Future[Any] = Future()
        self._calls.put((future, call))
        try:
            return future.result(limit.left)
        except TimeoutError:
            raise Stopped(limit.over) from None
