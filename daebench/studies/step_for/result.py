"""The largest step size of those tried whose statistics are those of half of it, what was found on the way, and its picture."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from daebench.diagnostics.equivalence import EQUIVALENT, QUANTILES, UNDECIDED, Equivalence
from daebench.draw.figures import BLUE, GREEN, QUIET, VERMILION, drawing, grid_of_axes
from daebench.runs.result import Result, Table
from daebench.systems.lazily import pandas as pd

if TYPE_CHECKING:
    from matplotlib.figure import Figure


STOPPED = "stopped"
"""The verdict on a step size at which a member did not come to its end."""


@dataclass(frozen=True)
class Tried:
    """One step size, against half of it.

    Parameters
    ----------
    h : float
        Step size, s.
    verdict : str
        "equivalent", "different", "undecided", or "stopped" where members did not come to their end.
    test : Equivalence or None
        The test, where all members came to their end.
    why : str
        Why it could not be made, or what an undecided one lacks.
    """

    h: float
    verdict: str
    test: Equivalence | None
    why: str = ""


@dataclass(frozen=True)
class StepFor(Result):
    """The step sizes that were tried, the largest first.

    Parameters
    ----------
    ivp : InitialValueProblem
        The problem, with its parameters.
    method, statistic : str
        Names of the method and of the quantity.
    margin : float
        Largest difference of means and quantiles, in the unit of the quantity.
    level : float
        Probability that the search passes a step size that differs from its half by the margin or more.
    planned : int
        Number of step sizes that would have been tried at most; each is tested at level / planned.
    t : float
        Time of the runs, s.
    starts : str
        What the starts are, as a sentence.
    members : int
        Number of starts.
    seed : int
        Seeds the starts.
    tried : tuple of Tried
        The steps.
    """

    stem: ClassVar[str] = "steps"
    fails_if: ClassVar[str] = "no step size passes"

    ivp: Any
    method: str
    statistic: str
    margin: float
    level: float
    planned: int
    t: float
    starts: str
    members: int
    seed: int
    tried: tuple[Tried, ...]

    @property
    def h(self) -> float | None:
        """The largest step size tried that is equivalent to its half, s; None where none is."""
        return next((row.h for row in self.tried if row.verdict == EQUIVALENT), None)

    @property
    def needed(self) -> Mapping[float, int | None]:
        """How many members, or about how many, would decide on the steps that are undecided, by step; None where no number can be told."""
        return {row.h: row.test.needed for row in self.tried if row.verdict == UNDECIDED and row.test}

    @property
    def table(self) -> "pd.DataFrame":
        """A row a step and a quantity: mean and quantiles, their differences from those at half of the step, and intervals."""
        rows: list[dict[str, Any]] = []
        for row in self.tried:
            about = {"h": row.h, "verdict": row.verdict}
            differences = row.test.differences if row.test else ()
            rows += [about | vars(difference) for difference in differences] or [about | {"name": row.why}]
        return pd.DataFrame(rows)

    def summary(self) -> dict[str, Any]:
        """Return the tests and the step that passes, for text and JSON."""
        return {
            **self.posed,
            "method": self.method,
            "statistic": self.statistic,
            "margin": self.margin,
            "level": self.level,
            "planned": self.planned,
            "t_end": self.t,
            "starts": self.starts,
            "members": self.members,
            "seed": self.seed,
            "h": self.h,
            "tried": [
                {"h": row.h, "verdict": row.verdict, "why": row.why or None, "needed": row.test.needed if row.test else None}
                | {"differences": {d.name: [d.value, d.low, d.high] for d in row.test.differences} if row.test else None}
                for row in self.tried
            ],
        }

    def plot(self) -> "Figure":
        """Return the picture of the search."""
        return figure(self)

    @property
    def origin(self) -> dict[str, str]:
        """How the tests were made."""
        return {"Method": self.method, "Starts": self.starts, "Seed": str(self.seed)}

    @property
    def status(self) -> int:
        """1 if no step size passes."""
        return int(self.h is None)

    def printed(self) -> Iterator[str | Table | Mapping[str, Any]]:
        """Yield the summary, the tests, and which step passes."""
        yield {name: value for name, value in self.summary().items() if name not in ("tried", "h")}
        yield Table(["h", "quantity", "difference from h/2", "interval", "verdict"], [line for row in self.tried for line in _lines(row)])
        for row in self.tried:
            if row.verdict == UNDECIDED:
                yield f"h = {row.h:g} s is undecided: {row.why}"
        yield self.answer
        yield f"level {self.level:g} of the search: each of {self.planned} tests at {self.level / self.planned:.3g}"

    @property
    def answer(self) -> str:
        """Which step passes, and what this does not show."""
        if self.h is None:
            return "no step tried passes"
        which = "the largest tried" if self.h == self.tried[0].h else "the largest that passes"
        tested = f"it agrees with {self.h / 2:g} s; whether that agrees with the exact motion is not tested"
        return f"h = {self.h:g} s passes, {which}: {tested}"


def _lines(row: Tried) -> list[list[str]]:
    """Return the rows of a step in the table of tests."""
    if not row.test:
        return [[f"{row.h:g}", "", "", row.why, row.verdict]]
    lines = []
    for difference in row.test.differences:
        decided = math.isfinite(difference.high)
        interval = f"{difference.low:.3g} to {difference.high:.3g}" if decided else "too few members"
        lines.append([f"{row.h:g}", difference.name, f"{difference.value:.3g}", interval, row.verdict])
    return lines


COLOURS = ("black", BLUE, GREEN, VERMILION)
"""Colours of the mean and of the quantiles."""

APART = 0.06
"""Distance of the intervals at one step, in parts of it."""


def figure(result: StepFor) -> "Figure":
    """Return the picture of a search for a step size."""
    with drawing():
        drawn, axes = grid_of_axes(1, 1, 3.6, x="step size $h$ [s]", y=f"difference in {result.statistic}")
        axis = axes[0, 0]
        axis.axhspan(-result.margin, result.margin, color=QUIET, alpha=0.2, linewidth=0, label="within the margin")
        shown = set()
        for row in result.tried:
            for k, difference in enumerate(row.test.differences if row.test else ()):
                place = row.h * (1 + APART * (k - len(QUANTILES) / 2))
                label = difference.name if difference.name not in shown else None
                shown.add(difference.name)
                ends = np.array([[difference.value - difference.low], [difference.high - difference.value]])
                ends[~np.isfinite(ends)] = np.nan
                filled = COLOURS[k] if row.verdict == EQUIVALENT else "white"
                axis.errorbar([place], [difference.value], ends, fmt="o", color=COLOURS[k], markerfacecolor=filled, capsize=2, label=label)
        axis.set_xscale("log")
        axis.set_yscale("symlog", linthresh=result.margin)
        axis.set_xticks([row.h for row in result.tried], [f"{row.h:g}" for row in result.tried])
        axis.minorticks_off()
        axis.legend(loc="upper left", bbox_to_anchor=(1.02, 1.0), frameon=False)
        drawn.suptitle(_title(result), fontsize="medium")
    return drawn


def _title(result: StepFor) -> str:
    """Return the answer first."""
    answer = "no step size tried passes" if result.h is None else f"h = {result.h:g} s agrees with its half"
    return f"{result.method} on {result.ivp.problem}, case {result.ivp.case}, to t = {result.t:g} s:\n{answer} (filled)"
