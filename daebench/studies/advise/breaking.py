"""Sensitivity of the choice: a step twice as large, ten times the horizon, and parameters changed by 20 %."""

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
from daebench.studies.work_precision.intervals import Estimate, share

STARTS = 5
"""Number of starts for each change."""

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
        One a start: infinite where a run stopped, at least the bound of its reference.
    bound : float
        The largest error of a reference.
    failure : str
        Why the first run stopped that did; "" where none did.
    words : str
        What errors are against.
    """

    errors: tuple[float, ...]
    bound: float
    failure: str = ""
    words: str = ""

    def quantile(self, part: float) -> float:
        """Return a quantile of the errors."""
        return float(np.quantile(self.errors, part, method="inverted_cdf")) if self.errors else math.nan

    def within(self, accuracy: float) -> Estimate:
        """Return the share of starts whose errors are within an accuracy, with its interval."""
        return share(sum(error <= accuracy for error in self.errors), len(self.errors))


@dataclass(frozen=True)
class Change:
    """A change, and the error with it.

    Parameters
    ----------
    what : str
        The change.
    found : OverStarts
        Errors from some starts.
    """

    what: str
    found: OverStarts

    def factor(self, accuracy: float) -> float:
        """Return the median error over the accuracy: infinite where runs stop, NaN where nothing is known."""
        return self.found.quantile(0.5) / accuracy


def over_starts(asked: Callable[[], StartRuns], part: str, make: Make) -> OverStarts:
    """Return the errors of runs from many starts; none where they cannot be made, or the problem has no start, as a ring that is open."""
    try:
        specification = asked()
        row = make(specification)
    except DaebenchError as error:
        return OverStarts((), math.nan, str(error))
    errors = [_error(row, part, i) for i in range(specification.members)]
    bounds = np.array(row[f"bound_{part}"], dtype=float)
    known = [error for error, bound in zip(errors, bounds, strict=True) if math.isfinite(bound)]
    failure = next(filter(None, row["failure"]), "") if isinstance(row["failure"], list) else str(row["failure"])
    return OverStarts(tuple(known), float(np.max(bounds)), failure, str(row.get("reference", "")))


def _error(row: Row, part: str, i: int) -> float:
    error, bound = float(row[f"error_{part}"][i]), float(row[f"bound_{part}"][i])
    return max(error, bound) if math.isfinite(error) else math.inf


def changes(question: Question, method: str, knob: str, value: float, make: Make) -> list[Change]:
    """Return the effect of each change on a choice, the worst first; changes with unknown effect come last."""
    found = [Change(what, over_starts(asked, question.part, make)) for what, asked in _changed(question, method, knob, value)]
    return sorted(found, key=lambda change: -_known(change.factor(question.accuracy)))


def _known(factor: float) -> float:
    return -1.0 if math.isnan(factor) else factor


def _changed(question: Question, method: str, knob: str, value: float) -> Iterator[tuple[str, Callable[[], StartRuns]]]:
    coarser, words = (2 * value, "step doubled") if knob == "h" else (10 * value, "tolerance times 10")
    yield words, partial(question.from_starts, method, coarser, starts=STARTS)
    yield f"horizon times {LONGER:g}", partial(question.from_starts, method, value, starts=STARTS, times=LONGER)
    for name, at in _moved(question.ivp.parameters):
        for sign, moved in (("+", 1 + MOVED), ("-", 1 - MOVED)):
            asked = partial(question.from_starts, method, value, starts=STARTS, parameters={name: at * moved})
            yield f"{name} {sign}{100 * MOVED:.0f} %", asked


def _moved(parameters: Mapping[str, Any]) -> Sequence[tuple[str, float]]:
    """Return the parameters that are moved: the first that are not zero."""
    return [(name, float(at)) for name, at in parameters.items() if float(at) != 0.0][:PARAMETERS]
