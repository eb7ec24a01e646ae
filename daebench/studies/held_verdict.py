"""The verdict on the energy where a method claims to keep the two-form: a drift counts if a run of ten times the length drifts as well.

Backward analysis bounds the energy error of a symplectic method over long times, and its oscillation on a chaotic motion is irregular: over
a short time a part of it looks like a drift. Only runs that drift are made longer; all others cost nothing.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.diagnostics.drift import DRIFTS, UNDETERMINED, Drift
from daebench.diagnostics.energy_verdict import energy_verdict
from daebench.errors import DaebenchError
from daebench.methods.ensemble.result import EnsembleRun
from daebench.methods.ensemble.run import run_members
from daebench.runs.ivp import Ivp
from daebench.runs.request import Request
from daebench.runs.trajectory import PoissonTrajectory, Trajectory
from daebench.studies.ensemble.energies import ended_members, member_energies
from daebench.studies.grid.claimed import claimed

LONGER = 10
"""Length of a run that confirms a drift, in lengths of the run that shows it."""

NUMBERS = 2**24
"""Numbers of states of longer runs that are in memory at a time."""

SHORT = f"too short: the method claims to keep the two-form, and a run of {LONGER} times the length does not drift"
"""Why a drift is not confirmed."""

UNKNOWN = f"the method claims to keep the two-form, and whether a run of {LONGER} times the length drifts is not known"
"""Why it is not known whether a drift is confirmed; the reason follows."""


def held_verdict(ivp: Ivp, method: Any, request: Request, run: Trajectory | PoissonTrajectory) -> Drift:
    """Return the verdict on an energy error; "drifts" is "undetermined" where the two-form is claimed and a longer run has none."""
    drift = energy_verdict(ivp, run)
    if drift.verdict != DRIFTS or "two_form" not in claimed(ivp, method):
        return drift
    try:
        longer = method.solve(ivp, _longer(request, run.steps))
    except DaebenchError as error:
        return drift.undecided(f"{UNKNOWN}: {error}")
    with np.errstate(all="ignore"):  # a motion that is lost may have squares that overflow
        later = energy_verdict(ivp, longer)
    if later.verdict == DRIFTS:
        return drift
    return drift.undecided(f"{UNKNOWN}: {later.reason}" if later.reason else SHORT)


def held_verdicts(
    verdicts: Sequence[str], run: EnsembleRun, some: NDArray[np.int64], method: Any, request: Request, threads: int | None = None
) -> list[str]:
    """Return the verdicts on some members of an ensemble, by their numbers, as :func:`held_verdict` gives them for runs by themselves."""
    words = np.array(verdicts, dtype="U12")
    drifting = np.flatnonzero(words == DRIFTS)
    if not len(drifting) or "two_form" not in claimed(run.members.ivp, method):
        return list(verdicts)
    asked = _longer(request, int(run.index[-1]))
    at_once = max(1, NUMBERS // (LONGER * len(run.index) * run.members.ivp.size))
    for k in range(0, len(drifting), at_once):
        part = drifting[k : k + at_once]
        longer = run_members(method, run.members.some(some[part]), asked, lanes=run.lanes, threads=threads)
        with np.errstate(all="ignore"):
            ended = ended_members(longer)
            agree = np.array(member_energies(longer, ended)["energy_verdict"] if len(ended) else [], dtype="U12") == DRIFTS
        words[np.setdiff1d(part, part[ended[agree]])] = UNDETERMINED
    return [str(word) for word in words]


def _longer(request: Request, steps: int) -> Request:
    """Return the same request for ten times as many steps, with what compiles nothing anew."""
    return replace(request, t_end=None, steps=LONGER * steps, progress=None, raw=False, looks=0, keep_interrupted=True)
