"""A run of a linked scheme: the compiled loop called piece by piece, so that it can be monitored and interrupted."""

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from daebench.compiler.native import timed
from daebench.compiler.number_types import NUMBER_TYPES
from daebench.compiler.under_way import compiling, uncollected
from daebench.methods.fixed_step.reasons import REASONS
from daebench.runs.grid import Grid
from daebench.runs.ivp import InitialValueProblem
from daebench.runs.request import Progress, Request
from daebench.runs.trajectory import Array, Passage
from daebench.schemes.kernels.loop import ERROR_NOT_FINITE
from daebench.schemes.kernels.newton import ITERATIONS, NOT_CONVERGED
from daebench.schemes.kernels.rank import RANK_LOST
from daebench.schemes.kernels.relax import ROUNDS

CHUNK_SECONDS = 0.2
"""Time between two calls of the loop: often enough for progress and Ctrl-C, and so seldom that calls cost nothing."""


@dataclass(frozen=True)
class Linked:
    """A scheme linked to a problem, ready to run."""

    name: str
    """Name in the grammar of methods."""
    kernel: Any
    """The generated module, whose ``integrate`` is that of :mod:`daebench.schemes.kernels.loop`."""
    par: tuple[Any, ...]
    """Run-time data: the problem's parameters, the scheme's numbers, the form's numbers."""
    weights: Array
    """Weights of the substeps of a composition; empty where a step is one step; shape (k,)."""
    enter: Callable[[Sequence[Any]], Any]
    leave: Callable[[Any], Array]
    """From the problem's start to the state that the scheme computes in, and from there to a row of numbers as they are stored."""
    work: tuple[str, ...]
    """Kinds of work that the kernel counts."""
    reasons: Mapping[int, tuple[str, str]] = field(default_factory=lambda: REASONS)
    """Why it stopped and what to do, by status."""
    arrays: bool = False
    """Whether states are arrays, and not tuples."""

    def failure(self, ivp: InitialValueProblem, h: float, done: int, steps: int, tried: int, report: Sequence[Any]) -> str:
        """Return the sentence that says where a scheme stopped and why; ``tried`` substeps were begun in the last step."""
        substep = (
            f", substep {tried} of {len(self.weights)} over {self.weights[tried - 1] * h:.4g}" if len(self.weights) and tried > 0 else ""
        )
        where = f"stopped at t = {done * h:.9g} (step {done + 1} of {steps}, h = {h:g}{substep})"
        why, advice = self.reasons[int(report[0])]
        sweeps = -int(report[2]) if report[0] == NOT_CONVERGED else ITERATIONS
        reason = why.format(residual=float(report[1]), sweeps=sweeps, relaxations=ROUNDS)
        return f"{self.name} on {ivp.problem}, case {ivp.case}, {where}: {reason}; {advice}."


MOST_LOOKED_AT = 2**20
"""Approximate number of numbers in all states that a run looks at."""


