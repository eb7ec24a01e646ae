"""The error of the position along a run, or of the state of a Poisson system, and a description of its reference."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.errors import DaebenchError, RunFailed
from daebench.reference.keep.dense_evaluation import states_at
from daebench.reference.solution import certified_for, own_run
from daebench.runs.ivp import Ivp
from daebench.runs.request import Request
from daebench.runs.trajectory import Array, Outcome

Places = NDArray[np.intp]
Known = Callable[[Outcome, Places], tuple[Array, float, str]]
"""From a run and some of its outputs to the states there, what these may be wrong by, and what they are."""

OUTPUTS = 64
"""Approximate number of times at which a run is compared with its reference."""

LOST = 1e-2
"""Bound of a reference, in parts of the largest coordinate, with which the motion itself is no longer known."""

SAFETY = 2.0
"""The bound of a method's own finer run is so many times its difference from the one before."""

FINER = {"h": (2, 4), "tol": (10, 100)}
"""A method's own finer runs have its step size or tolerance divided by these: with fixed steps they cost six times as much as the run."""


@dataclass(frozen=True)
class PositionError:
    """Position error of a run."""

    value: float
    """Largest error of a coordinate at the times that are compared, and never less than ``bound``; NaN where it is not known."""
    bound: float
    """Error bound of the reference; NaN if there is none."""
    reference: str
    """Description of the reference, or why there is no number."""


STOPPED = PositionError(math.nan, math.nan, "")
"""Of a run that did not come to its end."""


def position_errors(ivp: Ivp, methods: Sequence[Any], runs: Sequence[Outcome]) -> list[PositionError]:
    """Return the error of each run of a comparison.

    The reference is the certified one where it has this definition, case, parameters and start and reaches the end; else the problem's
    closed form, or two tight runs of DOP853; and where these take too many calls, the method's own runs with h/2 and h/4. The bound of
    the last is twice the difference of these two, which is as large as its error for a method of order 1, and larger for others. Where a
    reference is lost itself, as on a chaotic motion, the error is not known.
    """
    known = _common(ivp, [run for run in runs if _whole(run)])
    errors = []
    for method, run in zip(methods, runs, strict=True):
        if not _whole(run):
            errors.append(STOPPED)
        elif known:
            where = _places(run)
            errors.append(_held(run.position[where], *known(run, where)))
        else:
            errors.append(_against_itself(ivp, method, run))
    return errors


def _whole(run: Outcome) -> bool:
    return run.failure is None and len(run.t) > 1


def _places(run: Outcome) -> Places:
    """Return which outputs are compared: evenly spaced, the last among them, the start not."""
    return np.unique(np.linspace(0, len(run.t) - 1, OUTPUTS + 1).round().astype(int))[1:]


def _common(ivp: Ivp, runs: Sequence[Outcome]) -> Known | None:
    """Return the reference for all runs; None if there is none."""
    if not runs:
        return None
    times = np.unique(np.concatenate([run.t[_places(run)] for run in runs]))
    known: Any
    if reference := certified_for(ivp, max(float(run.t[-1]) for run in runs)):
        known, words = states_at(reference, times), f"certified {reference.name}"
    else:
        try:
            known = own_run(ivp, times)
        except RunFailed:
            return None
        words = known.words

    part = ivp.state.position

    def found(run: Outcome, where: Places) -> tuple[Array, float, str]:
        rows = np.searchsorted(times, run.t[where])
        return known.states[part][rows], float(np.max(known.bound[part][rows])), words

    return found


def _held(states: Array, known: Array, bound: float, words: str) -> PositionError:
    """Return the error of states against known ones; it is not known where these are lost themselves and no farther from them."""
    off, size = float(np.max(np.abs(states - known))), float(np.max(np.abs(known))) or 1.0
    if not np.isfinite(off) or bound > max(LOST * size, off):
        return PositionError(math.nan, bound, f"unknown: {words} may itself be wrong by {bound:.1e}")
    return PositionError(max(off, bound), bound, words)


def _against_itself(ivp: Ivp, method: Any, run: Outcome) -> PositionError:
    """Return the error of a run against finer runs of the same method."""
    words = f"own run with {run.knob}/{FINER[run.knob][1]}"
    try:
        near, nearer = (method.solve(ivp, _finer(run, divisor)) for divisor in FINER[run.knob])
    except DaebenchError as error:
        return PositionError(math.nan, math.nan, f"unknown: {words} is refused: {error}")
    if near.failure or nearer.failure:
        return PositionError(math.nan, math.nan, f"unknown: {words} stops early")
    where = _places(run)
    known = nearer.position[where]
    bound = SAFETY * float(np.max(np.abs(near.position[where] - known)))
    return _held(run.position[where], known, bound, words)


def _finer(run: Outcome, divisor: int) -> Request:
    """Return a request for the outputs of a run with its step size or tolerance divided."""
    if run.knob == "tol":
        return Request(value=run.value / divisor, t_end=float(run.t[-1]), points=len(run.t), watch=(), count=False)
    every = divisor * round(float(run.t[1]) / run.value)
    return Request(value=run.value / divisor, steps=divisor * run.steps, every=every, watch=(), count=False)
