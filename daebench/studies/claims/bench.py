"""Tests of claims: the rule for the roundings of a run, a finding, and the list of findings.

A property that is claimed to hold exactly has to be zero up to rounding. The bounds follow from one rule::

    bound = 64 eps n size        eps = 2^-52

n is the number of steps, each of which rounds; 64 allows for the roundings of one step, substeps and stages included (RATTLE, and its
composition of 17 substeps, show up to one half of one of them); size is what the rounded numbers amount to, so that neither units
nor mass ratios matter. The sizes of each kind of problem are in :mod:`daebench.studies.claims.constrained` and
:mod:`daebench.studies.claims.poisson`.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Generic, TypeVar

from daebench.errors import BadInput, RunFailed
from daebench.reference.solution import EPS
from daebench.runs.result import Result
from daebench.runs.trajectory import Outcome

OK, FALLS_SHORT, NOT_CLAIMED = "ok", "FALLS SHORT", "not claimed"
NOT_APPLICABLE, UNDETERMINED = "not applicable", "undetermined"

DEFECT_STEPS = 10
"""Steps of the map whose defects are measured: one step of some schemes that are not symplectic keeps the two-form, by accident."""

ROUNDINGS = 64.0
"""Roundings of the size of the state that are allowed for in each step."""

NAMES = {"energy": "H", "Gv": "G H_p"}
"""Names of conserved quantities in findings, where they differ from those of their errors."""

NO_BOUND = float("nan")

Ivp = TypeVar("Ivp")
Run = TypeVar("Run", bound=Outcome)


@dataclass(frozen=True)
class Finding:
    """One claim and what was measured.

    Parameters
    ----------
    property : str
        The property.
    claimed : int, bool or None
        The order; or whether the method claims the property; None for a property that no method claims, which is only reported.
    measured : float
        The slope for the order, otherwise the defect or the largest error; NaN if there is none.
    bound : float
        The slope must exceed it, other numbers must not; NaN if there is no comparison.
    verdict : str
        "ok", "FALLS SHORT", "not claimed", "not applicable" or "undetermined".
    standard_error : float
        Standard error of the slope.
    note : str
        A sentence with further numbers, or with the reason why there is no number or no verdict.
    """

    property: str
    claimed: int | bool | None
    measured: float
    bound: float
    verdict: str
    standard_error: float = float("nan")
    note: str = ""


def finding(property: str, claimed: bool | None, measured: float, bound: float = NO_BOUND, note: str = "") -> Finding:
    """Return the finding on a number that must not exceed its bound if it is claimed; NaN fails."""
    verdict = NOT_CLAIMED if not claimed else OK if measured <= bound else FALLS_SHORT
    return Finding(property, claimed, measured, bound, verdict, note=note)


def attempted(measure: Callable[[], Any]) -> tuple[float, str]:
    """Return a number, or NaN and the sentence that says why there is none: no solution, or a chart that is singular there."""
    try:
        return float(measure()), ""
    except (RunFailed, BadInput) as error:
        return float("nan"), str(error)


class Checked(Result):
    """Claims of a method, or declarations of a problem, and whether they hold."""

    fails_if: ClassVar[str] = "one does not hold"


class Bench(ABC, Generic[Ivp, Run]):
    """One method measured on one initial value problem, along a complete run of it with everything monitored.

    Each kind of problem says which claims there are, how the defects are measured, and what the sizes are.
    """

    def __init__(self, ivp: Ivp, method: Any, run: Run) -> None:
        self.ivp, self.method, self.run = ivp, method, run
        self.n = min(DEFECT_STEPS, run.steps)

    @abstractmethod
    def defects(self) -> list[Finding]:
        """Return the findings on the map of n steps."""

    def judged(self, name: str) -> Finding:
        """Return the finding on a property of the map: "symmetric" or "symplectic"."""
        return self.form() if name == "symplectic" else self.symmetric()

    @abstractmethod
    def symmetric(self) -> Finding:
        """Return the finding on whether the map undoes itself, with -h or with reversed momenta."""

    @abstractmethod
    def form(self) -> Finding:
        """Return the finding on what the exact map leaves unchanged: the two-form on the tangent space, or B."""

    @abstractmethod
    def conserved(self) -> Mapping[str, tuple[bool | None, float]]:
        """Return which errors along the run are claimed to be rounding, and the sizes of these quantities."""

    def findings(self) -> list[Finding]:
        """Return all findings but that on the order."""
        return self.defects() + [
            finding(f"keeps {NAMES.get(name, name)}", claimed, self.run.maxima[name], self.bound(self.run.steps, size))
            for name, (claimed, size) in self.conserved().items()
        ]

    def bound(self, n: int, size: float) -> float:
        """Return the largest effect of rounding alone over n steps."""
        return ROUNDINGS * EPS * n * size
