"""The cheapest step size or tolerance with which a method reaches an accuracy, with few runs, none of them longer than useful.

Step sizes and tolerances are numbered, the finer the larger the number.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from daebench.studies.advise.question import Question
from daebench.studies.grid.rows import lost_rank
from daebench.studies.grid.run_specification import GridRun
from daebench.studies.measurable import claimed_order

LEAST, LEAST_OF_FEW, FEW = 8, 4, 64
"""Times at which errors are taken at least, in the search, and where there are no more steps than that; of the choice there are more."""

TOLERANCES = 4
"""Tolerances a decade."""

MOST_STEPS = 2**22
"""Steps of a run at most."""

LEAST_TOLERANCE = 1e-14
"""The smallest tolerance that is tried."""

ASYMPTOTIC = 0.1
"""Error of a run, over the size of the motion, up to which it is taken as proportional to a power of the step size."""

BELOW = 0.85
"""Part of the accuracy that a prediction aims at."""

START = 2e-5
"""Approximate time that a run takes before its first step, s; a shorter time says nothing about the cost of a step."""

FARTHEST = 16
"""By how much a prediction may refine at once."""


@dataclass(frozen=True)
class StepSizes:
    """Parts of the horizon; the number is that of the steps, which come to some of the times at which the reference is known."""

    t_end: float
    """Horizon, s."""
    outputs: int
    """Number of equidistant times at which the reference is known."""
    most: int
    """Largest number of steps."""
    order: int
    """Order of the method."""
    size: float
    """Size of the motion, in the unit of its positions."""

    def value(self, number: int) -> float:
        """Return the step size."""
        return self.t_end / number

    def number(self, value: float) -> int:
        """Return the number of steps of a size."""
        return round(self.t_end / value)

    def first(self, accuracy: float) -> int:
        """Return the least number of steps."""
        return self._from(1)

    def finer(self, number: int, error: float, accuracy: float) -> int:
        """Return the number at which an error of the method's order is a little below the accuracy; twice as many where it is large."""
        parts = (error / (BELOW * accuracy)) ** (1 / self.order) if error < ASYMPTOTIC * self.size else 2.0
        return self._from(max(number + 1, math.ceil(number * min(parts, FARTHEST))))

    def between(self, low: int, high: int) -> int | None:
        """Return about the geometric mean, or None where a step is at most 15 % larger than the other."""
        middle = self._from(round(math.sqrt(low * high)))
        middle = middle if middle < high else self._from(low + 1)
        return middle if high > 1.15 * low and middle < high else None

    def cost(self, number: int, seconds: float, other: int) -> float:
        """Return a cost that grows in proportion to steps where it is more than that of a start."""
        return seconds + max(seconds - START, 0.0) * (other / number - 1)

    def _from(self, number: int) -> int:
        """Return the least number from this one on that comes to enough of the times."""
        return next(k for k in range(number, number + 2 * self.outputs) if math.gcd(k, self.outputs) >= self._least(k))

    def _least(self, number: int) -> int:
        return min(LEAST if number > FEW else LEAST_OF_FEW, self.outputs)


@dataclass(frozen=True)
class Tolerances:
    """Tolerances 10^(-k/4)."""

    most: int = round(-math.log10(LEAST_TOLERANCE)) * TOLERANCES

    def value(self, number: int) -> float:
        """Return 10^(-number / 4), to two digits."""
        return float(f"{10 ** (-number / TOLERANCES):.1e}")

    def number(self, value: float) -> int:
        """Return the number of a tolerance."""
        return round(-math.log10(value) * TOLERANCES)

    def first(self, accuracy: float) -> int:
        """Return the number of the accuracy itself."""
        return min(self.most, max(1, round(-math.log10(accuracy) * TOLERANCES)))

    def finer(self, number: int, error: float, accuracy: float) -> int:
        """Return the number at which an error in proportion to the tolerance is a little below the accuracy."""
        if not math.isfinite(error):
            return number + TOLERANCES
        return number + max(1, min(3 * TOLERANCES, math.ceil(math.log10(error / (BELOW * accuracy)) * TOLERANCES)))

    def between(self, low: int, high: int) -> int | None:
        """Return the middle, or None between neighbours."""
        return (low + high) // 2 if high > low + 1 else None

    def cost(self, number: int, seconds: float, other: int) -> float:
        """Return the same cost: how a solver's grows with the tolerance is not known beforehand."""
        return seconds


Resolutions = StepSizes | Tolerances
"""Numbered values of a method's step size or tolerance."""

Row = Mapping[str, Any]

Make = Callable[[GridRun], Row]
"""Makes the row of a run, or takes it from a store."""

