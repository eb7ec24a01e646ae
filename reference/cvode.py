"""SUNDIALS CVODE, Adams or BDF, on the index-reduced ODE."""

import time
from dataclasses import dataclass

import numpy as np

from daebench.errors import unknown
from daebench.method import Request
from daebench.pose import Dae, pose
from daebench.reference.meter import Meter
from daebench.reference.sundials import count_steps, stepwise
from daebench.reference.tolerance import MOST_STEPS, Advance, Array, check, run
from daebench.scene import Scene
from daebench.trajectory import Trajectory

VARIANTS = ("adams", "bdf")


@dataclass(frozen=True)
class Cvode:
    """CVODE on formulation ``ode``, HLW (1.18), with the analytic Jacobian and a dense linear solver.

    Parameters
    ----------
    variant : str
        "adams" (orders 1 to 12) or "bdf" (orders 1 to 5).

    Raises
    ------
    BadInput
        If the variant is unknown.
    """

    variant: str
    knob = "tol"

    def __post_init__(self) -> None:
        if self.variant not in VARIANTS:
            raise unknown("method of cvode", self.variant, VARIANTS)

    @property
    def name(self) -> str:
        """Name in the grammar of methods."""
        return f"cvode:{self.variant}"

    def refusal(self, scene: Scene) -> str | None:
        """Return None: every problem can be posed as an ODE."""
        return None

    def check(self, scene: Scene, request: Request) -> None:
        """Accept a request that can be met; raise :class:`BadInput` otherwise."""
        check(self.name, request)

    def solve(self, scene: Scene, request: Request) -> Trajectory:
        """Return the trajectory; where CVODE stops early, the outputs so far and why.

        Raises
        ------
        BadInput
            If the request cannot be met, see :func:`daebench.reference.tolerance.check`.
        DaebenchError
            If the start has no multiplier, see :func:`daebench.pose.pose`.
        """
        began = time.perf_counter()
        self.check(scene, request)
        dae = pose(scene, "ode")
        advice = "use a larger tol, and see whether G keeps its rank"
        return run(self.name, dae, request, lambda meter: self._begin(dae, request.value, meter), began=began, advice=advice)

    def _begin(self, dae: Dae, tol: float, meter: Meter) -> Advance:
        from sksundae.cvode import CVODE

        def right_side(t: float, y: Array, yp: Array) -> None:
            began = time.perf_counter()
            meter.called("rhs", t, rhs(t, y, yp, par), began)

        def jacobian(t: float, y: Array, yp: Array, JJ: Array) -> None:
            began = time.perf_counter()
            meter.called("jacobian", t, rhs_jacobian(t, y, JJ, par), began)

        def every_step(t: float, y: Array, events: Array) -> None:
            events[0] = 1.0
            count_steps(meter, t, y)

        par, rhs, rhs_jacobian = dae.par, dae.rhs, dae.rhs_jacobian
        y = dae.y0.copy()
        y.flags.writeable = False  # as CVODE's own are, which numba takes for another type
        rhs(0.0, y, np.empty(dae.n), par)
        rhs_jacobian(0.0, y, np.empty((dae.n, dae.n)), par)
        events = {"eventsfn": every_step, "num_events": 1}
        solver = CVODE(right_side, method=self.variant, jacfn=jacobian, rtol=tol, atol=tol, max_num_steps=MOST_STEPS, **events)
        solver.init_step(0.0, dae.y0)
        return stepwise(solver, meter)
