"""Common part of the solvers of ODEs: the index-reduced ODE, and the variants of each."""

from collections.abc import Collection
from dataclasses import dataclass
from typing import ClassVar

from daebench.errors import unknown
from daebench.methods.formulations.chain import refused
from daebench.methods.formulations.constrained import Dae
from daebench.methods.solvers.constrained_run import OnConstrained
from daebench.methods.solvers.least_squares import reduced
from daebench.runs.ivp import ConstrainedIvp, Ivp


@dataclass(frozen=True)
class OnReducedOde(OnConstrained):
    """A tolerance-driven solver on formulation ``ode``, HLW (1.18), with the analytic Jacobian where it uses one."""

    variant: str
    """One of the solver's own methods."""
    solver: ClassVar[str]
    variants: ClassVar[Collection[str]]

    def __post_init__(self) -> None:
        if self.variant not in self.variants:
            raise unknown(f"method of {self.solver}", self.variant, self.variants)

    @property
    def name(self) -> str:
        """Name in the grammar of methods."""
        return f"{self.solver}:{self.variant}"

    @property
    def dense(self) -> bool:
        """Whether it solves with the whole Jacobian."""
        return True

    def refusal(self, ivp: ConstrainedIvp) -> str | None:
        """Return why there is no ODE to solve, as a sentence, or None: a long chain has none, every other problem has one."""
        return refused(self.name, ivp) or self.lacks(ivp)

    def lacks(self, ivp: Ivp) -> str | None:
        """Return why the solver cannot solve the ODE of a problem for another reason, as a sentence, or None."""
        return None

    def _posed(self, ivp: ConstrainedIvp) -> Dae:
        return reduced(ivp)

    @property
    def _advice(self) -> str:
        return "use a larger tol, and see whether G keeps its rank"
