"""What the solvers of ODEs share: the index-reduced ODE, the request, and a way to begin that is their own."""

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import ClassVar

from daebench.errors import BadInput, unknown
from daebench.methods.formulations.chain import refused
from daebench.methods.formulations.constrained import Posed
from daebench.methods.solvers.constrained_run import constrained
from daebench.methods.solvers.drive import TOLERANCES, Advance, Driven, check, drive
from daebench.methods.solvers.least_squares import reduced
from daebench.methods.solvers.monitor import Monitor
from daebench.runs.ivp import ConstrainedIvp, InitialValueProblem
from daebench.runs.request import Request
from daebench.runs.trajectory import Trajectory


@dataclass(frozen=True)
class OnReducedOde(ABC):
    """A tolerance-driven solver on formulation ``ode``, HLW (1.18), with the analytic Jacobian where it uses one.

    Parameters
    ----------
    variant : str
        One of the solver's own methods.

    Raises
    ------
    BadInput
        If the variant is unknown.
    """

    variant: str
    knob = "tol"
    solver: ClassVar[str]
    variants: ClassVar[Collection[str]]
    least: ClassVar[float] = TOLERANCES[0]

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

    def lacks(self, ivp: InitialValueProblem) -> str | None:
        """Return what else the solver lacks to solve the ODE of a problem, as a sentence, or None."""
        return None

    def check(self, ivp: ConstrainedIvp, request: Request) -> None:
        """Accept a request that can be met; raise :class:`BadInput` otherwise."""
        check(self.name, request, self.least)
        if refusal := self.refusal(ivp):
            raise BadInput(refusal)

    def solve(self, ivp: ConstrainedIvp, request: Request) -> Trajectory:
        """Return the trajectory; where the solver stops early, the outputs so far and why.

        Raises
        ------
        BadInput
            If the request cannot be met, see :func:`daebench.methods.solvers.drive.check`.
        DaebenchError
            If the start has no multiplier, see :func:`daebench.methods.solvers.constrained_run.constrained`.
        """
        began = time.perf_counter()
        self.check(ivp, request)
        advice = "use a larger tol, and see whether G keeps its rank"

        def driven(dae: Posed, make_monitor: Callable[..., Monitor]) -> Driven:
            return self.drive(dae, request, began=began, advice=advice, make_monitor=make_monitor)

        return constrained(self.name, ivp, request, reduced, driven)

    def drive(self, posed: Posed, request: Request, *, began: float, advice: str, make_monitor: Callable[..., Monitor] = Monitor) -> Driven:
        """Return what the solver gives on any ODE; see :func:`daebench.methods.solvers.drive.drive`."""
        return drive(self.name, posed, request, self._begin, began=began, advice=advice, make_monitor=make_monitor)

    @abstractmethod
    def _begin(self, dae: Posed, tol: float, monitor: Monitor) -> Advance:
        """Compile what will be called, and return how the solver is advanced from output to output."""
