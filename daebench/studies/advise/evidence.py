"""Evidence on a choice: what it conserves over ten times the horizon, and its errors from other starts and under changes."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from daebench.diagnostics.drift import BOUNDED, KEPT
from daebench.errors import DaebenchError, RunFailed
from daebench.runs.ivp import Ivp
from daebench.studies.advise.question import LONGER, Question
from daebench.studies.advise.search import Make, Row
from daebench.studies.grid.claimed import claimed
from daebench.studies.grid.metrics import defect_of
from daebench.studies.grid.run_specification import StartRuns
from daebench.studies.work_precision.study import EPS, ROUND_OFF
from daebench.studies.work_precision.winners import Estimate, fewest_wins, share

OUTPUTS = 256
"""States of the long run that are looked at: enough for oscillations of the energy to be told from its drift."""


@dataclass(frozen=True)
class Kept:
    """Whether a quantity is conserved, and the evidence.

    Parameters
    ----------
    claimed, measured : bool
        Whether the method claims it, and whether the measurement confirms it.
    value : float
        The measured error or defect.
    words : str
        Its name, and the time over which it was measured.
    """

    claimed: bool
    measured: bool
    value: float
    words: str

    @property
    def kept(self) -> bool:
        """Whether it is claimed and confirmed."""
        return self.claimed and self.measured


def keeps(question: Question, method: str, value: float, make: Make) -> dict[str, Kept]:
    """Return how well a method conserves each quantity of the problem at a step size or tolerance, by quantity."""
    solver, ivp = question.solver(method), question.ivp
    metrics = ("energy", ivp.state.conserved)
    row = make(replace(question.run(method, value, repeat=0, times=LONGER, metrics=metrics), outputs=OUTPUTS))
    claims, over, ended = claimed(ivp, solver), f"over {LONGER * question.t_end:g} s", not row["failure"]
    conserved = {"energy": _energy(row, over, claimed="energy" in claims)}
    if ivp.m:
        off = float(np.max([row["g"], row["Gv"]]))
        conserved["constraints"] = Kept("constraints" in claims, ended and off <= ROUND_OFF, off, f"|g|, |G v| {over}")
    elif ivp.casimirs and np.isfinite(row["casimirs"]):
        off, most = float(row["casimirs"]), max(ROUND_OFF, EPS * float(row["steps"]))
        conserved["casimirs"] = Kept("casimirs" in claims, ended and off <= most, off, f"error {over}")
    if solver.knob == "h" and "two_form" in claims:
        conserved["two_form"] = _two_form(ivp, solver, value)
    return conserved


def _two_form(ivp: Ivp, solver: Any, value: float) -> Kept:
    """Return whether the two-form is conserved; where the map has no derivative, as with redundant constraints, that is not known."""
    try:
        defect = float(defect_of(ivp, solver, value))
    except RunFailed as error:
        return Kept(True, False, math.nan, f"not measured: {str(error).rstrip('.')}")
    return Kept(True, defect <= ROUND_OFF, defect, "defect over some steps")


def _energy(row: Row, over: str, *, claimed: bool) -> Kept:
    if row["failure"]:
        return Kept(claimed, False, math.nan, f"the run stops at t = {row['t_reached']:g} s")
    verdict = str(row["energy_verdict"])
    return Kept(claimed, verdict in (KEPT, BOUNDED), float(row["energy_error"]), f"error {over}, {verdict}")


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

    def effect(self, accuracy: float) -> str:
        """Return the error over the accuracy in words."""
        factor, failure = self.factor(accuracy), self.found.failure.partition(":")[0].partition(";")[0]
        if math.isnan(factor):
            return f"not known: {failure or 'no reference is good enough'}"
        return f"stops: {failure}" if factor == math.inf else f"{factor:.2g}"


def over_starts(asked: Callable[[], StartRuns], part: str, make: Make) -> OverStarts:
    """Return the errors of runs from many starts; none where they cannot be made, or the problem has no start, as a ring that is open."""
    try:
        specification = asked()
        row = make(specification)
    except DaebenchError as error:
        return OverStarts(failure=str(error))
    errors, bounds = (np.array(row[f"{name}_{part}"], dtype=float) for name in ("error", "bound"))
    largest = np.where(np.isfinite(errors), np.maximum(errors, bounds), math.inf)
    known = tuple(largest[np.isfinite(bounds)].tolist())
    failure = next(filter(None, row["failure"]), "") if isinstance(row["failure"], list) else str(row["failure"])
    return OverStarts(known, float(np.max(bounds)), failure, str(row.get("reference", "")), specification.members - len(known))


def changes(question: Question, method: str, knob: str, value: float, make: Make) -> list[Change]:
    """Return the choice as it is, and then the effect of each change, the worst first; changes with unknown effect come last."""
    as_is, *others = (Change(what, over_starts(asked, question.part, make)) for what, asked in _changed(question, method, knob, value))
    return [as_is, *sorted(others, key=lambda change: -np.nan_to_num(change.factor(question.accuracy), nan=-1.0, posinf=math.inf))]


def _changed(question: Question, method: str, knob: str, value: float) -> Iterator[tuple[str, Callable[[], StartRuns]]]:
    """Yield each change in words, and the runs with it; of the parameters, the first that are not zero are moved."""
    coarser, words = (2 * value, "step doubled") if knob == "h" else (10 * value, "tolerance times 10")
    yield NOTHING, partial(question.changed, method, value)
    yield words, partial(question.changed, method, coarser)
    yield f"horizon times {LONGER:g}", partial(question.changed, method, value, times=LONGER)
    for name, at in [(name, float(at)) for name, at in question.ivp.parameters.items() if float(at) != 0.0][:PARAMETERS]:
        for sign in (1, -1):
            moved = {name: at * (1 + sign * MOVED)}
            yield f"{name} {100 * sign * MOVED:+.0f} %", partial(question.changed, method, value, parameters=moved)
