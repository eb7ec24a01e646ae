"""Tolerance-driven runs on Poisson systems: refusals, trajectories, IDA on residuals and on DAEs that keep Casimir functions, and ODEs."""

import time
from dataclasses import dataclass
from typing import ClassVar

from daebench.errors import BadInput
from daebench.methods.fixed_step.poisson import require_poisson
from daebench.methods.formulations.poisson import PoissonDae, pose_poisson, without_casimirs
from daebench.methods.formulations.table import POISSON_FORMULATIONS
from daebench.methods.formulations.variation import VariedPoisson, varied_poisson
from daebench.methods.monitored_errors import output_maxima
from daebench.methods.solvers.constrained_run import OnReducedOde
from daebench.methods.solvers.drive import Advance, ToleranceMethod, check, check_record, drive
from daebench.methods.solvers.error_test import TreatedMultipliers
from daebench.methods.solvers.ida import begin
from daebench.methods.solvers.monitor import Monitor
from daebench.runs.directions import directions, require_tuples
from daebench.runs.ivp import InitialValueProblem, Ivp, PoissonIvp
from daebench.runs.request import Request
from daebench.runs.trajectory import PoissonTrajectory

LARGEST = 2000
"""Coordinates up to which a solver may work with the whole Jacobian."""


def refused(name: str, ivp: InitialValueProblem, *, dense: bool) -> str | None:
    """Return why a method of this name cannot run, if the system is not a Poisson system or is too large for its Jacobian, or None."""
    if ivp.on_manifold:
        return f"{name} is asked for as a method for Poisson systems, and {ivp.problem} is {ivp.state.words}."
    if dense and ivp.size > LARGEST:
        return (
            f"{name} solves with the whole Jacobian, and {ivp.problem} has {ivp.size} coordinates, more than {LARGEST}; "
            "use scipy:DOP853, or a fixed-step method such as strang."
        )
    return None


class OnPoisson(ToleranceMethod):
    """A tolerance-driven method on Poisson systems."""

    @property
    def _advice(self) -> str:
        return "end the run earlier if the motion itself diverges there, or use another tol"

    def check(self, ivp: PoissonIvp, request: Request) -> None:
        """Accept a request that can be met."""
        if refusal := self.refusal(ivp):
            raise BadInput(refusal, "method-refuses-problem")
        require_poisson(self.name, request)
        check(self.name, request, self.least)
        check_record(self, request)

    def solve(self, ivp: PoissonIvp, request: Request) -> PoissonTrajectory:
        """Return the trajectory; if the solver stops early, the outputs so far and the reason."""
        began = time.perf_counter()
        self.check(ivp, request)
        dae = self._posed(ivp)
        if request.sensitivities:
            dae = varied_poisson(dae, directions(ivp, request.sensitivities))
        run = drive(self, dae, request, began=began)
        y = dae.states(run.Y)
        maxima = output_maxima(ivp, request.watched(ivp.state), y)
        sensitivities = dae.sensitivities(run.Y[run.kept]) if isinstance(dae, VariedPoisson) else {}
        return PoissonTrajectory(**run.outcome, t=run.t[run.kept], y=y[run.kept], maxima=maxima, sensitivities=sensitivities)


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


@dataclass(frozen=True)
class PoissonOde(OnPoisson):
    """A tolerance-driven solver on y' = B grad H, with the analytic Jacobian where it uses one."""

    solver: OnReducedOde
    """The solver, which has the name of the method."""

    @property
    def name(self) -> str:
        """Name in the grammar of methods."""
        return self.solver.name

    def refusal(self, ivp: Ivp) -> str | None:
        """Return why the method cannot be used on this problem, as a sentence, or None."""
        return refused(self.name, ivp, dense=self.solver.dense) or self.solver.lacks(ivp)

    @property
    def tells_steps(self) -> bool:
        """Whether the solver tells what it thinks of its steps."""
        return self.solver.tells_steps

    @property
    def least(self) -> float:
        """Smallest tolerance that the solver takes."""
        return self.solver.least

    def _posed(self, ivp: PoissonIvp) -> PoissonDae:
        return pose_poisson(ivp, "ode")

    def _begin(self, dae: PoissonDae, tol: float, monitor: Monitor) -> Advance:
        return self.solver._begin(dae, tol, monitor)
