"""IDA and CVODE by scikit-sundae, which calls Python functions: for platforms without the libraries or machine code, and as an oracle."""

import io
import threading
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from typing import Any

import numpy as np

from daebench.errors import Stopped
from daebench.methods.formulations.chain import BandedDae
from daebench.methods.formulations.constrained import Posed
from daebench.methods.solvers.drive import MOST_STEPS, Advance, Array, called
from daebench.methods.solvers.monitor import Monitor
from daebench.systems.lazily import sksundae

REASONS = {
    -1: f"{MOST_STEPS} steps were not enough to reach the next output",
    -2: "the tolerance is too small for double precision",
    -3: "the local error test failed too often, or with the smallest step",
    -4: "Newton's iteration failed too often, or with the smallest step",
    -31: "the projection onto the constraints failed too often, or with the smallest step",
    -22: "SUNDIALS says that one of its inputs is invalid",
}


def ida(posed: Posed, tol: float, atol: Array, monitor: Monitor) -> Advance:
    """Return how IDA goes through output times; its Jacobian of a chain is a difference quotient in a band.

    Shapes: atol (n,).
    """
    order: Any = ...
    back: Any = ...
    evaluated = called(posed, monitor, "residual")

    def residual(t: float, y: Array, yp: Array, res: Array) -> None:
        res[:] = evaluated(t, y, yp)

    options: dict[str, Any] = {"rtol": tol, "max_num_steps": MOST_STEPS}
    if isinstance(posed, BandedDae):
        lower, upper = posed.band
        options |= {"linsolver": "band", "lband": lower, "uband": upper}
        order, back = posed.order, np.argsort(posed.order)
    else:
        matrix = called(posed, monitor, "jacobian")

        def jacobian(t: float, y: Array, yp: Array, res: Array, cj: float, JJ: Array) -> None:
            JJ[:] = matrix(t, y, yp, res, cj)

        options["jacfn"] = jacobian
    solver = sksundae.ida.IDA(residual, atol=atol[order], **options)
    solver.init_step(0.0, posed.y0[order], posed.yp0[order])
    return _Steps(solver, monitor, back).outputs


def cvode(posed: Posed, family: str, tol: float, atol: Array, monitor: Monitor) -> Advance:
    """Return how CVODE goes through output times, by the linear multistep methods of a family, "adams" or "bdf".

    Shapes: atol (n,).
    """
    rates, matrix = called(posed, monitor, "rhs"), called(posed, monitor, "rhs_jacobian")

    def right_side(t: float, y: Array, yp: Array) -> None:
        yp[:] = rates(t, y)

    def jacobian(t: float, y: Array, yp: Array, JJ: Array) -> None:
        JJ[:] = matrix(t, y)

    solver = sksundae.cvode.CVODE(right_side, method=family, jacfn=jacobian, rtol=tol, atol=atol, max_num_steps=MOST_STEPS)
    solver.init_step(0.0, posed.y0)
    return _Steps(solver, monitor).outputs


class _Steps:
    """A solver object of scikit-sundae, after ``init_step``, that goes through output times step by step.

    Each step is taken towards the end of the run: SUNDIALS chooses the first one by the distance to the time that it is asked for. ``back``
    puts unknowns into the order of the blocks.
    """

    def __init__(self, solver: Any, monitor: Monitor, back: Any = ...) -> None:
        self.solver, self.monitor, self.back = solver, monitor, back

    def outputs(self, times: Array) -> Iterator[Array]:
        """Yield the unknowns at these times: those within a step before the look at its end, and the last ones after it."""
        monitor, given, y = self.monitor, 0, self.monitor.y
        while monitor.t < times[-1]:
            t, y = self._step()
            while given < len(times) - 1 and times[given] <= t:
                yield monitor.output(self._advanced(float(times[given]), "normal")[1])
                given += 1
            monitor.stepped(t, y)
            if monitor.steps >= MOST_STEPS:
                raise Stopped(REASONS[-1])
        yield monitor.output(y)

    def _step(self) -> tuple[float, Array]:
        """Return time and unknowns after a step; after an output the solver first comes back to the end of the last one."""
        t, y = self._advanced(self.monitor.t_end, "onestep")
        return (t, y) if t != self.monitor.t else self._advanced(self.monitor.t_end, "onestep")

    def _advanced(self, t: float, manner: str) -> tuple[float, Array]:
        try:
            with _quiet():
                result = self.solver.step(t, manner, self.monitor.t_end)
        except RuntimeError as error:
            raise Stopped(f"SUNDIALS refuses to go on ({error})") from error
        if result.status < 0:
            raise Stopped(REASONS.get(result.status, str(result.message).rstrip(".")), float(result.t) if self.monitor.steps else 0.0)
        if not np.all(np.isfinite(result.y)):
            raise Stopped(f"a value is no longer finite at t = {result.t:.9g}")
        return float(result.t), result.y[self.back].copy()


_printing = threading.Lock()


@contextmanager
def _quiet() -> Iterator[None]:
    """Drop the output of the block: scikit-sundae prints SUNDIALS' error messages, which would spoil output that is data."""
    with _printing, redirect_stdout(io.StringIO()):
        yield
