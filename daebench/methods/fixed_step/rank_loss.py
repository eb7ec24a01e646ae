"""A run of a fixed-step scheme on a constrained problem that monitors whether G keeps its rank."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from daebench.diagnostics.freedom import dependence
from daebench.diagnostics.passage import MOST_STATES, Crossing
from daebench.diagnostics.rank import (
    AFTER_FAILURE,
    GO_ON,
    HEAVIER,
    SMALLER,
    TOO_LARGE,
    WITHIN,
    badly_scaled,
    loses_rank,
    upcoming_loss,
    zero_of,
)
from daebench.diagnostics.unit_rows import beyond_comparison, rank_of, unit_rows
from daebench.methods.fixed_step.reasons import TURNED
from daebench.methods.fixed_step.stepping import Run
from daebench.runs.ivp import ConstrainedIvp
from daebench.runs.trajectory import Array
from daebench.schemes.kernels.newton import SINGULAR
from daebench.schemes.kernels.rank import RANK_LOST


def loss_at_start(ivp: ConstrainedIvp, mode: str, kernel: Any, h: float) -> tuple[str | None, float | None]:
    """Return a sentence on dependent constraints at the start, and the time of a loss of rank within the next steps; None for neither."""
    why = dependence(ivp) if mode != "least-squares" and not kernel.ELEMENTWISE else None
    return why, upcoming_loss(ivp, ivp.p0, ivp.q0, h, WITHIN)


class RankRun(Run):
    """One run that stops where G loses rank within the next step, or goes on and notes which branch it took.

    The mode is one of :data:`daebench.runs.request.ON_SINGULAR`; all else is as for :class:`daebench.methods.fixed_step.stepping.Run`.
    """

    ivp: ConstrainedIvp

    def __init__(self, mode: str, loss: tuple[str | None, float | None], *settings: Any, **more: Any) -> None:
        self.mode, self.loss = mode, loss
        super().__init__(*settings, **more)

    def _no_pivots(self) -> Any:
        return self.infinity, self.zero, self.zero

    @property
    def pivot(self) -> Any:
        """Smallest relative pivot so far."""
        return self.pivots[0]

    def _prepare(self) -> None:
        why, t = self.loss
        super()._prepare()
        if why:
            self.status = RANK_LOST
            self.failure = self._stopped(f"G M^-1 G^T is singular at the start, where {why}")
        elif self.failure is None and t is not None:
            self._lose_rank(t)

    def _upcoming(self, within: int) -> float | None:
        """Return the time at which G loses rank, if the present state predicts it within this number of steps; else None."""
        t = upcoming_loss(self.ivp, *self._state(), self.grid.h, within)
        return None if t is None else self.done * self.grid.h + t

    def sentence(self, report: Sequence[Any], tried: int) -> str:
        """Return why the run stopped: G is about to lose rank or, if it is not and the step is singular, the step is too large."""
        t = self._upcoming(AFTER_FAILURE)
        # A light mass comes before a loss of rank: it makes G M^-1 G^T nearly singular, too, and a smaller h resolves it.
        if t is not None and (light := badly_scaled(self.ivp, *self._state(), t - self.done * self.grid.h)):
            return f"{super().sentence(report, tried)[:-1]}; {light}."
        if t is not None and self._loses_rank(AFTER_FAILURE):
            return f"{super().sentence(report, tried)[:-1]}; G loses rank at about t = {t:.9g}, which not every scheme and h can pass."
        if report[0] == SINGULAR and self._keeps_rank():
            return self.linked.failure(self.ivp, self.grid.h, self.done, self.grid.steps, tried, (TURNED, *report[1:]))
        return super().sentence(report, tried)

    def _loses_rank(self, within: int) -> bool:
        """Return whether G itself loses rank on the way through the present state, in the last step or the next ones."""
        return loses_rank(self.ivp, *self._state(), abs(self.grid.h), within * abs(self.grid.h))

    def _keeps_rank(self) -> bool:
        """Return whether G has full rank at the present state, and keeps it for some steps."""
        if beyond_comparison(self.ivp) or self.mode == "least-squares":
            return False
        return rank_of(unit_rows(self.ivp, self._state()[1])) == self.ivp.m and not self._loses_rank(AFTER_FAILURE)

    def _lose_rank(self, t: float | None = None) -> None:
        """Stop before the step in which G loses rank, at about time t, or go on step by step until it is passed."""
        # In the order of time: the record has the latest first, behind the smallest so far.
        pivots = [float(pivot) for pivot in self.pivots[:0:-1]]
        if t is None:
            t = self._ahead + zero_of([(self.done - 1) * self.grid.h, self.done * self.grid.h], pivots)
        place = f"at about t = {t:.9g}, within the next steps of h = {self.grid.h:g}"
        if light := badly_scaled(self.ivp, *self._state(), t - self.done * self.grid.h):
            self._stop_there(RANK_LOST, f"G M^-1 G^T is nearly singular {place}; {light}; {HEAVIER}")
        elif not self._loses_rank(WITHIN):
            self._stop_there(TURNED, f"{TOO_LARGE}, {place}; {SMALLER}")
        elif self.mode == "stop":
            self._stop_there(RANK_LOST, f"G loses rank {place}; {GO_ON}")
        else:
            self._pass(t, pivots[-1])

    def _stop_there(self, status: int, why: str) -> None:
        """Stop the run, but for one that is to go on."""
        if self.mode == "stop":
            self.status, self.failure = status, self._stopped(why)

    def _pass(self, t: float, pivot: float) -> None:
        """Go on step by step until the place is passed, and note the branch."""
        p, q = self._state()
        # The record has 0 before the first steps; the measure itself is then evaluated.
        crossing = Crossing(self.ivp, t, self.done * self.grid.h, p, q, pivot or float(self.ivp.value("independence", p, q)))
        # Step by step, because pivots of single steps show when the place is passed.
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
        """Time by which substeps of a composition exceed its step; pivots are of that time, the measure of one constraint is not."""
        if self.ivp.m == 1 or (self.ivp.arrays and not self.ivp.facts.EXPLICIT):
            return 0.0
        return self.grid.h * max(0.0, float(np.max(np.cumsum(self.linked.weights), initial=1.0)) - 1.0)

    def _state(self) -> tuple[Array, Array]:
        """Return p and q, shape(d,)."""
        row = np.asarray(self.linked.leave(self.x), dtype=float)
        return row[: self.ivp.d], row[self.ivp.d :]
