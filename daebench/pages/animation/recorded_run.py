"""A run as it is shown: its state at each time that is shown, and the largest errors since the one before."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from daebench.diagnostics.along import errors_along
from daebench.methods.fixed_step.stepping import Run, next_piece
from daebench.methods.outside.method import OutsideMethod
from daebench.runs.grid import EPS
from daebench.runs.ivp import Ivp
from daebench.runs.request import Progress, Request
from daebench.runs.trajectory import Array

WITHIN = 8
"""Outputs of a tolerance-driven method for each time that is shown."""

MOST_OUTPUTS = 200_000
"""Outputs of a whole run, about, where a method gives them and not each step."""


@dataclass(frozen=True)
class RecordedRun:
    """A run of one method as it is shown."""

    method: str
    knob: str
    """Name of the method, and its control parameter."""
    value: float
    """Value of the knob."""
    t: Array
    """Times of the states, the first 0; shape (n,)."""
    states: Array
    """Positions q, or states y of a Poisson system; shape (n, ...)."""
    errors: dict[str, Array]
    """By name in :data:`daebench.diagnostics.along.LABELS`, the largest modulus after the time before, up to this one; shape (n,).
    """
    over: str
    """"steps" or "outputs": what the largest was taken over."""
    failure: str | None
    """Why it stopped early, as a sentence."""

    def shown(self, times: Array) -> Any:
        """Return the number of the state that is shown at each of these times: the last that is not later."""
        return _latest(self.t, times)


def _latest(t: Array, times: Array) -> Any:
    """Return the number of the last of increasing times t that is not later, but for rounding, than each of the others."""
    return np.searchsorted(t, times * (1 + 4 * EPS) + 1e-9 * times[1], side="right") - 1


def requested(ivp: Ivp, method: Any, value: float, times: Array) -> Request:
    """Return the request to a method for output at these times."""
    t_end = float(times[-1])
    if method.knob == "tol":
        return Request(value=value, t_end=t_end, points=WITHIN * (len(times) - 1) + 1, watch=())
    steps = t_end / value if value > 0 else 0.0
    every = 0 if _has_steps(method) else max(1, int(min(steps, 2.0**52) / MOST_OUTPUTS))
    return Request(value=value, t_end=t_end, every=every, watch=ivp.state.monitors)


def _has_steps(method: Any) -> bool:
    """Return whether each step of a method is monitored as it is taken; code from outside is monitored in its outputs."""
    return hasattr(method, "begin") and not isinstance(method, OutsideMethod)


def recorded_run(ivp: Ivp, method: Any, value: float, times: Array, progress: Progress) -> RecordedRun:
    """Return a run of a method as it is shown at these times, the first 0."""
    request = requested(ivp, method, value, times)
    if _has_steps(method):
        grid = method.grid(ivp, request)
        return _stepped(ivp, method.begin(ivp, request, grid, request.watch), times, progress)
    run = method.solve(ivp, request)
    progress(1.0)
    return _sampled(ivp, run, times)


def _stepped(ivp: Ivp, run: Run, times: Array, progress: Progress) -> RecordedRun:
    """Return a run with fixed steps, each of which is monitored."""
    goals = np.unique(np.minimum(np.floor(times / run.grid.h * (1 + 4 * EPS) + 1e-9).astype(np.int64), run.grid.steps))
    done, rows, maxima = [0], [np.concatenate(ivp.start)], [_at_start(ivp, run.names)]
    for goal in goals[1:]:
        _reach(run, int(goal))
        progress(run.done / run.grid.steps)
        if run.done > done[-1]:
            done.append(run.done)
            rows.append(np.asarray(run.linked.leave(run.x), dtype=float))
            maxima.append(list(map(float, run.maxima)))
        if run.failure is not None:
            break
        # The loop takes maxima since the start, but a curve shows those since the state before.
        run.maxima = tuple(run.zero for _ in run.names)
    states = np.array(rows)[:, ivp.size - len(ivp.start[-1]) :]
    errors = _named(ivp, run.names, np.array(maxima))
    return RecordedRun(run.linked.name, "h", run.grid.h, np.array(done) * run.grid.h, states, errors, "steps", run.failure)


def _reach(run: Run, goal: int) -> None:
    """Take steps until so many are done, in pieces of a fifth of a second."""
    piece = 64
    while run.done < goal and run.failure is None:
        piece = next_piece(piece, run.piece(min(piece, goal - run.done)))


def _at_start(ivp: Ivp, names: Sequence[str]) -> list[float]:
    """Return the monitored quantities at the start: how far it is off the manifold, and else 0."""
    vanishing = {"g": ivp.start[1:], "Gv": ivp.start} if ivp.on_manifold else {}
    return [float(np.abs(ivp.value(name, *vanishing[name])).max()) if name in vanishing else 0.0 for name in names]


def _named(ivp: Ivp, names: Sequence[str], maxima: Array) -> dict[str, Array]:
    """Return columns of maxima by name in ``LABELS``: of several Casimir functions or integrals the largest."""
    labels = {"energy": "energy_error", "g": "g", "Gv": "Gv"}
    if not ivp.on_manifold:
        labels |= dict.fromkeys(ivp.casimirs, "casimir_error") | dict.fromkeys(ivp.integrals, "integral_error")
    columns: dict[str, Array] = {}
    for name, column in zip(names, maxima.T, strict=True):
        if name in labels:
            columns[labels[name]] = np.maximum(columns.get(labels[name], column), column)
    return columns


def _sampled(ivp: Ivp, run: Any, times: Array) -> RecordedRun:
    """Return a run of which outputs are known."""
    at = np.unique([*_latest(run.t, times), len(run.t) - 1])
    since = np.concatenate([[0], at[:-1] + 1])
    errors = {name: np.maximum.reduceat(values, since) for name, values in errors_along(ivp, run).items()}
    return RecordedRun(run.method, run.knob, run.value, run.t[at], run.position[at], errors, "outputs", run.failure)
