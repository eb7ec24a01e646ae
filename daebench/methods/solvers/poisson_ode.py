"""CVODE and SciPy's solvers on Poisson systems as they stand, y' = B(y) grad H(y)."""

from dataclasses import dataclass

from daebench.methods.formulations.poisson import PoissonDae, pose_poisson
from daebench.methods.solvers.drive import Advance
from daebench.methods.solvers.monitor import Monitor
from daebench.methods.solvers.poisson_run import OnPoisson, refused
from daebench.methods.solvers.reduced import OnReducedOde
from daebench.runs.ivp import Ivp, PoissonIvp


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
