"""SciPy's ODE solvers on the index-reduced ODE."""

import time
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np

from daebench.errors import unknown
from daebench.method import Request
from daebench.pose import Dae, pose
from daebench.reference.meter import Meter, Stopped
from daebench.reference.tolerance import MOST_STEPS, Advance, Array, check, run
from daebench.scene import Scene
from daebench.trajectory import Trajectory

IMPLICIT = {"RK23": False, "RK45": False, "DOP853": False, "Radau": True, "BDF": True, "LSODA": True}
"""SciPy's methods, and whether they use the Jacobian."""

LEAST = 100 * float(np.finfo(float).eps)
"""SciPy silently raises smaller relative tolerances to this."""


@dataclass(frozen=True)
class ScipyOde:
    """A solver class of ``scipy.integrate`` on formulation ``ode``, HLW (1.18); implicit ones are given the analytic Jacobian.

    Parameters
    ----------
    variant : str
        "RK23", "RK45", "DOP853", "Radau", "BDF" or "LSODA".

    Raises
    ------
    BadInput
        If the variant is unknown.
    """

    variant: str
    knob = "tol"

    def __post_init__(self) -> None:
        if self.variant not in IMPLICIT:
            raise unknown("method of scipy", self.variant, IMPLICIT)

    @property
    def name(self) -> str:
        """Name in the grammar of methods."""
        return f"scipy:{self.variant}"

    def refusal(self, scene: Scene) -> str | None:
        """Return None: every problem can be posed as an ODE."""
        return None

    def check(self, scene: Scene, request: Request) -> None:
        """Accept a request that can be met; raise :class:`BadInput` otherwise."""
        check(self.name, request, LEAST)

    def solve(self, scene: Scene, request: Request) -> Trajectory:
        """Return the trajectory; where the solver stops early, the outputs so far and why.

        Raises
        ------
        BadInput
            If tol is below 2.22e-14 or the request cannot be met otherwise, see :func:`daebench.reference.tolerance.check`.
        DaebenchError
            If the start has no multiplier, see :func:`daebench.pose.pose`.
        """
        began = time.perf_counter()
        self.check(scene, request)
        dae = pose(scene, "ode")
        advice = "use a larger tol, and see whether G keeps its rank"
        return run(self.name, dae, request, lambda meter: self._begin(dae, request.value, meter), began=began, advice=advice)

    def _begin(self, dae: Dae, tol: float, meter: Meter) -> Advance:
        from scipy import integrate

        def right_side(t: float, y: Array) -> Array:
            began, out = time.perf_counter(), np.empty(dae.n)
            meter.called("rhs", t, rhs(t, np.array(y), out, par), began)
            return out

        def jacobian(t: float, y: Array) -> Array:
            began, JJ = time.perf_counter(), np.empty((dae.n, dae.n))
            meter.called("jacobian", t, rhs_jacobian(t, np.array(y), JJ, par), began)
            return JJ

        par, rhs, rhs_jacobian = dae.par, dae.rhs, dae.rhs_jacobian
        rhs(0.0, dae.y0, np.empty(dae.n), par)
        options: dict[str, Any] = {"rtol": tol, "atol": tol}
        if IMPLICIT[self.variant]:
            rhs_jacobian(0.0, dae.y0, np.empty((dae.n, dae.n)), par)
            options["jac"] = jacobian
        solver = getattr(integrate, self.variant)(right_side, 0.0, dae.y0, meter.t_end, **options)
        return _stepwise(solver, meter)


def _stepwise(solver: Any, meter: Meter) -> Advance:
    """Return how a solver object of SciPy is advanced from output to output, by its own steps and its interpolant."""
    between: Any = None

    def advance(t: float) -> Any:
        nonlocal between
        if solver.t < t:
            _march(solver, t, meter)
            between = solver.dense_output()
        y = solver.y.copy() if solver.t == t else between(t)
        if not np.all(np.isfinite(y)):
            raise Stopped(f"a value is no longer finite at t = {t:.9g}")
        return y

    return advance


def _march(solver: Any, t: float, meter: Meter) -> None:
    """Step until t is reached or passed."""
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")  # what goes wrong is told by the status
        while solver.t < t:
            message = solver.step()
            if solver.status == "failed":
                raise Stopped(f"SciPy says: {str(message).rstrip('.')}", float(solver.t))
            meter.stepped(float(solver.t), solver.y)
            if meter.steps >= MOST_STEPS:
                raise Stopped(f"{MOST_STEPS} steps were not enough")
