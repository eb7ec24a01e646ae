"""SciPy's ODE solvers on the index-reduced ODE."""

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

from daebench.errors import Stopped
from daebench.methods.formulations.constrained import Posed
from daebench.methods.solvers.constrained_run import OnReducedOde
from daebench.methods.solvers.drive import MOST_STEPS, Advance, called, one_by_one
from daebench.methods.solvers.monitor import Monitor
from daebench.methods.solvers.variants import SCIPY
from daebench.systems.lazily import scipy


class ScipyOde(OnReducedOde):
    """A solver class of ``scipy.integrate``; its relative tolerance is at least 100 eps, to which SciPy would raise it silently."""

    solver = "scipy"
    variants = tuple(SCIPY)
    least = 100 * float(np.finfo(float).eps)

    @property
    def dense(self) -> bool:
        """Whether it solves with the whole Jacobian: an explicit method does not."""
        return SCIPY[self.variant]

    def _begin(self, dae: Posed, tol: float, monitor: Monitor) -> Advance:
        rates = called(dae, monitor, "rhs")
        options: dict[str, Any] = {"rtol": tol, "atol": tol}
        if self.dense:
            matrix = called(dae, monitor, "rhs_jacobian")
            options["jac"] = lambda t, y: matrix(t, y).copy()
        # Copies, because all calls return the same array, and SciPy keeps what it is given from step to step.
        solver = getattr(scipy.integrate, self.variant)(lambda t, y: rates(t, y).copy(), 0.0, dae.y0, monitor.t_end, **options)
        return stepwise(solver, monitor, "SciPy", lambda interpolant: interpolant)


def stepwise(solver: Any, monitor: Monitor, whose: str, states: Callable[[Any], Any]) -> Advance:
    """Return how a solver object is advanced from output to output, by its own steps and its interpolant."""
    between: Any = None

    def advance(t: float) -> Any:
        nonlocal between
        if solver.t < t:
            _march(solver, t, monitor, whose)
            between = states(solver.dense_output())
        y = solver.y.copy() if solver.t == t else between(t)
        if not np.all(np.isfinite(y)):
            raise Stopped(f"a value is no longer finite at t = {t:.9g}")
        return y

    return one_by_one(advance, monitor)


def _march(solver: Any, t: float, monitor: Monitor, whose: str) -> None:
    """Step until t is reached or passed."""
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")  # what goes wrong is told by the status
        while solver.t < t:
            message = solver.step()
            if solver.status == "failed":
                raise Stopped(f"{whose} says: {str(message).rstrip('.')}", float(solver.t))
            monitor.stepped(float(solver.t), solver.y)
            if monitor.steps >= MOST_STEPS:
                raise Stopped(f"{MOST_STEPS} steps were not enough")
