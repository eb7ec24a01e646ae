"""Members of an ensemble in lanes, as many as this processor does best with: the compiled loop called block by block, on several cores."""

import hashlib
import json
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from types import ModuleType
from typing import Any

import numpy as np

from daebench.compiler import sealed
from daebench.compiler.cache import cache_directory, toolchain
from daebench.compiler.entry_points import DONE, MEMORY, PIVOTS, RESIDUAL, STATUS, TRIED, WORK
from daebench.compiler.native import Native
from daebench.compiler.under_way import uncollected
from daebench.methods.fixed_step.stepping import Linked, next_piece
from daebench.runs.grid import Grid
from daebench.runs.members import Members, flat
from daebench.runs.trajectory import Array
from daebench.schemes.kernels.rank import RANK_LOST

ABSENT = -1
"""Status of a column that has no member."""

REFUSED = -2
"""Status of a member that was not begun."""

PARTS = 4
"""Parts that the blocks of a core are divided into, so that none waits long for another."""

Form = Any
"""A nested tuple of numbers that tells nothing but its form."""


def form_of(x: Any) -> Form:
    """Return a nested tuple of zeros."""
    return tuple(map(form_of, x)) if np.ndim(x) or isinstance(x, tuple) else 0.0


def nested(form: Form, numbers: Any) -> Any:
    """Return a nested tuple of a form with the numbers that an iterator gives."""
    return tuple(nested(part, numbers) for part in form) if isinstance(form, tuple) else float(next(numbers))


@dataclass(frozen=True)
class Carried:
    """The forms of what goes from one step into the next."""

    x: Form
    pivots: Form
    """State, and what is recalled of pivots."""
    conserved: int
    maxima: int
    """Numbers of conserved quantities and of errors that are monitored."""

    @property
    def forms(self) -> tuple[Form, Form, Form, Form]:
        """State, conserved quantities, maxima and pivots."""
        return self.x, (0.0,) * self.conserved, (0.0,) * self.maxima, self.pivots


