"""The largest step size of those tried whose statistics are those of half of it, and what was found on the way."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from daebench.diagnostics.equivalence import EQUIVALENT, UNDECIDED, Equivalence
from daebench.runs.result import Result

if TYPE_CHECKING:
    import pandas as pd

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

    drawn_by: ClassVar[str] = "daebench.studies.step_for.figure"

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
        import pandas as pd

        rows: list[dict[str, Any]] = []
        for row in self.tried:
            about = {"h": row.h, "verdict": row.verdict}
            differences = row.test.differences if row.test else ()
            rows += [about | vars(difference) for difference in differences] or [about | {"name": row.why}]
        return pd.DataFrame(rows)

    def summary(self) -> dict[str, Any]:
        """Return what was found, for people and for JSON."""
        return {
            "problem": self.ivp.problem,
            "case": self.ivp.case,
            "parameters": dict(self.ivp.parameters),
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
