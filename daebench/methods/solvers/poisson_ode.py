"""CVODE and SciPy's solvers on Poisson systems as they stand, y' = B(y) grad H(y)."""

import time
from dataclasses import dataclass

from daebench.methods.formulations.poisson import pose_poisson
from daebench.methods.solvers.poisson_run import ADVICE, accept, poisson_trajectory, refused
from daebench.methods.solvers.reduced import OnReducedOde
from daebench.runs.ivp import InitialValueProblem, PoissonIvp
from daebench.runs.request import Request
from daebench.runs.trajectory import PoissonTrajectory


@dataclass(frozen=True)
class PoissonOde:
    """A tolerance-driven solver on y' = B grad H, with the analytic Jacobian where it uses one.

    Parameters
    ----------
    solver : OnReducedOde
        The solver, which has the name of the method.
    """

    solver: OnReducedOde
    knob = "tol"

    @property
    def name(self) -> str:
        """Name in the grammar of methods."""
        return self.solver.name

    def refusal(self, ivp: InitialValueProblem) -> str | None:
        """Return why the method cannot be used on this problem, as a sentence, or None."""
        return refused(self.name, ivp, dense=self.solver.dense) or self.solver.lacks(ivp)

    def check(self, ivp: PoissonIvp, request: Request) -> None:
        """Accept a request that can be met; raise :class:`BadInput` otherwise."""
        accept(self.name, self.refusal(ivp), request, self.solver.least)

    def solve(self, ivp: PoissonIvp, request: Request) -> PoissonTrajectory:
        """Return the trajectory; where the solver stops early, the outputs so far and why.

        Raises
        ------
        BadInput
            If the request cannot be met, see :func:`daebench.methods.solvers.poisson_run.accept`.
        DaebenchError
            If a value at the start is not finite.
        """
        began = time.perf_counter()
        self.check(ivp, request)
        dae = pose_poisson(ivp, "ode")
        return poisson_trajectory(dae, request, self.solver.drive(dae, request, began=began, advice=ADVICE))
