"""A long run: its start among those of an ensemble, the compiled loop called piece by piece, and its energies reduced at once."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from daebench.compiler.number_types import number_type
from daebench.diagnostics.passage import MOST_STATES
from daebench.diagnostics.projected_members import project_members, require_projected
from daebench.errors import BadInput, require_known
from daebench.methods.fixed_step.lifted import Lifted
from daebench.methods.fixed_step.stepping import next_piece
from daebench.methods.outside.method import OutsideMethod
from daebench.runs.grid import Grid
from daebench.runs.ivp import Ivp
from daebench.runs.members import Members, members
from daebench.runs.request import PRECISIONS, Request
from daebench.runs.trajectory import Array
from daebench.starts.members import beside, neighbour
from daebench.studies.grid.run_specification import RunSpecification
from daebench.studies.long.windows import BLOCK, Blocks, Windows

ROUNDINGS = 1024.0
"""Size of the perturbations in roundings of the number type, relative to the largest coordinate: 2.3e-13 in double precision."""


def start_of(ivp: Ivp, member: int, precision: str) -> Ivp:
    """Return the initial value problem at the start of a member of an ensemble; member 0 has the initial value problem's own.

    The others are neighbours, see :func:`daebench.starts.members.neighbour`, by 1024 eps of the coarsest numbers, seeded by
    their numbers. That scrambles the last ten bits. What a product or a root rounds off depends on bits below the last one, which a change
    of a thousand roundings alters entirely, so that from the first step on the roundings of two members are as good as independent. The
    motion is the same: truncation, which may be larger than round-off by many orders, has means over windows that are common to all members
    up to about 1024 eps of themselves, and drops out of their spread. At single times it is not as common, for members run ahead of each
    other by a phase that grows with t. Starts spread over the energy surface, or along the motion, would each have a truncation error of
    its own; a change of 1e-10 would leave 1e-10 of it. A motion in a plane leaves it by as little, and on a motion that is unstable there,
    or chaotic, members part after some time, as they must, and the spread then has truncation in it.

    BadInput is raised if the start cannot be projected, as where vectors are arrays.
    """
    return ivp if member == 0 else neighbour(ivp, ROUNDINGS * number_type(precision).coarsest_spacing, member)


def starts_of(ivp: Ivp, numbers: Sequence[int], h: float) -> Members:
    """Return members of an ensemble by their numbers, each to the bit where :func:`start_of` has it begin in double precision.

    BadInput is raised if a start cannot be projected, as where vectors are arrays.
    """
    size = ROUNDINGS * float(np.finfo(float).eps)
    xi = np.array([np.random.default_rng(number).uniform(-1, 1, ivp.size) for number in numbers])
    moved = members(ivp, beside(ivp, size, xi), h, {})
    some = require_projected(project_members(moved), f"a neighbourhood of size {size:.2g}") if ivp.on_manifold else moved
    unmoved = np.equal(numbers, 0)[:, None]
    return replace(some, start=tuple(np.where(unmoved, x, vectors) for x, vectors in zip(ivp.start, some.start, strict=True)))


LARGEST = 1e140
"""Modulus of an energy beyond which a run is given up: sums of its squares would overflow."""

STRIDE = 16
"""Steps between samples of the energy where nothing else is said."""


@dataclass(frozen=True, kw_only=True)
class LongRun(RunSpecification):
    """Specification of a long run but for its length: beside :class:`RunSpecification` its steps, samples and start.

    Parameters
    ----------
    h : float
        Step size.
    stride : int
        Steps between samples of the energy.
    member : int
        Which start of an ensemble it has; 0 is the case's own.
    """

    h: float
    stride: int = STRIDE
    member: int = 0

    @property
    def ivp(self) -> Ivp:
        """The problem with its numbers, at the member's start."""
        return _ivp(self)

    @property
    def solver(self) -> Any:
        """The method.

        Raises
        ------
        BadInput
            If it chooses its steps itself, is run above the problem, or is from outside and more than a function of its state.
        """
        method = super().solver
        if method.knob != "h":
            raise BadInput(
                f"{self.method} chooses its own steps; a long run needs a fixed-step method, for example rattle.", "long-own-steps"
            )
        if isinstance(method, OutsideMethod) and (method.remembers or not method.every_step):
            why = "remembers more than its state" if method.remembers else "gives no state after each step"
            raise BadInput(
                f"{self.method} {why}, and a long run goes on from a state; give a function step(p, q, h), or step(y, h).",
                "long-not-from-state",
            )
        if isinstance(method, Lifted):
            raise BadInput(
                f"{self.method} has its state on another system, which a long run cannot store; choose a method on the problem itself.",
                "long-on-other-system",
            )
        return method

    def member_of(self, number: int) -> "LongRun":
        """Return the run from another start of the ensemble."""
        return replace(self, member=number)

    def check(self, steps: int) -> None:
        """Accept a run of so many steps that can be made.

        Raises
        ------
        BadInput
            If it cannot.
        """
        require_known(("precision", self.precision, PRECISIONS))
        self._grid(self.solver, self.ivp, steps)

    def _grid(self, solver: Any, ivp: Ivp, steps: int) -> Grid:
        if not 1 <= self.stride <= steps:
            raise BadInput(
                f"stride = {self.stride} must be at least one step, and at most the {steps} steps of the run.", "stride-out-of-range"
            )
        return _Buffered(solver.grid(ivp, self.request(steps)).h, steps, self.stride)

    def request(self, steps: int) -> Request:
        """Return the request to the method."""
        return Request(value=self.h, steps=steps, every=0, watch=(), count=False, precision=self.precision)

    def begun(self, steps: int) -> Any:
        """Return a run of so many steps at its start, linked and compiled."""
        solver, ivp = self.solver, self.ivp
        return solver.begin(ivp, self.request(steps), self._grid(solver, ivp, steps), ("samples",))


