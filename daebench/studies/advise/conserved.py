"""Conserved quantities of a choice: by its claim, and as measured over ten times the horizon."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from daebench.diagnostics.drift import BOUNDED, KEPT
from daebench.errors import RunFailed
from daebench.runs.ivp import Ivp
from daebench.studies.advise.question import LONGER, Question
from daebench.studies.advise.search import Make, Row
from daebench.studies.grid.claimed import claimed
from daebench.studies.grid.metrics import defect_of
from daebench.studies.work_precision.study import EPS, ROUND_OFF

OUTPUTS = 256
"""States of the long run that are looked at: enough for oscillations of the energy to be told from its drift."""


@dataclass(frozen=True)
class Kept:
    """Whether a quantity is conserved, and the evidence.

    Parameters
    ----------
    thing : str
        "energy", "constraints", "casimirs" or "two_form".
    claim, measured : bool
        Whether the method claims it, and whether the measurement confirms it.
    value : float
        What was measured: an error or a defect.
    words : str
        What it is, and over which time.
    """

    thing: str
    claim: bool
    measured: bool
    value: float
    words: str

    @property
    def kept(self) -> bool:
        """Whether it is claimed and confirmed."""
        return self.claim and self.measured

    def plain(self) -> dict[str, Any]:
        """Return it for JSON."""
        return {"kept": self.kept, "claimed": self.claim, "measured": self.measured, "value": self.value, "words": self.words}


def long_run(question: Question, method: str, value: float, make: Make) -> Row:
    """Return the row of the run over ten times the horizon."""
    metrics = ("energy", question.ivp.state.conserved)
    return make(replace(question.run(method, value, repeat=0, times=LONGER, metrics=metrics), outputs=OUTPUTS))


def keeps(question: Question, method: str, value: float, make: Make) -> dict[str, Kept]:
    """Return how well a method conserves each quantity of the problem at a step size or tolerance, by quantity."""
    solver, ivp = question.solver(method), question.ivp
    claims, row = claimed(ivp, solver), long_run(question, method, value, make)
    over = f"over {LONGER * question.t_end:g} s"
    ended = not row["failure"]
    conserved = {"energy": _energy(row, over, ended=ended, claim="energy" in claims)}
    if question.ivp.on_manifold:
        off = float(np.max([row["g"], row["Gv"]]))
        conserved["constraints"] = Kept("constraints", "constraints" in claims, ended and off <= ROUND_OFF, off, f"|g|, |G v| {over}")
    elif np.isfinite(row["casimirs"]):
        off, most = float(row["casimirs"]), max(ROUND_OFF, EPS * float(row["steps"]))
        conserved["casimirs"] = Kept("casimirs", "casimirs" in claims, ended and off <= most, off, f"error {over}")
    if solver.knob == "h" and "two_form" in claims:
        conserved["two_form"] = _two_form(ivp, solver, value)
    return conserved


def _two_form(ivp: Ivp, solver: Any, value: float) -> Kept:
    """Return whether the two-form is conserved; where the map has no derivative, as with redundant constraints, that is not known."""
    try:
        defect = float(defect_of(ivp, solver, value))
    except RunFailed as error:
        return Kept("two_form", True, False, float("nan"), f"not measured: {str(error).rstrip('.')}")
    return Kept("two_form", True, defect <= ROUND_OFF, defect, "defect over some steps")


def _energy(row: Row, over: str, *, ended: bool, claim: bool) -> Kept:
    if not ended:
        return Kept("energy", claim, False, float("nan"), f"the run stops at t = {row['t_reached']:g} s")
    verdict = str(row["energy_verdict"])
    return Kept("energy", claim, verdict in (KEPT, BOUNDED), float(row["energy_error"]), f"error {over}, {verdict}")
