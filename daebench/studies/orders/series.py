"""Results of an order study: the runs of a method, and the errors and slope of each component."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import pandas as pd

from daebench.diagnostics.order import OrderFit
from daebench.reference.solution import ReferenceSolution
from daebench.runs.ivp import Ivp


@dataclass(frozen=True)
class Point:
    """One run."""

    h: float
    """Step size, s."""
    steps: int
    """Number of steps to the end time."""
    errors: Mapping[str, float]
    """Error of each component that was measured, none where the run failed."""
    failure: str = ""
    """Why it failed, as a sentence; empty if it did not."""
    seconds: float = 0.0
    """CPU time it took."""
    bound: float = 0.0
    """What the reference of the stage multipliers may be wrong by."""


@dataclass(frozen=True)
class Series:
    """One component of one method."""

    method: str
    """Name of the method."""
    component: str
    """"q", "p", "lam" or the name of a stage multiplier; "y" of a Poisson system."""
    claimed: int | None
    """The order that the method claims; a stage multiplier has none."""
    points: tuple[Point, ...]
    """The runs in which it was measured or which failed, coarsest first."""
    fit: OrderFit
    """The order, and what became of each point; "plateau" stands for errors that stop falling far above rounding."""
    floor: float
    """Error up to which points count as round-off."""

    @property
    def errors(self) -> list[float]:
        """Error at each point, NaN where the run failed."""
        return [point.errors.get(self.component, math.nan) for point in self.points]

    @property
    def dropped(self) -> dict[str, int]:
        """How many points were dropped, by reason."""
        reasons = [reason for reason in self.fit.reasons if reason]
        return {reason: reasons.count(reason) for reason in dict.fromkeys(reasons)}

    @property
    def reasons(self) -> str:
        """The same in words, such as "2 pre-asymptotic, 3 round-off"."""
        return ", ".join(f"{count} {reason}" for reason, count in self.dropped.items())

    def row(self) -> dict[str, Any]:
        """Return its row of the table."""
        return {
            "method": self.method,
            "component": self.component,
            "claimed": self.claimed,
            "order": self.fit.slope,
            "order_error": self.fit.slope_error,
            "used": sum(self.fit.used),
            "points": len(self.points),
            "dropped": self.reasons,
            "note": self.fit.note,
        }

    def rows(self) -> list[dict[str, Any]]:
        """Return one row a point."""
        return [
            {
                "method": self.method,
                "component": self.component,
                "h": point.h,
                "steps": point.steps,
                "error": error,
                "used": used,
                "reason": reason,
                "failure": point.failure,
            }
            for point, error, used, reason in zip(self.points, self.errors, self.fit.used, self.fit.reasons, strict=True)
        ]


@dataclass(frozen=True)
class OrderStudy:
    """Orders of several methods on one initial value problem."""

    ivp: Ivp
    """What was solved."""
    t_end: float
    """End time, s."""
    reference_solution: ReferenceSolution
    """The reference at the common times."""
    series: tuple[Series, ...]
    """One for each method and component."""

    def table(self) -> pd.DataFrame:
        """Return one row for each method and component, as :meth:`Series.row` gives them."""
        return pd.DataFrame([series.row() for series in self.series]).astype({"claimed": "Int64"})

    def points(self) -> pd.DataFrame:
        """Return one row for each method, component and step size, as :meth:`Series.rows` gives them."""
        return pd.DataFrame([row for series in self.series for row in series.rows()])