@lru_cache(maxsize=64)
def _ivp(spec: LongRun) -> Ivp:
    return start_of(super(LongRun, spec).ivp, spec.member, spec.precision)


@dataclass(frozen=True)
class _Buffered(Grid):
    """A grid of which no more is kept at a time than a buffer holds, and what is added in a rank-loss event."""

    @property
    def rows(self) -> int:
        """Number of samples that there is room for."""
        return BLOCK + MOST_STATES + 1


@dataclass(frozen=True)
class Checkpoint:
    """A long run as it was left, or members of an ensemble in lanes after as many steps, with one more axis of arrays."""

    done: int
    """Steps done."""
    seconds: float
    """CPU time of the loop."""
    windows: Windows
    blocks: Blocks
    """Statistics of what is reduced."""
    numbers: Array
    """All that the loop carries; shape (k,)."""
    waiting: Array
    """Energies H(x) that are sampled and not yet reduced, in the run's number type; shape (r,)."""
    first: Any
    """H(x0)."""
    left: int = 0
    """Steps to the next sample, of a run by itself."""
    passages: int = 0
    """Number of rank-loss events."""
    failure: str = ""
    """Why it stopped; "" if nothing but the end or an interruption stopped it."""
    rank_pending: bool = False
    """Whether G loses rank in the step after the last one."""
    members: tuple[int, ...] | None = None
    """Numbers of the members in lanes; those that left them have files of their own."""

    @property
    def errors(self) -> Array:
        """Errors of the energy that are not yet reduced, shape(r,)."""
        return np.asarray(self.waiting - self.waiting.dtype.type(self.first), dtype=float)

    def each(self, stride: int) -> dict[int, "Checkpoint"]:
        """Return the members in lanes by number, as they would be left alone but for what the loop carries."""
        members = self.members or ()
        seconds, left = self.seconds / max(1, len(members)), stride - self.done % stride
        alone = replace(self, seconds=seconds, numbers=np.empty(0), left=left, members=None)
        return {number: alone._part(k) for k, number in enumerate(members)}

    def _part(self, k: int) -> "Checkpoint":
        windows, blocks = self.windows.some(k), self.blocks.some(k)
        return replace(self, windows=windows, blocks=blocks, waiting=self.waiting[:, k], first=float(self.first[k]))


