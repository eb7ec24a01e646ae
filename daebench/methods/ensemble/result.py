"""The results of the runs of all members of an ensemble, and the arrays that runs in lanes and runs of single members fill."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.compiler.entry_points import DONE, MAXIMA, PIVOTS, STATUS
from daebench.methods.ensemble.lanes import LaneRun
from daebench.methods.fixed_step.reasons import IN_SHORT
from daebench.methods.fixed_step.stepping import Run
from daebench.runs.grid import Grid
from daebench.runs.members import Members
from daebench.runs.trajectory import Array


@dataclass(frozen=True)
class EnsembleRun:
    """The runs of n members, each of N steps.

    Parameters
    ----------
    members : Members
        The members.
    method : str
        Name in the grammar of methods.
    index : ndarray, shape(k,)
        Numbers of steps after which states are stored, from 0 to N.
    states : ndarray, shape(k, n, c)
        States, as (p, q) or y; NaN where a member had stopped before.
    ends : ndarray, shape(n, c)
        Last good state of each member.
    steps : ndarray of int, shape(n,)
        Steps that each member took.
    status : ndarray of int, shape(n,)
        0 if a member reached its end.
    maxima : mapping of str to ndarray, shape(n,)
        Largest moduli of the errors that were monitored, by name.
    pivots : ndarray, shape(n,)
        Smallest relative pivot of each member; infinite if no linear system was solved.
    work : mapping of str to ndarray of int, shape(n,)
        Evaluations, solves and iterations by kind; empty where they were not counted.
    seconds, compile_seconds : float
        CPU time of the loops over steps, on all cores together, and wall time until they began, s.
    lanes : int
        Number of members at once on one core; 1 if they were run one by one.
    sentence : callable
        ``sentence(i)`` says why a member stopped.
    """

    members: Members
    method: str
    index: NDArray[np.int64]
    states: Array
    ends: Array
    steps: NDArray[np.int64]
    status: NDArray[np.int64]
    maxima: Mapping[str, Array]
    pivots: Array
    work: Mapping[str, NDArray[np.int64]]
    seconds: float
    compile_seconds: float
    lanes: int
    sentence: Callable[[int], str] = field(repr=False)

    @property
    def t(self) -> Array:
        """Times of the stored states, s, shape(k,), or shape(k, n) where members have their own step sizes."""
        times: Array = np.multiply.outer(self.index.astype(float), self.members.h)
        return times

    def reason(self, i: int) -> str:
        """Return the reason in two or three words; "" if a member reached its end."""
        status = int(self.status[i])
        return IN_SHORT.get(status, "not begun" if not self.steps[i] else "stopped") if status else ""

    def failure(self, i: int) -> str | None:
        """Return why a member stopped early, None if it did not."""
        return self.sentence(i) if self.status[i] else None

    @property
    def failed(self) -> NDArray[np.int64]:
        """Members that stopped early, by number."""
        return np.flatnonzero(self.status)


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
