"""The measurements of an order study: its step sizes, the runs of a method, and the errors and slope of each component.

All step sizes meet the common times t = T k/8: h = T/(8 n).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from daebench.diagnostics.order import OrderFit
from daebench.errors import BadInput, positive, whole

COMMON = 8
"""Number of common times."""

SEQUENCES = {1: (64, 11), 2: (4, 10), 3: (1, 12), 4: (1, 12)}
"""For each order claimed, the steps between common times with which to begin, and how often to halve."""

STEEP = (1, 10)
"""The same for all higher orders, with three steps between the halvings."""

MOST_STEPS = 2**32
"""Steps of a run at most: more take too long, and round-off rules long before."""


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

    def line(self) -> list[str]:
        """Return its row in words."""
        measured = [f"{self.fit.slope:.3f}", f"{self.fit.slope_error:.1g}"] if math.isfinite(self.fit.slope) else ["", ""]
        points = f"{sum(self.fit.used)}/{len(self.fit.used)}"
        claimed = "" if self.claimed is None else str(self.claimed)
        return [self.method, self.component, claimed, *measured, points, self.reasons, self.fit.note]

    def plain(self) -> dict[str, Any]:
        """Return all of it, for JSON."""
        points = [{name: value for name, value in row.items() if name not in ("method", "component")} for row in self.rows()]
        return self.row() | {"dropped": self.dropped, "floor": self.floor, "points": points}

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


def step_sizes(t_end: float, claimed: int | None, h: float | None = None, halvings: int | None = None) -> list[int]:
    """Return the numbers of steps n from one common time to the next, coarsest first: h = t_end/(8 n)."""
    n, usual = SEQUENCES.get(claimed or 2, STEEP)
    if h is not None:
        n = _steps_between(t_end, positive("h", h))
    given, halvings = halvings is not None, usual if halvings is None else whole("halvings", halvings)
    if halvings < 2:
        raise BadInput(f"halvings = {halvings} must be at least 2: an order needs three step sizes.", "halvings-below-two")
    if halvings > math.log2(MOST_STEPS) or COMMON * n * 2**halvings > MOST_STEPS:
        raise BadInput(
            f"h = {t_end / (COMMON * n):g}, halved {halvings} times, makes more than 2^32 steps; halve it less often.",
            "halvings-make-too-many-steps",
        )
    counts = [n * 2**k for k in range(halvings + 1)]
    if not given and claimed not in SEQUENCES:
        counts = sorted({count * k // 4 for count in counts[:-1] for k in range(4, 8) if count * k % 4 == 0} | {counts[-1]})
    return counts


def _steps_between(t_end: float, h: float) -> int:
    ratio = t_end / (COMMON * h)
    if ratio < 1 - 1e-9:
        raise BadInput(
            f"h = {h:g} is larger than t_end/8 = {t_end / COMMON:g}, and errors are taken at every eighth of t_end = {t_end:g}; "
            "give a smaller h or a larger end time.",
            "orders-step-too-long",
        )
    return math.ceil(min(ratio, MOST_STEPS) - 1e-9)