class Stream:
    """A long run under way.

    Samples are reduced in blocks of a fixed number, so that nothing depends on where a run was interrupted.
    """

    def __init__(self, spec: LongRun, steps: int) -> None:
        self.spec = spec
        self.run = spec.begun(steps)
        self.windows, self.blocks = Windows(), Blocks()
        self.passages = 0
        self._piece = 64

    @property
    def going(self) -> bool:
        """Whether there are steps left, and nothing has stopped it."""
        return self.run.failure is None and self.run.done < self.run.grid.steps

    @property
    def done(self) -> int:
        """Steps done."""
        return int(self.run.done)

    @property
    def steps(self) -> int:
        """Steps at its end."""
        return int(self.run.grid.steps)

    @property
    def seconds(self) -> float:
        """CPU time of the loop."""
        return float(self.run.seconds)

    @property
    def failure(self) -> str:
        """Why it stopped early; "" if it did not."""
        return self.run.failure or ""

    @property
    def errors(self) -> Array:
        """Errors of the energy that are sampled and not yet reduced, shape(k,): H(x) - H(x0) in the run's number type."""
        energies = self.run.state_rows[: self.run.row, 0]
        return np.asarray(energies - self.run.conserved[0], dtype=float)

    def advance(self) -> None:
        """Take a piece of the run, of a fifth of a second or up to the end of the buffer."""
        run = self.run
        first = run.row
        taken = min(self._piece, run.left + (BLOCK - 1 - first) * run.grid.every)
        self._piece = next_piece(taken, run.piece(taken))
        self.passages += len(run.passages)
        run.passages.clear()
        self._require_finite(first)
        if run.row >= BLOCK:
            self.reduce()

    def reduce(self) -> None:
        """Take the samples that fill the buffer into windows and blocks."""
        run = self.run
        values = self.errors[:BLOCK]
        self.windows.add(values)
        self.blocks.add(values)
        rest = run.row - BLOCK
        run.state_rows[:rest] = run.state_rows[BLOCK : run.row]
        run.row = rest

    def _require_finite(self, first: int) -> None:
        """Stop where a sample is not finite, or so large that its square may not be; those before it are kept."""
        run = self.run
        wrong = np.flatnonzero(~(np.abs(run.state_rows[first : run.row, 0].astype(float)) < LARGEST))
        if len(wrong):
            run.row = first + int(wrong[0])
            run.failure = beyond(self.spec, self.windows.samples + run.row + 1)

    def numbers(self) -> Array:
        """Return all numbers that the loop carries, on one line; float32 is exact in float64."""
        return np.array(list(_flat(self.run.carried)), dtype=float)

    @property
    def room(self) -> int:
        """Samples that there is room for."""
        return len(self.run.state_rows) - 1

    def checkpoint(self) -> Checkpoint:
        """Return the run as it is."""
        run = self.run
        waiting, first = run.state_rows[: run.row, 0], float(run.conserved[0])
        left = Checkpoint(self.done, self.seconds, self.windows, self.blocks, self.numbers(), waiting, first)
        return replace(left, left=run.left, passages=self.passages, failure=self.failure, rank_pending=bool(run.rank_pending))

    def restore(self, checkpoint: Checkpoint) -> None:
        """Put a run at its start to where a checkpoint left it."""
        run, self.windows, self.blocks, self.passages = self.run, checkpoint.windows, checkpoint.blocks, checkpoint.passages
        run.carried = _shaped(run.carried, iter(checkpoint.numbers))
        run.done, run.left, run.row, run.seconds = checkpoint.done, checkpoint.left, len(checkpoint.waiting), checkpoint.seconds
        run.state_rows[: run.row, 0] = checkpoint.waiting
        run.failure, run.rank_pending = checkpoint.failure or None, checkpoint.rank_pending
        run.passages.clear()


def beyond(spec: LongRun, sample: int) -> str:
    """Return why a run was given up whose energy is beyond all bounds at a sample, counted from 1."""
    where = f"{spec.method} on {spec.problem}, case {spec.case}"
    return f"{where}: the energy is beyond {LARGEST:g} at t = {sample * spec.stride * spec.h:.9g}; use a smaller h."


def _flat(x: Any) -> Iterator[float]:
    if isinstance(x, tuple):
        for part in x:
            yield from _flat(part)
    else:
        yield from np.ravel(x)


def _shaped(like: Any, numbers: Iterator[Any]) -> Any:
    """Return the next numbers in the shape and type of something else."""
    if isinstance(like, tuple):
        return tuple(_shaped(part, numbers) for part in like)
    if isinstance(like, np.ndarray):
        return np.array([next(numbers) for _ in range(like.size)], dtype=like.dtype).reshape(like.shape)
    return type(like)(next(numbers))
