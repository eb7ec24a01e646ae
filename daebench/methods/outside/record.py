"""The record of a run of code from outside: its states as they come, the largest errors, and why it stopped; or samples of its energy."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.errors import BadInput, Stopped, bounded
from daebench.methods.fixed_step.reasons import REASONS
from daebench.methods.fixed_step.stepping import next_piece
from daebench.methods.monitored_errors import monitored_errors, monitored_names
from daebench.runs.grid import Grid
from daebench.runs.ivp import Ivp
from daebench.runs.request import Request
from daebench.runs.trajectory import Array, Passage

NOT_FINITE, (MONITORED_NOT_FINITE, SMALLER) = REASONS[3][0], REASONS[4]
"""Why a run stops at numbers that are not finite, in a state and in what is monitored, and what to do."""


@dataclass(frozen=True)
class Block:
    """States after some steps, as code from outside gave them."""

    steps: NDArray[np.int64]
    """Numbers of the steps after which they are; shape (k,)."""
    rows: Array
    """The states: p and q, or y; shape (k, size)."""
    seconds: float
    """Time that these steps took, s."""


Blocks = Callable[[Ivp, Grid, Request], Iterator[Block]]
"""Runs the code from the start of a problem over a grid; may end with :class:`daebench.errors.Stopped`."""


class Record:
    """Results of a run so far: largest errors over all states, and the states that are kept."""

    def __init__(self, name: str, ivp: Ivp, request: Request, grid: Grid, *, every_step: bool, knob: str = "h") -> None:
        self.knob = knob
        self.name, self.ivp, self.request, self.grid, self.every_step = name, ivp, request, grid, every_step
        self.monitored = request.watched(ivp.state)
        self.start = np.concatenate(ivp.start)[None]
        self.steps, self.rows = [np.zeros(1, dtype=np.int64)], [self.start]
        self.last_step, self.last = 0, self.start[0]
        self.maxima = np.zeros(len(monitored_names(self.monitored, ivp)))
        self.seconds, self.failure, self.interrupted = 0.0, "", False

    def outcome(self, blocks: Blocks) -> dict[str, Any]:
        """Run the code, and return what a trajectory of any kind says of it.

        BadInput is raised if the first output of the code is not a state; later, the run has failed, and keeps its states.
        """
        try:
            self._follow(blocks)
        except (Stopped, BadInput) as stop:
            if isinstance(stop, BadInput) and not self.last_step:
                raise
            self.failure = self._sentence(stop)
        except KeyboardInterrupt:
            if not self.request.keep_interrupted:
                raise
            self.failure, self.interrupted = self._sentence(Stopped("interrupted")), True
        return {
            "problem": self.ivp.problem,
            "case": self.ivp.case,
            "method": self.name,
            "parameters": dict(self.ivp.parameters),
            "knob": self.knob,
            "value": self.request.value,
            "steps": self.last_step,
            "maxima": dict(zip(monitored_names(self.monitored, self.ivp), map(float, self.maxima), strict=True)),
            "maxima_over": "steps" if self.every_step else "outputs",
            "seconds": self.seconds,
            "failure": self.failure or None,
            "interrupted": self.interrupted,
        }

    def states(self) -> tuple[Array, Array]:
        """Return the times and the rows of states: the start, those that are kept, and the end."""
        steps, rows = np.concatenate(self.steps), np.concatenate(self.rows)
        if steps[-1] != self.last_step:
            steps, rows = np.append(steps, self.last_step), np.concatenate([rows, self.last[None]])
        return self.grid.times(steps), rows

    def _follow(self, blocks: Blocks) -> None:
        for block in blocks(self.ivp, self.grid, self.request):
            self._take(block)
            if self.request.progress:
                self.request.progress(self.last_step / self.grid.steps)

    def _sentence(self, why: Exception) -> str:
        return stopped_sentence(self.name, self.ivp, self.grid, self.last_step, why, every_step=self.every_step)

    def _take(self, block: Block) -> None:
        """Monitor and store a block of states; stop at the first that is not finite."""
        self.seconds += block.seconds
        if not len(block.rows):
            return
        whole = finite(block.rows)
        errors = self._errors(block.rows[:whole])
        count = finite(errors)
        if count:
            steps, rows = block.steps[:count], block.rows[:count]
            self.maxima = np.maximum(self.maxima, errors[:count].max(axis=0))
            # A copy, because a view of one row would keep the whole block in memory.
            self.last_step, self.last = int(steps[-1]), rows[-1].copy()
            stored = steps % self.grid.every == 0 if self.grid.every else np.full(count, False)
            self.steps.append(steps[stored])
            self.rows.append(rows[stored])
        if count < len(block.rows):
            raise Stopped(MONITORED_NOT_FINITE if count < whole else NOT_FINITE, advice=SMALLER)

    def _errors(self, rows: Array) -> Array:
        """Return the monitored errors of states, shape(k, number of errors)."""
        states = np.split(np.concatenate([self.start, rows]), len(self.ivp.start), axis=1)
        return monitored_errors(self.ivp, self.monitored, *states)[1:]


def stopped_sentence(name: str, ivp: Ivp, grid: Grid, done: int, why: Exception, *, every_step: bool = True) -> str:
    """Return where and why a run stopped after so many steps; where states are known at outputs alone, after which of them."""
    if grid.end is not None:
        return bounded(
            f"{name} on {ivp.problem}, case {ivp.case}, stopped after t = {done * grid.h:.9g} of {grid.end:g}: {str(why).rstrip('.')}."
        )
    when, step = ("at", min(done + 1, grid.steps)) if every_step else ("after", done)
    where = f"stopped {when} t = {done * grid.h:.9g} (step {step} of {grid.steps}, h = {grid.h:g})"
    advice = f"; {why.advice}" if isinstance(why, Stopped) and why.advice else ""
    return bounded(f"{name} on {ivp.problem}, case {ivp.case}, {where}: {str(why).rstrip('.')}{advice}.")


def finite(rows: Array) -> int:
    """Return how many rows there are before the first that is not finite."""
    broken = np.flatnonzero(~np.isfinite(rows).all(axis=1))
    return int(broken[0]) if len(broken) else len(rows)


Carried = tuple[tuple[Array, ...], tuple[float, ...]]
"""The state, and H at the start."""


class SampledRun:
    """One run of code that remembers nothing but its state, with the attributes of :class:`daebench.methods.fixed_step.stepping.Run`."""

    rank_pending = False

    def __init__(self, name: str, blocks: Blocks, ivp: Ivp, request: Request, grid: Grid) -> None:
        self.name, self.blocks, self.ivp, self.request, self.grid = name, blocks, ivp, request, grid
        self.state: tuple[Array, ...] = ivp.start
        self.conserved: tuple[float, ...] = (float(self._energies(np.concatenate(ivp.start)[None])[0]),)
        self.state_rows = np.empty((grid.rows, 1))
        self.done, self.row, self.left = 0, 0, grid.every
        self.seconds, self._piece = 0.0, 1
        self.failure: str | None = None
        self.passages: list[Passage] = []

    @property
    def carried(self) -> Carried:
        """All numbers that go from one step into the next."""
        return self.state, self.conserved

    @carried.setter
    def carried(self, numbers: Carried) -> None:
        self.state, self.conserved = numbers

    def piece(self, steps: int) -> float:
        """Take so many steps, or as many as are left, or as take about a fifth of a second; return the seconds that the code took.

        BadInput is raised where already the first step gives no state; later, the run has failed.
        """
        before, start, began = self.seconds, self.done, time.perf_counter()
        grid = Grid(self.grid.h, min(steps, self._piece, self.grid.steps - start), 1)
        try:
            for block in self.blocks(self.ivp.at(*self.state), grid, self.request):
                self._sample(block, start)
        except (Stopped, BadInput) as stop:
            if isinstance(stop, BadInput) and not self.done:
                raise
            self.failure = stopped_sentence(self.name, self.ivp, self.grid, self.done, stop)
        self._piece = next_piece(grid.steps, time.perf_counter() - began)
        return self.seconds - before

    def _sample(self, block: Block, start: int) -> None:
        """Take the energies of a block of states, whose steps are counted from ``start``."""
        count = finite(block.rows)
        rows, steps = block.rows[:count], start + block.steps[:count]
        self.seconds += block.seconds
        if count:
            energies = self._energies(rows[steps % self.grid.every == 0])
            self.state_rows[self.row : self.row + len(energies), 0] = energies
            self.row += len(energies)
            self.done = int(steps[-1])
            self.left = self.grid.every - self.done % self.grid.every
            self.state = tuple(np.split(rows[-1].copy(), len(self.state)))
        if count < len(block.rows):
            raise Stopped(NOT_FINITE, advice=SMALLER)

    def _energies(self, rows: Array) -> Array:
        """Return H of states, shape(k,)."""
        return self.ivp.along("H", *np.split(rows, len(self.state), axis=1)) if len(rows) else np.empty(0)
