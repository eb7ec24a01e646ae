"""Calls of Python code from outside: they are timed, ended if they take too long, and their errors are reported."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.errors import BadInput, Overdue, RunFailed, in_words
from daebench.methods.outside.limit import Alarm, Limit
from daebench.methods.solvers.stopped import Stopped
from daebench.runs.external_state import external_state
from daebench.runs.state import STATES

Array = NDArray[np.float64]

Guard = Callable[[], AbstractContextManager[None]]
"""Turns what goes wrong in a file of the user's own into a :class:`RunFailed` that names its line."""


STATE_OF = {len(state.vectors): state for state in STATES.values()}
"""States by their number of vectors, by which a callable is called."""


class Code:
    """A callable as it is called in one run."""

    def __init__(self, name: str, fresh: Callable[[], Callable[..., Any]], guard: Guard, limit: Limit, *, cpu: bool = False) -> None:
        self.name, self.guard, self.limit, self.cpu = name, guard, limit, cpu
        self.alarm = Alarm(Code._armed.__code__)
        with self.limited():
            self.callable, _ = self._timed(fresh)

    def limited(self) -> AbstractContextManager[None]:
        """Return a context in which a call that takes too long is ended."""
        return self.alarm.after(self.limit.left)

    def step(self, vectors: Sequence[Array], h: float) -> tuple[list[Array], float]:
        """Return the state after a step, and the seconds that the code took for it.

        The callable is given copies, and must leave them as they are. Stopped is raised where it raises something or the time is over,
        BadInput where it returns no state.
        """
        if not self.limit.left:
            raise Stopped(self.limit.over)
        given, state = [vector.copy() for vector in vectors], STATE_OF[len(vectors)]
        result, seconds = self._timed(self.callable, *given, h)
        call = f"{self.name}: step({state.arguments}, h)"
        if any(a.tobytes() != b.tobytes() for a, b in zip(given, vectors, strict=True)):
            raise BadInput(f"{call} changes its arguments; return new arrays, and do not change the given ones.")
        return external_state(result, [vector.shape for vector in vectors], f"{call} must return {state.listed}"), seconds

    def solve(self, vectors: Sequence[Array], h: float, t: Array) -> tuple[list[Array], float]:
        """Return the states of a whole run at the times t, shape(k, ...) each, and the seconds that the code took for it."""
        result, seconds = self._timed(self.callable, *(vector.copy() for vector in vectors), h, t)
        state = STATE_OF[len(vectors)]
        duty = f"{self.name}: solve({state.arguments}, h, t) must return {state.listed} at the {len(t)} times t"
        return external_state(result, [(len(t), len(vector)) for vector in vectors], duty), seconds

    def of_complex(self, vectors: Sequence[Any], h: float) -> Any:
        """Return the state after one step from complex vectors; errors of the code are raised as they are, for it need not take them."""
        with self.guard():  # for what the code prints, not for what it raises
            try:
                return self._armed(self.callable, *(vector.copy() for vector in vectors), h)[0]
            except Exception as error:  # noqa: BLE001 - raised below
                raised = error
        raise raised

    def _timed(self, function: Callable[..., Any], *arguments: Any) -> tuple[Any, float]:
        with self._named():
            return self._armed(function, *arguments)

    def _armed(self, function: Callable[..., Any], *arguments: Any) -> tuple[Any, float]:
        clock = time.process_time if self.cpu else time.perf_counter
        began = clock()
        try:
            self.alarm.armed = True
            result = function(*arguments)
            return result, clock() - began
        except Overdue as overdue:
            self.alarm.armed = False
            raise RunFailed(self.limit.over).with_traceback(overdue.__traceback__) from None
        finally:
            self.alarm.armed = False

    @contextmanager
    def _named(self) -> Iterator[None]:
        """Report an error in the code as the reason for which a run stopped."""
        try:
            with self.guard():
                yield
        except RunFailed as error:
            raise Stopped(str(error)) from error
        except (Exception, SystemExit) as error:
            raise Stopped(f"the code raises {in_words(error)}") from error


def stepped(
    code: Code, vectors: Sequence[Array], h: float, most: int, seconds: float, keep: Callable[[Array], None]
) -> tuple[Sequence[Array], float, BaseException | None]:
    """Take so many steps, or as many as are taken in so many seconds of wall time; the last one may have numbers that are not finite.

    ``keep`` is called with each state, p and q or y in one vector. Returned are the last state, the time that the code took, and what
    ended the steps early; it is to be raised when the states before it are kept.
    """
    took, until = 0.0, time.perf_counter() + seconds
    with code.limited():
        try:
            for _ in range(most):
                vectors, one = code.step(vectors, h)
                row = np.concatenate(vectors)
                keep(row)
                took += one
                if time.perf_counter() > until or not np.isfinite(row).all():
                    break
        except (Stopped, BadInput, KeyboardInterrupt) as error:
            return vectors, took, error
    return vectors, took, None
