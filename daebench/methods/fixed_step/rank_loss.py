"""A run of a fixed-step scheme on a constrained problem that monitors whether G keeps its rank."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from daebench.diagnostics.freedom import dependence
from daebench.diagnostics.passage import MOST_STATES, Crossing
from daebench.diagnostics.rank import AFTER_FAILURE, GO_ON, HEAVIER, WITHIN, badly_scaled, upcoming_loss, zero_of
from daebench.methods.fixed_step.stepping import Run
from daebench.runs.ivp import ConstrainedIvp
from daebench.runs.trajectory import Array
from daebench.schemes.kernels.rank import RANK_LOST


class RankRun(Run):
    """One run that stops where G loses rank within the next step, or goes on and notes which branch it took.

    The mode is one of :data:`daebench.runs.request.ON_SINGULAR`; all else is as for :class:`daebench.methods.fixed_step.stepping.Run`.
    """

    ivp: ConstrainedIvp

    def __init__(self, mode: str, *settings: Any, **more: Any) -> None:
        self.mode = mode
        super().__init__(*settings, **more)

    def _no_pivots(self) -> Any:
        return self.infinity, self.zero, self.zero

    @property
    def pivot(self) -> Any:
        """Smallest relative pivot so far."""
        return self.pivots[0]

    def _prepare(self) -> None:
        why = dependence(self.ivp) if self.mode != "least-squares" and not self.kernel.ELEMENTWISE else None
        super()._prepare()
        if why:
            self.status = RANK_LOST
            self.failure = self._stopped(f"G M^-1 G^T is singular at the start, where {why}")
        elif self.failure is None and (t := self._upcoming(WITHIN)) is not None:
            self._lose_rank(t)

    def _upcoming(self, within: int) -> float | None:
        """Return when G loses rank, if the present state tells that it does so within so many steps."""
        t = upcoming_loss(self.ivp, *self._state(), self.grid.h, within)
        return None if t is None else self.done * self.grid.h + t

    def sentence(self, report: Sequence[Any], tried: int) -> str:
        """Return why the run stopped; where G is about to lose rank, that is why."""
        sentence = super().sentence(report, tried)
        t = self._upcoming(AFTER_FAILURE)
        if t is not None and (light := badly_scaled(self.ivp, *self._state(), t - self.done * self.grid.h)):
            return f"{sentence[:-1]}; {light}."
        return sentence if t is None else f"{sentence[:-1]}; G loses rank at about t = {t:.9g}, which not every scheme and h can pass."

    def _lose_rank(self, t: float | None = None) -> None:
        """Stop before the step in which G loses rank, at about time t, or go on step by step until it is passed."""
        pivots = [float(pivot) for pivot in self.pivots[:0:-1]]
        if t is None:
            t = self._ahead + zero_of([(self.done - 1) * self.grid.h, self.done * self.grid.h], pivots)
        self.status = RANK_LOST if self.mode == "stop" else 0
        if light := badly_scaled(self.ivp, *self._state(), t - self.done * self.grid.h):
            if self.mode == "stop":
                near = f"G M^-1 G^T is nearly singular at about t = {t:.9g}, within the next steps of h = {self.grid.h:g}"
                self.failure = self._stopped(f"{near}; {light}; {HEAVIER}")
            return
        if self.mode == "stop":
            self.failure = self._stopped(f"G loses rank at about t = {t:.9g}, within the next steps of h = {self.grid.h:g}; {GO_ON}")
            return
        p, q = self._state()
        pivot = pivots[-1] or float(self.ivp.value("independence", p, q))
        crossing = Crossing(self.ivp, t, self.done * self.grid.h, p, q, pivot)
        for _ in range(min(MOST_STATES, self.grid.steps - self.done)):
            self._advance(1)
            if self.failure is not None:
                break
            crossing.add(self.done * self.grid.h, *self._state(), float(self.pivots[1]))
            if crossing.over:
                break
        self.passages.append(crossing.passage)

    @property
    def _ahead(self) -> float:
        """How far the substeps of a composition go beyond the end of its step: pivots, but not what one constraint tells, are of there."""
        if self.ivp.m == 1 or (self.ivp.arrays and not self.ivp.facts.EXPLICIT):
            return 0.0
        return self.grid.h * max(0.0, float(np.max(np.cumsum(self.linked.weights), initial=1.0)) - 1.0)

    def _state(self) -> tuple[Array, Array]:
        """Return p and q, shape(d,)."""
        row = np.asarray(self.linked.leave(self.x), dtype=float)
        return row[: self.ivp.d], row[self.ivp.d :]
