"""A tolerance-driven run on a Poisson system: what is refused, and the trajectory from what the solver gave."""

import time

from daebench.errors import BadInput
from daebench.methods.fixed_step.poisson import require_poisson
from daebench.methods.formulations.variation import VariedPoisson, varied_poisson
from daebench.methods.monitored_errors import output_maxima
from daebench.methods.solvers.drive import ToleranceMethod, check, check_record, drive
from daebench.runs.directions import directions
from daebench.runs.ivp import InitialValueProblem, PoissonIvp
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
            raise BadInput(refusal)
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
