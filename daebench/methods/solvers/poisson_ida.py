"""SUNDIALS IDA on Poisson systems: as implicit residuals, and as DAEs that keep the Casimir functions."""

from dataclasses import dataclass
from typing import ClassVar

from daebench.methods.formulations.poisson import PoissonDae, pose_poisson, without_casimirs
from daebench.methods.formulations.table import POISSON_FORMULATIONS
from daebench.methods.solvers.drive import Advance
from daebench.methods.solvers.ida import begin
from daebench.methods.solvers.monitor import Monitor
from daebench.methods.solvers.multiplier_treatment import TreatedMultipliers
from daebench.methods.solvers.poisson_run import OnPoisson, refused
from daebench.runs.directions import require_tuples
from daebench.runs.ivp import InitialValueProblem, PoissonIvp
from daebench.runs.request import Request


@dataclass(frozen=True)
class PoissonIda(TreatedMultipliers, OnPoisson):
    """IDA on a Poisson system, with the analytic Jacobian and a dense linear solver.

    The multipliers of ``casimirs`` are zero along the motion and nothing but the numerical error drives them, and yet they spoil the
    error test: without a treatment IDA stops at the start at tolerances of 1e-10 and less, and takes 400 times as many steps at 1e-6.
    Two treatments, as for constrained problems, of which the second takes fewer steps:

    - ``atol``: an absolute tolerance of 1e20 on mu;
    - ``derivative``: the unknown is Mu with Mu' = mu, so that the multiplier enters as a derivative.

    A third, ``suppress``, leaves mu out of the error test by IDASetSuppressAlg.
    """

    differentiable: ClassVar = True
    kind: ClassVar = "formulation of Poisson systems"
    formulations: ClassVar = POISSON_FORMULATIONS
    default_treatments: ClassVar = {"casimirs": "derivative", "ode": "none"}

    def refusal(self, ivp: InitialValueProblem) -> str | None:
        """Return why the method cannot be used on this problem, as a sentence, or None."""
        if wrong := refused(self.name, ivp, dense=True):
            return wrong
        return without_casimirs(ivp) if self.formulation == "casimirs" and not ivp.facts.CASIMIRS else None

    def check(self, ivp: PoissonIvp, request: Request) -> None:
        """Accept a request that can be met; raise :class:`BadInput` otherwise."""
        super().check(ivp, request)
        self.check_treatment(request)
        if request.sensitivities:
            require_tuples(self.name, ivp)

    def _posed(self, ivp: PoissonIvp) -> PoissonDae:
        return pose_poisson(ivp, self.formulation, multipliers=self.multipliers)

    @property
    def _advice(self) -> str:
        return self.treatment_advice or super()._advice

    def _begin(self, dae: PoissonDae, tol: float, monitor: Monitor) -> Advance:
        return begin(dae, tol, self.tolerances(dae, tol), monitor, self.suppressed(dae))
