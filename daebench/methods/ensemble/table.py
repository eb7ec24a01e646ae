"""Outcomes of members, in arrays that runs in lanes and runs of single members fill."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from daebench.compiler.lane_entries import DONE, MAXIMA, PIVOTS, STATUS
from daebench.methods.ensemble.lanes import LaneRun
from daebench.methods.fixed_step.stepping import Run
from daebench.runs.grid import Grid
from daebench.runs.members import Members
from daebench.runs.trajectory import Array

STOPPED = -3
"""Status of a member that was not begun, or that a limit ended."""


class Table:
    """States, ends, steps, status, maxima, pivots and work of all members."""

    def __init__(self, members: Members, grid: Grid, names: Sequence[str], kinds: Sequence[str], columns: int) -> None:
        n, c = len(members), members.ivp.size
        self.index = np.unique([0, *(grid.every * np.arange(1, grid.rows + 1)), grid.steps])
        self.stored = grid.rows
        self.all_states = np.full((len(self.index), c, columns), np.nan)
        self.all_states[0, :, :n] = np.concatenate(members.start, axis=1).T
        self.ends = np.concatenate(members.start, axis=1)
        self.steps, self.status = np.zeros((2, n), dtype=np.int64)
        self.maxima, self.pivots = np.zeros((len(names), n)), np.full(n, np.inf)
        self.work = np.zeros((len(kinds), n), dtype=np.int64)
        self.seconds = 0.0
        self.sentences: dict[int, str] = {}

    @property
    def rows(self) -> Array:
        """Where the loop stores states, shape(rows, c, columns)."""
        return self.all_states[1 : 1 + self.stored]

    @property
    def states(self) -> Array:
        """All states, shape(k, n, c)."""
        return self.all_states[:, :, : len(self.ends)].transpose(0, 2, 1)

    def fill(self, run: LaneRun, ends: Array) -> None:
        """Take the outcomes of runs in lanes."""
        n, places = len(self.ends), run.places
        self.status, self.steps = run.counts[STATUS, :n].copy(), run.counts[DONE, :n].copy()
        self.maxima = run.numbers[places[MAXIMA] : places[PIVOTS], :n].copy()
        self.pivots, self.work, self.seconds = run.numbers[places[PIVOTS], :n].copy(), run.work(), run.seconds
        self.ends = ends
        self.states[self.index[:, None] > self.steps] = np.nan
        self._arrived(np.flatnonzero(self.status == 0))

    def _arrived(self, members: Any) -> None:
        """Put the ends of members that came to their end behind the other states, where they are not yet there."""
        if len(self.index) > 1 + self.stored:
            self.all_states[-1, :, members] = self.ends[members]

    def fill_one(self, i: int, run: Run) -> None:
        """Let a run of one member by itself go on to its end, and take what it comes to."""
        outcome: Mapping[str, Any] = run.outcome()
        self.ends[i] = np.asarray(run.linked.leave(run.x), dtype=float) if run.done else self.ends[i]
        self.steps[i], self.pivots[i] = outcome["steps"], np.inf if outcome["pivot"] is None else outcome["pivot"]
        self.maxima[:, i] = list(outcome["maxima"].values())
        if run.request.count:
            self.work[:, i] = list(outcome["work"].values())
        self.seconds += outcome["seconds"]
        self.status[i] = (run.status or STOPPED) if outcome["failure"] else 0
        if outcome["failure"]:
            self.sentences[i] = outcome["failure"]
        self.rows[:, :, i] = np.nan
        self.rows[: run.row, :, i] = run.state_rows[: run.row]
        if not outcome["failure"]:
            self._arrived([i])

    def refuse(self, i: int, why: str) -> None:
        """Take that a member was not begun."""
        self.status[i], self.sentences[i] = STOPPED, why
