"""A run of code from outside whose energy is sampled: a long run takes it piece by piece, and goes on from its last state."""

import time

import numpy as np

from daebench.errors import BadInput
from daebench.methods.fixed_step.stepping import next_piece
from daebench.methods.outside.record import NOT_FINITE, SMALLER, Block, Blocks, finite, stopped_sentence
from daebench.methods.solvers.monitor import Stopped
from daebench.runs.grid import Grid
from daebench.runs.ivp import Ivp
from daebench.runs.request import Request
from daebench.runs.trajectory import Array, Passage

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
