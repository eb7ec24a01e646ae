"""SUNDIALS CVODE, BDF, on the index-reduced ODE, each step projected onto the constraints."""

from dataclasses import dataclass

import numpy as np

from daebench.errors import BadInput, unknown
from daebench.methods.formulations.constrained import Dae
from daebench.methods.solvers.drive import Advance, require_native
from daebench.methods.solvers.error_test import of_declared_unknowns
from daebench.methods.solvers.monitor import Monitor
from daebench.methods.solvers.reduced import OnReducedOde
from daebench.methods.solvers.variants import CVODE, PROJECTED
from daebench.runs.ivp import ConstrainedIvp
from daebench.runs.request import Request
from daebench.runs.scales import constrained_scales


@dataclass(frozen=True)
class ProjectedCvode(OnReducedOde):
    """CVODE's BDF, orders 1 to 5, whose steps end with a projection onto g = 0 and then onto G H_p = 0, both in the metric of M.

    The corrector's result is projected before the error test, and so is the estimate that is tested, by CVodeSetProjFn and
    CVodeSetProjErrEst. It is the ends of steps that are on the manifold to round-off; outputs between them are interpolated, and near to it
    by the tolerance.
    """

    solver = "cvode"
    tells_steps = True
    variants = (PROJECTED,)

    @classmethod
    def of(cls, family: str, manner: str) -> "ProjectedCvode":
        """Return the method of the names after "cvode:"."""
        if family not in CVODE:
            raise unknown("method of cvode", family, CVODE)
        if manner != "projected":
            raise unknown("treatment of cvode's steps", manner, ["projected"])
        if family != "bdf":
            raise BadInput(f"CVODE projects only steps of BDF, not of {family}; use cvode:{PROJECTED}, or leave out :projected.")
        return cls(PROJECTED)

    @property
    def combines(self) -> bool:
        """Whether it takes combinations of redundant constraints: it projects onto independent ones."""
        return True

    def check(self, ivp: ConstrainedIvp, request: Request) -> None:
        """Accept a request that can be met; raise :class:`BadInput` otherwise."""
        super().check(ivp, request)
        require_native(self.name, "has no way to project steps", request)
        if self.least_squares(ivp, request):
            raise BadInput(
                f"{self.name} projects onto independent constraints, and none is redundant everywhere here; for least-squares where G "
                f"loses rank on the way use cvode:bdf or a fixed-step method such as rattle."
            )

    def _begin(self, dae: Dae, tol: float, monitor: Monitor) -> Advance:
        from daebench.methods.solvers.native import run as native  # llvmlite, which a list of methods does without
        from daebench.methods.solvers.native.projection import projection

        length, _ = constrained_scales(dae.ivp, 0.0, rated=False)
        settings = native.Settings(projection=projection(dae).projection_callback, length=length)
        rtol, atol = of_declared_unknowns(dae, tol, np.full(dae.n, tol))
        advance = native.begin(dae, native.BDF, rtol, atol, monitor, settings)
        if advance is None:
            raise BadInput(f"{self.name} needs compiled callbacks, which {dae.ivp.problem} does not have here; use cvode:bdf.")
        return advance

    @property
    def _advice(self) -> str:
        return "use a larger tol or cvode:bdf, and see whether G keeps its rank"
