"""Common part of IDA and CVODE: driving the solver to an output time, the meaning of its status, and keeping it quiet."""

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, TextIO

import numpy as np

from daebench.methods.solvers.drive import MOST_STEPS, Advance, one_by_one
from daebench.methods.solvers.monitor import Monitor, Stopped

REASONS = {
    -1: f"{MOST_STEPS} steps were not enough to reach the next output",
    -2: "the tolerance is too small for double precision",
    -3: "the local error test failed too often, or with the smallest step",
    -4: "Newton's iteration failed too often, or with the smallest step",
    -31: "the projection onto the constraints failed too often, or with the smallest step",
    -22: "SUNDIALS says that one of its inputs is invalid",
}


def stepwise(solver: Any, monitor: Monitor, back: Any = ...) -> Advance:
    """Return how a solver object of scikit-sundae, after ``init_step``, is advanced from output to output.

    It keeps its step size, order and history between outputs, and never steps beyond the end. The first step is taken towards
    the end of the run: SUNDIALS chooses its size by the distance to the time that it is asked for, and no output shall decide that.
    ``back`` puts unknowns into the order of the blocks.
    """

    def call(t: float, method: str) -> Any:
        try:
            with quiet():
                result = solver.step(t, method, monitor.t_end)
        except RuntimeError as error:
            raise Stopped(f"SUNDIALS refuses to go on ({error})") from error
        if result.status < 0:
            raise Stopped(REASONS.get(result.status, str(result.message).rstrip(".")), float(result.t) if monitor.steps else 0.0)
        return result

    def advance(t: float) -> Any:
        if monitor.steps == 0:
            monitor.target = monitor.t_end
            call(monitor.t_end, "onestep")
        monitor.target = t
        result = call(t, "normal")
        if abs(result.t - t) > 1e-12 * monitor.t_end:
            raise Stopped(f"SUNDIALS returned before the output at t = {t:.9g}", float(result.t))
        if not np.all(np.isfinite(result.y)):
            raise Stopped(f"a value is no longer finite at t = {t:.9g}")
        return result.y[back]

    return one_by_one(advance, monitor)


def count_steps(monitor: Monitor, t: float, y: Any) -> None:
    """Count a step from the root function of the solver, which is called at the start, after each step and at each output."""
    if t > 0.0 and (t != monitor.target or t == monitor.t_end):
        monitor.stepped(t, y)


class _Hush:
    """Stands in for standard output while any thread is in a solver, and drops what those threads write."""

    def __init__(self) -> None:
        self.lock, self.local, self.inside = threading.Lock(), threading.local(), 0
        self.real: TextIO = sys.stdout

    def write(self, text: str) -> int:
        return len(text) if getattr(self.local, "on", False) else self.real.write(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.real, name)


_hush = _Hush()


@contextmanager
def quiet() -> Iterator[None]:
    """Drop the output of this thread: scikit-sundae prints SUNDIALS' error messages, which would spoil output that is data."""
    with _hush.lock:
        if not _hush.inside:
            _hush.real, sys.stdout = sys.stdout, _hush
        _hush.inside += 1
    _hush.local.on = True
    try:
        yield
    finally:
        _hush.local.on = False
        with _hush.lock:
            _hush.inside -= 1
            if not _hush.inside:
                sys.stdout = _hush.real
