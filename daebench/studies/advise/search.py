"""The cheapest step size or tolerance with which a method reaches an accuracy, with few runs, none of them longer than useful."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from daebench.studies.advise.question import Question
from daebench.studies.advise.resolutions import ASYMPTOTIC, MOST_STEPS, TOLERANCES, Resolutions, StepSizes, Tolerances
from daebench.studies.grid.rows import lost_rank
from daebench.studies.grid.run_specification import GridRun
from daebench.studies.measurable import claimed_order

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
    if len(rows) > 1 and all(map(lost_rank, (rows[k] for k in sorted(rows)[-2:]))):
        return None, str(rows[low]["failure"]).rstrip(".")
    errors = [error_of(rows[k], question.part) for k in sorted(rows)]
    if _stuck(errors, question.size):
        return None, f"its error stays at {min(errors):.1e} for any step size or tolerance"
    if low >= resolutions.most:
        why = str(rows[max(rows)]["failure"]).rstrip(".")
        return None, why or f"its error is {errors[-1]:.1e} with the finest step size or tolerance that is tried"
    number = min(resolutions.most, resolutions.finer(low, errors[-1], question.accuracy))
    known = [k for k in sorted(rows) if math.isfinite(float(rows[k]["seconds"]))]
    if known and resolutions.cost(known[-1], float(rows[known[-1]]["seconds"]), number) > DEARER * longest:
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