ATTEMPTS = 24
"""Runs of a method at most."""

DEARER = 1.3
"""A method that takes so many times as long as one that is sure to be named is not followed further."""

STUCK = 3
"""Refinements in a row that do not help: the method is at its round-off, or does not converge."""


@dataclass(frozen=True)
class Found:
    """Result of the search for one method."""

    method: str
    knob: str
    """The method, and the name of its resolution: "h" or "tol"."""
    row: Row | None
    """The cheapest run that reaches the accuracy; None where none was found."""
    rows: tuple[Row, ...]
    """All runs."""
    why: str = ""
    """Why it was given up, where it was."""

    @property
    def seconds(self) -> float:
        """CPU time of the cheapest run, s; infinite where none reaches the accuracy."""
        return float(self.row["seconds"]) if self.row else math.inf

    @property
    def value(self) -> float:
        """Its step size or tolerance; NaN where none reaches the accuracy."""
        return float(self.row["value"]) if self.row else math.nan


def error_of(row: Row, part: str) -> float:
    """Return the error of a run, infinite where it failed; at least the bound of its reference, below which nothing is known."""
    error = float(row[f"error_{part}"])
    return math.inf if row["failure"] or not math.isfinite(error) else max(error, float(row[f"bound_{part}"]))


def resolutions_of(question: Question, method: str) -> Resolutions:
    """Return the step sizes or tolerances of a method."""
    solver = question.solver(method)
    if solver.knob != "h":
        return Tolerances()
    return StepSizes(question.t_end, question.outputs, MOST_STEPS, claimed_order(solver) or 1, question.size)


def search(question: Question, method: str, make: Make, longest: float = math.inf) -> Found:
    """Return the cheapest run of a method that reaches the accuracy."""
    resolutions, knob = resolutions_of(question, method), question.solver(method).knob
    rows: dict[int, Row] = {}
    number, why = resolutions.first(question.accuracy), "no step size tried reaches the accuracy"
    for _ in range(ATTEMPTS):
        rows[number] = make(question.run(method, resolutions.value(number)))
        reached = [k for k, row in rows.items() if error_of(row, question.part) <= question.accuracy]
        following, why = _next(question, resolutions, rows, min(reached, default=None), longest)
        if following is None:
            break
        number = following
    best = min((rows[k] for k in reached), key=lambda row: float(row["seconds"]), default=None)
    return Found(method, knob, best, tuple(rows[k] for k in sorted(rows)), "" if best is not None else why)


def _next(
    question: Question, resolutions: Resolutions, rows: Mapping[int, Row], reached: int | None, longest: float
) -> tuple[int | None, str]:
    """Return the number of the next run, or None with the reason for which there is none."""
    low = max((k for k in rows if reached is None or k < reached), default=0)
    if reached is not None:
        return _coarser(resolutions, rows, low, reached), ""
    runs = [rows[k] for k in sorted(rows)]
    why, errors = str(runs[-1]["failure"]).rstrip("."), [error_of(row, question.part) for row in runs]
    if len(runs) > 1 and all(map(lost_rank, runs[-2:])):
        return None, why
    if _stuck(errors, question.size):
        return None, f"its error stays at {min(errors):.1e} for any step size or tolerance"
    if low >= resolutions.most:
        return None, why or f"its error is {errors[-1]:.1e} with the finest step size or tolerance that is tried"
    number = min(resolutions.most, resolutions.finer(low, errors[-1], question.accuracy))
    known = [(k, float(rows[k]["seconds"])) for k in sorted(rows) if math.isfinite(float(rows[k]["seconds"]))]
    if known and resolutions.cost(*known[-1], number) > DEARER * longest:
        return None, "it takes longer than others that reach the accuracy, or than the budget allows"
    return number, "the largest number of runs did not reach the accuracy"


def _stuck(errors: list[float], size: float) -> bool:
    """Return whether the last refinements of a method have not helped, although its error was small beside the size of the motion."""
    if len(errors) <= STUCK or not errors[-STUCK - 1] < ASYMPTOTIC * size:
        return False
    return bool(np.all(np.isfinite(errors[-STUCK:])) and min(errors[-STUCK:]) >= errors[-STUCK - 1] / 2)


def _coarser(resolutions: Resolutions, rows: Mapping[int, Row], low: int, reached: int) -> int | None:
    """Return the number between one that does not reach the accuracy and one that does, or None where there is none."""
    if low:
        return resolutions.between(low, reached)
    return max(1, reached - TOLERANCES) if isinstance(resolutions, Tolerances) and reached > 1 else None
