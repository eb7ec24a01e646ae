"""Errors of a choice from other starts, and from the start of the case with one thing changed: step, horizon, or a parameter."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from daebench.errors import DaebenchError
from daebench.studies.advise.question import LONGER, Question
from daebench.studies.advise.search import Make, Row
from daebench.studies.grid.start_runs import StartRuns
from daebench.studies.work_precision.winners import Estimate, fewest_wins, share

NOTHING = "nothing changed"

PARAMETERS = 4
"""Largest number of changed parameters."""

MOVED = 0.2
"""Relative change of a parameter."""


@dataclass(frozen=True)
class OverStarts:
    """Errors from many starts.

    Parameters
    ----------
    errors : tuple of float
        One a start with a reference: infinite where a run stopped, at least the bound of the reference.
    bound : float
        The largest error of a reference.
    failure : str
        Why the first run stopped that did; "" where none did.
    words : str
        What errors are against.
    unknown : int
        Number of other starts, which have no reference; they count as outside of any accuracy.
    """

    errors: tuple[float, ...] = ()
    bound: float = math.nan
    failure: str = ""
    words: str = ""
    unknown: int = 0

    @property
    def number(self) -> int:
        """Number of starts."""
        return len(self.errors) + self.unknown

    def quantile(self, part: float) -> float:
        """Return a quantile of the errors."""
        return float(np.quantile(self.errors, part, method="inverted_cdf")) if self.errors else math.nan

    def within(self, accuracy: float) -> Estimate:
        """Return the share of starts whose errors are within an accuracy, with its interval."""
        return share(sum(error <= accuracy for error in self.errors), self.number)

    def reached(self, part: float) -> float:
        """Return the accuracy that a share of all starts is shown to reach, see :func:`fewest_wins`; infinite where it reaches none."""
        ordered = [*sorted(self.errors), *[math.inf] * self.unknown]
        return ordered[fewest_wins(part, self.number) - 1] if ordered else math.inf


@dataclass(frozen=True)
class Change:
    """A change, and the error with it.

    Parameters
    ----------
    what : str
        The change.
    found : OverStarts
        Error of its run.
    """

    what: str
    found: OverStarts

    def factor(self, accuracy: float) -> float:
        """Return the error over the accuracy: infinite where the run stops, NaN where nothing is known."""
        return self.found.quantile(0.5) / accuracy


def over_starts(asked: Callable[[], StartRuns], part: str, make: Make) -> OverStarts:
    """Return the errors of runs from many starts; none where they cannot be made, or the problem has no start, as a ring that is open."""
    try:
        specification = asked()
        row = make(specification)
    except DaebenchError as error:
        return OverStarts(failure=str(error))
    errors = [_error(row, part, i) for i in range(specification.members)]
    bounds = np.array(row[f"bound_{part}"], dtype=float)
    known = [error for error, bound in zip(errors, bounds, strict=True) if math.isfinite(bound)]
    failure = next(filter(None, row["failure"]), "") if isinstance(row["failure"], list) else str(row["failure"])
    return OverStarts(tuple(known), float(np.max(bounds)), failure, str(row.get("reference", "")), len(errors) - len(known))


def _error(row: Row, part: str, i: int) -> float:
    error, bound = float(row[f"error_{part}"][i]), float(row[f"bound_{part}"][i])
    return max(error, bound) if math.isfinite(error) else math.inf


def changes(question: Question, method: str, knob: str, value: float, make: Make) -> list[Change]:
    """Return the choice as it is, and then the effect of each change, the worst first; changes with unknown effect come last."""
    as_is, *others = (Change(what, over_starts(asked, question.part, make)) for what, asked in _changed(question, method, knob, value))
    return [as_is, *sorted(others, key=lambda change: -_known(change.factor(question.accuracy)))]


def _known(factor: float) -> float:
    return -1.0 if math.isnan(factor) else factor


def _changed(question: Question, method: str, knob: str, value: float) -> Iterator[tuple[str, Callable[[], StartRuns]]]:
    coarser, words = (2 * value, "step doubled") if knob == "h" else (10 * value, "tolerance times 10")
    yield NOTHING, partial(question.changed, method, value)
    yield words, partial(question.changed, method, coarser)
    yield f"horizon times {LONGER:g}", partial(question.changed, method, value, times=LONGER)
    for name, at in _moved(question.ivp.parameters):
        for sign, moved in (("+", 1 + MOVED), ("-", 1 - MOVED)):
            yield f"{name} {sign}{100 * MOVED:.0f} %", partial(question.changed, method, value, parameters={name: at * moved})


def _moved(parameters: Mapping[str, Any]) -> Sequence[tuple[str, float]]:
    """Return the parameters that are moved: the first that are not zero."""
    return [(name, float(at)) for name, at in parameters.items() if float(at) != 0.0][:PARAMETERS]
