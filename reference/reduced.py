"""What the solvers of ODEs share: the index-reduced ODE, the request, and a way to begin that is their own."""

import time
from abc import ABC, abstractmethod
from collections.abc import Collection
from dataclasses import dataclass
from typing import ClassVar

from daebench.errors import unknown
from daebench.method import Request
from daebench.pose import Posed, pose
from daebench.reference.constrained import trajectory
from daebench.reference.meter import Meter
from daebench.reference.tolerance import TOLERANCES, Advance, Driven, check, drive
from daebench.scene import Scene
from daebench.trajectory import Trajectory


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

    def refusal(self, scene: Scene) -> str | None:
        """Return None: every problem can be posed as an ODE."""
        return None

    def check(self, scene: Scene, request: Request) -> None:
        """Accept a request that can be met; raise :class:`BadInput` otherwise."""
        check(self.name, request, self.least)

    def solve(self, scene: Scene, request: Request) -> Trajectory:
        """Return the trajectory; where the solver stops early, the outputs so far and why.

        Raises
        ------
        BadInput
            If the request cannot be met, see :func:`daebench.reference.tolerance.check`.
        DaebenchError
            If the start has no multiplier, see :func:`daebench.pose.pose`.
        """
        began = time.perf_counter()
        self.check(scene, request)
        dae = pose(scene, "ode")
        return trajectory(dae, request, self.drive(dae, request, began=began, advice="use a larger tol, and see whether G keeps its rank"))

    def drive(self, posed: Posed, request: Request, *, began: float, advice: str) -> Driven:
        """Return what the solver gives on any ODE; see :func:`daebench.reference.tolerance.drive`."""
        return drive(self.name, posed, request, lambda meter: self._begin(posed, request.value, meter), began=began, advice=advice)

    @abstractmethod
    def _begin(self, dae: Posed, tol: float, meter: Meter) -> Advance:
        """Compile what will be called, and return how the solver is advanced from output to output."""