class LaneRun:
    """The runs of all members.

    Shapes: scales (n,); states (n, k); rows (rows, c, columns).
    """

    def __init__(
        self,
        linked: Linked,
        members: Members,
        scales: tuple[Array, Array],
        states: Array,
        carried: Carried,
        grid: Grid,
        rows: Array,
        *,
        lanes: int,
    ) -> None:
        self.linked, self.kernel, self.carried, self.grid, self.lanes = linked, linked.kernel, carried, grid, lanes
        self.n = len(members)
        self.columns = rows.shape[2]
        self.seconds = 0.0
        self._stop = threading.Event()
        self._share(members, scales)
        self._place(states)
        self.states = rows

    def _share(self, members: Members, scales: tuple[Array, Array]) -> None:
        """Make rows of what differs from member to member, and put their numbers in its place among the parameters."""
        rows: list[Array] = [scales[0]]

        def placed(value: Any) -> Any:
            if isinstance(value, tuple):
                return tuple(map(placed, value))
            if np.ndim(value) == 0:
                return float(value)
            rows.append(value)
            return len(rows) - 1

        scale = (0, placed(scales[1]) if np.any(scales[1]) else 0.0)
        data = self.linked.par[len(members.par) + 1 :]
        self.par = (*map(placed, members.par), scale, *map(placed, data))
        self.h = placed(members.h)
        self.weights = self.linked.weights if members.weights is None else placed(tuple(members.weights.T))
        self.rows = np.array([np.pad(row, (0, self.columns - self.n), mode="edge") for row in rows])

    def _place(self, states: Array) -> None:
        """Put the start of each member into its column."""
        carried, size = self.carried, states.shape[1]
        recalled = [np.inf, *[0.0] * (len(flat(carried.pivots)) - 1)]
        self.places = tuple(np.cumsum([size, carried.conserved, carried.maxima, len(recalled), 2]).tolist())
        # What a scheme remembers is known when it has been initialised; this is room for two states, and begin() makes more.
        self.numbers = np.zeros((self.places[MEMORY] + 2 * size, self.columns))
        self.numbers[:size, : self.n] = states.T
        self.numbers[self.places[PIVOTS] : self.places[RESIDUAL]] = np.array(recalled)[:, None]
        self.counts = np.zeros((WORK + len(self.linked.work), self.columns), dtype=np.int64)
        self.counts[STATUS] = ABSENT
        self.counts[STATUS, : self.n] = np.where(np.all(np.isfinite(states), axis=1), 0, REFUSED)

    def begin(self) -> None:
        """Make the conserved quantities and the first memories, and have the loop compiled."""
        start = (self.carried.x, self.h, self.par, self.numbers, self.rows, self.counts, self.places, 0)
        with np.errstate(all="ignore"), uncollected():
            if hasattr(self.kernel, "initialise_lanes"):
                more = self.places[MEMORY] + self.kernel.initialise_lanes(*start, self.columns) - len(self.numbers)
                if more > 0:
                    self.numbers = np.concatenate([self.numbers, np.zeros((more, self.columns))])
                    start = (*start[:3], self.numbers, *start[4:])
                    self.kernel.initialise_lanes(*start, self.columns)
            if hasattr(self.kernel, "first_lanes"):
                self.kernel.first_lanes(*start, self.columns)
            self._call(0, 0, 0, 0)

    def _call(self, steps: int, done: int, begin: int, end: int) -> None:
        """Take steps of the members in some columns, of which so many are done."""
        every = self.grid.every
        left, row = (every - done % every, done // every) if every else (-1, 0)
        self.take(steps, left, every, self.states[row:], begin, end)

    def take(self, steps: int, left: int, every: int, states: Array, begin: int, end: int) -> None:
        """Take steps of the members in some columns, and store in ``states`` after ``left`` steps, and then after every so many."""
        arrays = self.numbers, self.rows, self.counts, states, self.places
        self.kernel.integrate_lanes(self.carried.forms, self.h, self.weights, steps, left, every, self.par, *arrays, begin, end)

    def march(self, threads: int, progress: Callable[[float], None] | None = None) -> None:
        """Take all steps of all members, on so many cores."""
        blocks = self.columns // self.lanes
        parts = np.unique(np.linspace(0, blocks, min(blocks, threads * PARTS if threads > 1 else 1) + 1).astype(int)) * self.lanes
        done = np.zeros(len(parts) - 1)

        def part(k: int) -> float:
            def told(steps: int) -> None:
                done[k] = steps
                if progress:
                    progress(float(done.mean()) / self.grid.steps)

            return self._part(int(parts[k]), int(parts[k + 1]), told)

        if threads == 1:
            self.seconds += sum(map(part, range(len(done))))
            return
        with ThreadPoolExecutor(threads) as pool:
            try:
                self.seconds += sum(pool.map(part, range(len(done))))
            except BaseException:
                self._stop.set()
                raise

    def _part(self, begin: int, end: int, tell: Callable[[int], None]) -> float:
        """Take all steps of the members in some columns; return the CPU time."""
        done, piece, seconds = 0, 64, 0.0
        while done < self.grid.steps and not self._stop.is_set() and np.any(self.counts[STATUS, begin:end] == 0):
            steps, began = min(piece, self.grid.steps - done), time.thread_time()
            self._call(steps, done, begin, end)
            took = time.thread_time() - began
            done, seconds, piece = done + steps, seconds + took, next_piece(piece, took)
            tell(done)
        return seconds

    # ---- what comes out --------------------------------------------------------------------------------------------------

    def carried_by(self, i: int, memory: Any) -> tuple[Any, ...]:
        """Return the numbers of one member in the form of :attr:`daebench.methods.fixed_step.stepping.Run.carried`, with this memory."""
        column = self.column(i)
        remembered = nested(form_of(memory), iter(self.numbers[self.places[MEMORY] :, i].tolist()))
        return column["x"], remembered, column["conserved"], column["maxima"], column["pivots"]

    def column(self, i: int) -> dict[str, Any]:
        """Return the numbers that one member carries, as nested tuples: state, memory, conserved quantities, maxima and pivots."""
        numbers = iter(self.numbers[:, i].tolist())
        names = ("x", "conserved", "maxima", "pivots")
        parts = {name: nested(form, numbers) for name, form in zip(names, self.carried.forms, strict=True)}
        return parts | {"report": (int(self.counts[STATUS, i]), next(numbers), 0.0, ())}

    def work(self) -> Any:
        """Return the work of each member, shape(kinds, n)."""
        status, done, tried = (self.counts[k, : self.n] for k in (STATUS, DONE, TRIED))
        failed = (status > 0) & (status != RANK_LOST)
        substeps = done * max(1, len(self.linked.weights)) + failed * np.abs(tried)
        begun = status != REFUSED
        counted = self.counts[WORK:, : self.n].copy()
        for name, times in (("ONE_STEP", substeps), ("AFTER_STEP", done + failed), ("INITIALISE", begun)):
            counts = np.array(getattr(self.kernel, f"EACH_{name}"), dtype=np.int64)
            if len(counts):
                counted += np.multiply.outer(counts, times)
        return counted


WIDTHS = (4, 8, 16, 32)
"""Numbers of lanes that are tried."""

BETTER = 0.95
"""Part of the time of fewer lanes that more lanes must do with: they are compiled for longer, and wait for each other more often."""

REPEATS, ITERATIONS, COLUMNS = 5, 2000, 64


@cache
def best_width() -> int:
    """Return the number of lanes, from the cache directory or measured."""
    from daebench.compiler.machine import machine, processor

    purpose = "\n".join(["lanes", toolchain(), machine()])
    path = cache_directory() / f"daebench_generated_lanes_{processor()[0]}"
    content = sealed.read(path, purpose)
    if content is not None:
        return int(json.loads(content)["lanes"])
    width = fastest(measured())
    with suppress(OSError):  # what cannot be kept is measured again by the next process
        sealed.write(path, purpose, json.dumps({"lanes": width}).encode())
    return width


def width_for(members: int) -> int:
    """Return the number of lanes that so many members do best with: as many as the processor does, unless half of them would be empty."""
    lanes = best_width()
    while lanes > WIDTHS[0] and 2 * members <= lanes:
        lanes //= 2
    return lanes


def fastest(times: dict[int, float]) -> int:
    """Return the number of lanes of the least time, or fewer where these take hardly more."""
    chosen = min(times)
    for width in sorted(times):
        if times[width] < BETTER * times[chosen]:
            chosen = width
    return chosen


def measured() -> dict[int, float]:
    """Return the time of a step of a point on a sphere in a lane, s, by the number of lanes, the least of several in turns."""
    kernels = {width: _kernel(width) for width in WIDTHS}
    counts = np.zeros((1, COLUMNS), dtype=np.int64)
    times = dict.fromkeys(WIDTHS, np.inf)
    for turn in range(REPEATS + 1):
        for width, kernel in kernels.items():
            numbers = np.repeat([[1.0], [1.0], [1.0], [1.0], [-1.0], [0.0]], COLUMNS, axis=1)
            began = time.perf_counter()
            kernel(numbers, counts, ITERATIONS)
            if turn:
                times[width] = min(times[width], (time.perf_counter() - began) / ITERATIONS / COLUMNS)
    return times


def _kernel(lanes: int) -> Native:
    """Return a function that takes steps of points in the columns of an array."""
    source = f"LANES = {lanes}\n{POINTS}"
    module = ModuleType(f"points_in_{lanes}_lanes", "points on spheres, to choose the number of lanes")
    vars(module).update(__file__=module.__name__, __digest__=hashlib.sha256(source.encode()).hexdigest())
    return Native(module, source, "turned", cached=False)


POINTS = """
def along(w, x, y):
    return w * x[0] + y[0], w * x[1] + y[1], w * x[2] + y[2]

def product(x, y):
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2]

def norm(x):
    return abs(x[0]) + abs(x[1]) + abs(x[2])

def step(q0, v0):
    dq, nu = (0.02 * v0[0], 0.02 * v0[1], 0.02 * v0[2]), 0.0 * v0[0]
    for _ in range(9):
        q = along(1.0, dq, q0)
        change = (product(q, q) - 3.0) / (2.0 * product(q, q0))
        back = change * q0[0], change * q0[1], change * q0[2]
        dq, nu = along(-1.0, back, dq), nu + change
        if not anyof((norm(back) > 1e-15 * max(1.0, norm(q))) & (norm(back) < numpy.inf)):
            break
    q1, v1 = along(1.0, dq, q0), along(-50.0 * nu, q0, v0)
    return q1, along(-1.0 * product(q1, v1) / product(q1, q1), q1, v1)

def turned(numbers, counts, iterations):
    for b in range(0, numbers.shape[1], LANES):
        live = take_all(0, counts, 0, b, LANES) == 0
        form = (0.0, 0.0, 0.0)
        q, v = take_all((form, form), numbers, 0, b, LANES)
        for _ in range(iterations):
            q, v = step(q, v)
        put_all(numbers, 0, b, live, (q, v))
"""
"""Steps of RATTLE for points on spheres of radius sqrt 3, in lanes."""
