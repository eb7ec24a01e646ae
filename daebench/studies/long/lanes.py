"""Members of an ensemble of long runs in lanes, reduced at once; a member that cannot go on leaves its lane, and goes on by itself."""

import time
from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np

from daebench.compiler.entry_points import CONSERVED, DONE, STATUS
from daebench.methods.ensemble.lanes import ABSENT
from daebench.methods.ensemble.run import sampled_members
from daebench.methods.fixed_step.base import FixedStepMethod
from daebench.methods.fixed_step.stepping import next_piece
from daebench.runs.trajectory import Array
from daebench.schemes.kernels.rank import RANK_LOST
from daebench.studies.long.run import LARGEST, Checkpoint, LongRun, Stream, beyond, starts_of
from daebench.studies.long.windows import BLOCK, Blocks, Windows

GROUP = 128
"""Members that are in lanes together, at most: as many as whose samples fit into a core's cache."""

AT_ONCE = 16
"""Members that take hardly longer than one, which are not parted."""


@cache
def in_lanes(spec: LongRun) -> bool:
    """Return whether members of an ensemble can be run in lanes: fixed-step schemes in float64 whose states are a few numbers."""
    solver = spec.solver
    if not isinstance(solver, FixedStepMethod) or spec.precision != "float64":
        return False
    return sampled_members(solver, starts_of(spec.member_of(0).ivp, [0], spec.h), spec.request(1), 1) is not None


class LaneStream:
    """Long runs of several members under way, each to the bit what :class:`daebench.studies.long.run.Stream` makes of it."""

    def __init__(self, spec: LongRun, members: Sequence[int], steps: int) -> None:
        self.spec, self.members, self.steps = spec, tuple(members), steps
        begun = sampled_members(spec.solver, starts_of(spec.member_of(0).ivp, members, spec.h), spec.request(steps), BLOCK)
        assert begun is not None
        self.run, self.samples = begun
        self.columns = np.arange(len(self.members))
        self.windows = Windows(np.empty((len(self.members), 0, 5)))
        self.blocks = Blocks(means=np.empty((len(self.members), 0)), total=np.zeros(len(self.members)))
        self.done, self.row, self.seconds = 0, 0, 0.0
        self._piece = 64

    @property
    def going(self) -> bool:
        """Whether there are steps left, and members in lanes."""
        return bool(self.members) and self.done < self.steps

    @property
    def first(self) -> Array:
        """H(x0), shape(n,)."""
        first: Array = self.run.numbers[self.run.places[CONSERVED], self.columns]
        return first

    @property
    def waiting(self) -> Array:
        """Energies that are sampled and not yet reduced, shape(r, n)."""
        energies: Array = self.samples[: self.row, 0, self.columns]
        return energies

    def numbers(self) -> Array:
        """Return all numbers that the loop carries, shape(k, n)."""
        numbers: Array = self.run.numbers[:, self.columns]
        return numbers

    @property
    def room(self) -> int:
        """Samples that may wait."""
        return BLOCK - 1

    def checkpoint(self) -> Checkpoint:
        """Return the members in lanes as they are."""
        numbers, waiting = self.numbers(), self.waiting
        return Checkpoint(self.done, self.seconds, self.windows, self.blocks, numbers, waiting, self.first, members=self.members)

    def restore(self, checkpoint: Checkpoint) -> None:
        """Put members at their start to where they were left."""
        self.done, self.row, self.seconds = checkpoint.done, len(checkpoint.waiting), checkpoint.seconds
        self.windows, self.blocks = checkpoint.windows, checkpoint.blocks
        self.run.numbers[:, self.columns], self.run.counts[DONE, self.columns] = checkpoint.numbers, self.done
        self.samples[: self.row, 0, self.columns] = checkpoint.waiting

    def advance(self) -> list[Stream | int]:
        """Take a piece of the runs, of a fifth of a second or up to the end of the buffer."""
        stride = self.spec.stride
        left = stride - self.done % stride
        taken = min(self._piece, self.steps - self.done, left + (BLOCK - 1 - self.row) * stride)
        began = time.thread_time()
        with np.errstate(all="ignore"):
            self.run.take(taken, left, stride, self.samples[self.row :], 0, self.run.columns)
        took = time.thread_time() - began
        self._piece, self.seconds = next_piece(taken, took), self.seconds + took
        reduced, before = self.done // stride - self.row, self.row
        self.done += taken
        self.row = self.done // stride - reduced
        stopped = self._stopped(before, reduced)
        leaving = [self._left(int(k), rows, reduced) for k, rows in stopped.items()]
        self._keep(np.setdiff1d(np.arange(len(self.members)), list(stopped)))
        if self.row == BLOCK:
            self._reduce()
        return leaving

    def _stopped(self, before: int, reduced: int) -> dict[int, int]:
        """Return which of the members in lanes cannot go on, and how many of their samples are not yet reduced."""
        status, done = (self.run.counts[row, self.columns] for row in (STATUS, DONE))
        rows = done // self.spec.stride - reduced
        stopped = {int(k): int(rows[k]) for k in np.flatnonzero(status != 0)}
        small = np.abs(self.samples[before : self.row, 0]) < LARGEST
        if not small[:, self.columns].all():
            for k, column in enumerate(self.columns):
                wrong = np.flatnonzero(~small[: max(0, rows[k] - before), column])
                if len(wrong):
                    stopped[k] = before + int(wrong[0])
        return stopped

    def _left(self, k: int, rows: int, reduced: int) -> Stream | int:
        """Return a member that leaves its lane, with so many samples that are not yet reduced."""
        column, spec = int(self.columns[k]), self.spec.member_of(self.members[k])
        done = int(self.run.counts[DONE, column])
        if not done:
            return self.members[k]
        stream = Stream(spec, self.steps)
        run = stream.run
        run.carried = self.run.carried_by(column, run.memory)
        stream.windows, stream.blocks = self.windows.some(k), self.blocks.some(k)
        run.done, run.left, run.row = done, self.spec.stride - done % self.spec.stride, rows
        run.seconds, run.failure, run.rank_pending = self.seconds / len(self.columns), None, self.run.counts[STATUS, column] == RANK_LOST
        run.passages.clear()
        run.state_rows[:rows, 0] = self.samples[:rows, 0, column]
        if rows < done // self.spec.stride - reduced:
            run.failure = beyond(self.spec, reduced + rows + 1)
        elif rows == BLOCK:
            stream.reduce()
        return stream

    def _keep(self, rows: Any) -> None:
        """Go on with some of the members."""
        if len(rows) == len(self.members):
            return
        gone = np.setdiff1d(self.columns, self.columns[rows])
        self.run.counts[STATUS, gone] = ABSENT
        self.members, self.columns = tuple(self.members[k] for k in rows), self.columns[rows]
        self.windows, self.blocks = self.windows.some(rows), self.blocks.some(rows)

    def _reduce(self) -> None:
        self.row = 0
        if self.members:
            values = np.ascontiguousarray((self.samples[:, 0, self.columns] - self.first).T)
            self.windows.add(values)
            self.blocks.add(values)
