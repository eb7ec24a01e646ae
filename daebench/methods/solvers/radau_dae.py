"""Radau IIA of order 5 by solve_dae, on index 2: a peer that takes the DAE itself."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from daebench.errors import unknown
from daebench.methods.formulations.constrained import Dae
from daebench.methods.solvers.drive import Advance, Array, called, not_installed
from daebench.methods.solvers.ida import Ida
from daebench.methods.solvers.monitor import Monitor
from daebench.methods.solvers.scipy_ode import ScipyOde, stepwise
from daebench.runs.ivp import ConstrainedIvp
from daebench.systems.lazily import solve_dae


@dataclass(frozen=True)
class RadauDae(Ida):
    """solve_dae's RadauDAE with the analytic Jacobian, on ``index2`` with multipliers as derivatives.

    On three problems at tolerances from 1e-3 to 1e-12 only this form reaches the end and follows the motion: with plain multipliers
    it soon stops, on ``ggl`` it stopped on double_pendulum at 1e-8 and 1e-9, and on ``index1`` it loses spherical_pendulum at 1e-3.
    """

    tells_steps: ClassVar = False
    formulation: str = "index2"
    least: ClassVar[float] = ScipyOde.least

    @classmethod
    def of(cls, variant: str) -> "RadauDae":
        """Return the method of this variant."""
        if variant != "Radau":
            raise unknown("method of solve_dae", variant, ["Radau"])
        return cls()

    @property
    def name(self) -> str:
        """Name in the grammar of methods."""
        return "solve_dae:Radau"

    def refusal(self, ivp: ConstrainedIvp) -> str | None:
        """Return why it cannot be used, as a sentence, or None: solve_dae is not installed, or a long chain has too large a Jacobian."""
        if missing := not_installed(self.name):
            return missing
        if ivp.arrays:
            return f"{self.name} solves with the whole Jacobian, which is too large for the nodes of {ivp.problem}; use ida:index1."
        return super().refusal(ivp)

    def _begin(self, dae: Dae, tol: float, monitor: Monitor) -> Advance:
        evaluated, matrix, res = called(dae, monitor, "residual"), called(dae, monitor, "jacobian"), np.empty(dae.n)

        def residual(t: float, y: Array, yp: Array) -> Array:
            # All calls return the same array, and the solver keeps some of its values.
            return evaluated(t, y, yp).copy()

        def jacobian(t: float, y: Array, yp: Array) -> tuple[Array, Array]:
            of_y = matrix(t, y, yp, res, 0.0).copy()
            return of_y, matrix(t, y, yp, res, 1.0) - of_y

        solver = solve_dae.integrate.RadauDAE(residual, 0.0, dae.y0, dae.yp0, monitor.t_end, rtol=tol, atol=tol, jac=jacobian)
        return stepwise(solver, monitor, "solve_dae", lambda interpolant: lambda t: interpolant(t)[0])
