"""SUNDIALS CVODE, Adams or BDF, on the index-reduced ODE."""

import time

import numpy as np

from daebench.methods.formulations.constrained import Posed
from daebench.methods.solvers.drive import MOST_STEPS, Advance, Array
from daebench.methods.solvers.error_test import of_declared_unknowns
from daebench.methods.solvers.monitor import Monitor
from daebench.methods.solvers.reduced import OnReducedOde
from daebench.methods.solvers.sundials import count_steps, stepwise
from daebench.methods.solvers.variants import CVODE


class Cvode(OnReducedOde):
    """CVODE, "adams" (orders 1 to 12) or "bdf" (orders 1 to 5), with a dense linear solver."""

    solver = "cvode"
    tells_steps = True
    variants = CVODE

    def _begin(self, dae: Posed, tol: float, monitor: Monitor) -> Advance:
        from daebench.methods.solvers.native import run as native  # llvmlite, which a list of methods does without

        family = native.BDF if self.variant == "bdf" else native.ADAMS
        rtol, atol = of_declared_unknowns(dae, tol, np.full(dae.n, tol))
        return native.begin(dae, family, rtol, atol, monitor) or self._called_from_python(dae, rtol, atol, monitor)

    def _called_from_python(self, dae: Posed, rtol: float, atol: Array, monitor: Monitor) -> Advance:
        """Return how CVODE is advanced by scikit-sundae, which calls Python functions."""
        from sksundae.cvode import CVODE

        def right_side(t: float, y: Array, yp: Array) -> None:
            began, y_[:] = time.perf_counter(), y
            monitor.called("rhs", t, rhs(t, y_, rates, par), began)
            yp[:] = rates

        def jacobian(t: float, y: Array, yp: Array, JJ: Array) -> None:
            began = time.perf_counter()
            monitor.called("jacobian", t, rhs_jacobian(t, y, JJ, par), began)

        def every_step(t: float, y: Array, events: Array) -> None:
            events[0] = 1.0
            count_steps(monitor, t, y)

        par, rhs, rhs_jacobian = dae.par, dae.rhs, dae.rhs_jacobian
        y_, rates = dae.y0.copy(), np.empty(dae.n)  # the same in all calls: addresses are asked for once
        rhs(0.0, y_, rates, par)  # compiled before the clock runs
        rhs_jacobian(0.0, dae.y0, np.empty((dae.n, dae.n)), par)
        events = {"eventsfn": every_step, "num_events": 1}
        solver = CVODE(right_side, method=self.variant, jacfn=jacobian, rtol=rtol, atol=atol, max_num_steps=MOST_STEPS, **events)
        solver.init_step(0.0, dae.y0)
        return stepwise(solver, monitor)