def _looks(request: Request, size: int) -> int:
    """Return the number of states that are looked at along a run, given the size of a state."""
    return max(1, min(request.looks, MOST_LOOKED_AT // size))


def next_piece(piece: int, took: float) -> int:
    """Return the number of steps that take a fifth of a second if ``piece`` steps took ``took`` seconds; at most eight times as many."""
    # At most eightfold: the time of a short piece is uncertain, and a piece that is far too long cannot be interrupted.
    return int(min(8 * piece, max(1, piece * CHUNK_SECONDS / max(took, 1e-6))))


class Run:
    """One run of a linked scheme on an initial value problem."""

    def __init__(
        self,
        linked: Linked,
        ivp: InitialValueProblem,
        request: Request,
        grid: Grid,
        *,
        names: Sequence[str],
        stage_multipliers: int = 0,
        linking: list[float],
        progress: Progress | None = None,
    ) -> None:
        began = time.perf_counter() - sum(linking)
        self.progress = progress
        self.linked, self.ivp, self.request, self.grid, self.names = linked, ivp, request, grid, names
        self.kernel = linked.kernel
        self.dtype = np.dtype(NUMBER_TYPES[request.precision].dtype)
        self.number: Callable[[Any], Any] = float if self.dtype == float else self.dtype.type
        self.zero, self.infinity = self.typed(0.0), self.typed(np.inf)
        self.par, self.h = self.typed(linked.par), self.typed(grid.h)
        self.weights = linked.weights.astype(self.dtype)
        self.x = self.state(linked.enter(ivp.start))
        self.state_rows = np.empty((grid.rows, ivp.size), dtype=self.dtype)
        self.stage_rows = np.empty((grid.rows if stage_multipliers else 0, stage_multipliers), dtype=self.dtype)
        self.done, self.row, self.left = 0, 0, grid.every or -1
        # The rest of the outputs, with the row where it begins: slices are made anew only when rows were stored.
        self.rest = 0, self.state_rows, self.stage_rows
        self.work = np.zeros(len(linked.work), dtype=np.int64)
        self.seconds = 0.0
        self.failure: str | None = None
        self.status = 0
        self.rank_lost, self.rank_pending = False, False
        self.passages: list[Passage] = []
        self.interrupted = False
        self.looks: list[tuple[int, Array]] = []
        self.stride = max(1, -(-grid.steps // _looks(request, ivp.size))) if request.looks else 0
        self.stored = bool(grid.every) and self.stride % grid.every == 0  # states that are looked at are then among the stored ones
        with np.errstate(all="ignore"), ExitStack() as first:
            if linking:
                first.enter_context(uncollected())
                first.enter_context(compiling(f"{linked.name} for {ivp.problem}"))
            self._prepare()
        self.compile_seconds = time.perf_counter() - began
        linking.clear()  # which the first run alone waits for

    def typed(self, x: Any) -> Any:
        """Return a number or nested tuple in the run's number type, which is lost when a kernel hands a float32 back to Python."""
        return tuple(map(self.typed, x)) if isinstance(x, tuple | np.ndarray) else self.number(x)

    def state(self, x: Any) -> Any:
        """Return a state, or what a scheme remembers, in the run's number type; its parts are arrays where vectors are."""
        if not self.linked.arrays:
            return self.typed(x)
        parts = isinstance(x, tuple) and (not x or np.ndim(x[0]) > 0)
        return tuple(np.array(part, dtype=self.dtype) for part in x) if parts else np.array(x, dtype=self.dtype)

    def _prepare(self) -> None:
        """Make the first memory and the conserved quantities, and have the loop compiled."""
        self.conserved = self.typed(self.kernel.first(self.x, self.par)) if hasattr(self.kernel, "first") else ()
        self.maxima: Any = tuple(self.zero for _ in self.names)
        self.pivots: Any = self._no_pivots()
        self.memory: Any = ()
        report: Any = (0, self.zero, self.infinity, ())
        if hasattr(self.kernel, "initialise"):
            memory, report = self.kernel.initialise(self.x, self.h, self.par)
            self.memory = self.state(memory)
            self.work += self._tally(self.kernel.EACH_INITIALISE, 1) + self._tally(report[3], 1)
        if report[0]:
            self.status, self.failure = int(report[0]), self.sentence(report, 0)
        # No steps: the loop is loaded or compiled now, so that the time of stepping has only steps in it.
        self._call(0)

    def _no_pivots(self) -> Any:
        """Return the pivots before the first step."""
        return self.infinity

    @property
    def pivot(self) -> Any:
        """Smallest relative pivot so far."""
        return self.pivots

    def _lose_rank(self) -> None:
        """Handle a loss of rank of G within the next step; only a run that monitors for it comes here."""

    def _tally(self, counts: Sequence[int], times: int) -> Any:
        return times * np.array(counts, dtype=np.int64) if self.request.count and len(counts) else np.zeros_like(self.work)

    def sentence(self, report: Sequence[Any], tried: int) -> str:
        """Return the reason for the failure of a step, given its report and the number of substeps that were tried."""
        return self.linked.failure(self.ivp, self.grid.h, self.done, self.grid.steps, tried, report)

    @property
    def carried(self) -> tuple[Any, ...]:
        """All numbers that are passed from step to step: state, memory, conserved quantities, maxima and pivots."""
        return self.x, self.memory, self.conserved, self.maxima, self.pivots

    @carried.setter
    def carried(self, numbers: tuple[Any, ...]) -> None:
        self.x, self.memory, self.conserved, self.maxima, self.pivots = numbers

    def _call(self, steps: int) -> tuple[Any, float]:
        """Return the results of the loop for a number of steps, and its CPU time."""
        if self.rest[0] != self.row:
            self.rest = self.row, self.state_rows[self.row :], self.stage_rows[self.row :]
        args = (*self.carried, self.h, self.weights, steps, self.left, self.grid.every, *self.rest[1:], self.par)
        return timed(self.kernel.integrate, args)

    def _advance(self, steps: int) -> float:
        """Take a number of steps, and return the CPU time."""
        with np.errstate(all="ignore"):
            result, took = self._call(steps)
        self.x = self.state(result[0])
        self.memory = self.state(result[1])
        self.maxima, self.pivots = self.typed(result[2:4])
        done, rows, self.left, work, tried, report = result[4:]
        self.done, self.row = self.done + done, self.row + rows
        self.rank_lost = report[0] == RANK_LOST
        failed = int(report[0] != 0 and not self.rank_lost)
        # Work is counted by calls: a step that failed has done its substeps up to the failure.
        substeps = done * max(1, len(self.weights)) + failed * abs(tried)
        self.work += self._tally(work, 1) + self._tally(self.kernel.EACH_ONE_STEP, substeps)
        self.work += self._tally(self.kernel.EACH_AFTER_STEP, done + failed)
        self.seconds += took
        if failed:
            self.status, self.failure = int(report[0]), self.sentence(report, tried)
        return took

    def piece(self, steps: int) -> float:
        """Take a number of steps, at most those that are left, and act if G loses rank; return the CPU time of the steps.

        If the last step predicts a loss of rank in the next one, this stays pending for a longer run that continues from there.
        """
        took = 0.0
        if not self.rank_pending:
            took = self._advance(min(steps, self.grid.steps - self.done))
            self.rank_pending = self.rank_lost
        if self.rank_pending and self.done < self.grid.steps:
            self.rank_pending = False
            self._lose_rank()
        return took

    def _march(self) -> None:
        """Take all steps, in pieces of a fifth of a second."""
        # 64 steps first: a step takes from 30 ns to seconds, and the first piece measures which.
        piece, limit = 64, time.perf_counter() + (self.request.seconds_limit or np.inf)
        while self.done < self.grid.steps and self.failure is None:
            looks = self.stride and not self.stored
            # A piece ends where the next state is looked at; such a short piece says little about the size of the next.
            size = min(piece, self.stride - self.done % self.stride) if looks else piece
            piece = max(piece, next_piece(size, self.piece(size))) if size < piece else next_piece(piece, self.piece(piece))
            if looks and self.done % self.stride == 0:
                self.looks.append((self.done, self._row()))
            if self.progress:
                self.progress(self.done / self.grid.steps)
            if self.failure is None and self.done < self.grid.steps and time.perf_counter() > limit:
                self.failure = self._stopped(f"the limit of {self.request.seconds_limit:g} s is reached")

    def _stopped(self, why: str) -> str:
        t = self.done * self.grid.h
        return f"{self.linked.name} on {self.ivp.problem}, case {self.ivp.case}, stopped at t = {t:.9g}: {why}."

    def outcome(self) -> dict[str, Any]:
        """Take all steps, and return the fields that trajectories of every kind have."""
        try:
            self._march()
        except KeyboardInterrupt:
            if not self.request.keep_interrupted:
                raise
            # The states so far are good: those that were stored before Ctrl-C are returned.
            self.failure, self.interrupted = self._stopped("interrupted"), True
        # A run that does not monitor H has not evaluated it: its end is checked at least.
        if self.failure is None and "energy" not in self.names and not np.isfinite(self._energy()):
            self.status, self.failure = ERROR_NOT_FINITE, self._stopped(f"H is not finite there; {self.linked.reasons[4][1]}")
        ivp, request = self.ivp, self.request
        return {
            "problem": ivp.problem,
            "case": ivp.case,
            "method": self.linked.name,
            "parameters": dict(ivp.parameters),
            "knob": "h",
            "value": self.grid.h,
            "steps": self.done,
            "work": dict(zip(self.linked.work, map(int, self.work), strict=True)) if request.count else {},
            "maxima": dict(zip(self.names, map(float, self.maxima), strict=True)),
            "pivot": float(self.pivot) if np.isfinite(self.pivot) else None,
            "seconds": self.seconds,
            "compile_seconds": self.compile_seconds,
            "failure": self.failure,
            "interrupted": self.interrupted,
            "looks": self._looks(),
        }

    def _energy(self) -> float:
        """Return H at the last state."""
        return float(self.ivp.value("H", *self.ivp.vectors(self._row())))

    def _row(self) -> Array:
        """Return the last state as a row of numbers."""
        return np.asarray(self.linked.leave(self.x), dtype=float)

    def _looks(self) -> tuple[Array, Array] | None:
        """Return times and states that are looked at, the start and the end among them; None if none were asked for."""
        if not self.stride:
            return None
        if self.stored:
            t, rows = self.states()
            chosen = np.arange(0, len(rows), self.stride // self.grid.every)
            chosen = np.append(chosen, len(rows) - 1) if chosen[-1] < len(rows) - 1 else chosen
            return t[chosen], rows[chosen]
        end = [] if self.looks and self.looks[-1][0] == self.done else [(self.done, self._row())]
        seen = [(0, np.concatenate(self.ivp.start)), *self.looks, *end]
        return np.array([done for done, _ in seen], dtype=float) * self.grid.h, np.array([row for _, row in seen])

    def states(self) -> tuple[Array, Array]:
        """Return the times and the rows of states: the start, what the loop stored, and the end."""
        index = self.grid.every * np.arange(1, self.row + 1)
        end = [self.done] if self.done and (not len(index) or index[-1] != self.done) else []
        last = np.array([self.linked.leave(self.x)] * len(end), dtype=float).reshape(-1, self.ivp.size)
        rows = np.concatenate([np.concatenate(self.ivp.start)[None], self.state_rows[: self.row].astype(float, copy=False), last])
        return np.array([0, *index, *end], dtype=float) * self.grid.h, rows

    def multipliers(self) -> Array:
        """Return the stage multipliers of the steps that were taken, one row a step."""
        return self.stage_rows[: self.row].astype(float, copy=False)
