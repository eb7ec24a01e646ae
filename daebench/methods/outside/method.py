"""A method from outside as a method: its states are monitored and stored like those of a scheme of daebench."""

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.errors import BadInput, RunFailed
from daebench.methods.fixed_step.base import monitored_names
from daebench.runs.grid import Grid
from daebench.runs.ivp import ConstrainedIvp, Ivp, PoissonIvp
from daebench.runs.request import Request
from daebench.runs.trajectory import CONSTRAINED, POISSON, Array, PoissonTrajectory, Trajectory

NOT_FINITE = "a value is no longer finite"
MONITORED_NOT_FINITE = "H or a monitored quantity is not finite after this step"
SMALLER = "use a smaller h, and see whether the motion has left the domain of H"


class Stopped(Exception):
    """Code from outside cannot go on; the text says why and what to do, as the end of a sentence."""


@dataclass(frozen=True)
class Block:
    """States after some steps, as code from outside gave them.

    Parameters
    ----------
    steps : ndarray of int, shape(k,)
        Numbers of the steps after which they are.
    rows : ndarray, shape(k, size)
        The states: p and q, or y.
    seconds : float
        Time that these steps took, s.
    """

    steps: NDArray[np.int64]
    rows: Array
    seconds: float


Blocks = Callable[[Ivp, Grid, Request], Iterator[Block]]
"""Runs the code from the start of a problem over a grid; may end with :class:`Stopped`."""


@dataclass(frozen=True, kw_only=True)
class Stated:
    """What code from outside says of itself, see :class:`daebench.schemes.kernels.claims.Claims`; None where it says nothing."""

    order: int | None = None
    symmetric: bool | None = None
    symplectic: bool | None = None
    keeps_g: bool | None = None
    keeps_Gv: bool | None = None
    conserves_energy: bool | None = None

    @property
    def on_manifold(self) -> bool:
        """Whether both constraints are said to hold to round-off after every step."""
        return bool(self.keeps_g and self.keeps_Gv)


Step = Callable[..., Any]
"""``step(p, q, h)`` or ``step(y, h)``, of real or complex vectors."""


@dataclass(frozen=True)
class OutsideMethod:
    """Code from outside, run with constant step size.

    What it costs is the wall-clock time of its steps; its work is not counted.

    Parameters
    ----------
    name : str
        What it is called in tables: the text by which it was asked for, or the name of the callable.
    blocks : callable
        See :data:`Blocks`.
    content : str
        Digest of the code, which is part of the key of a stored run; "" where there is none, as for a callable.
    every_step : bool
        Whether there is a state after each step; otherwise at the outputs alone.
    step : callable, optional
        Returns a fresh :data:`Step` of a Python callable, which may compute in complex numbers.
    claims : Stated
        What the code says of itself.
    """

    name: str
    blocks: Blocks = field(repr=False)
    content: str = ""
    every_step: bool = True
    step: Callable[[], Step] | None = field(default=None, repr=False)
    claims: Stated = Stated()
    knob = "h"

    def refusal(self, ivp: Ivp) -> str | None:
        """Return None: what the code cannot do shows when it is run."""
        return None

    def check(self, ivp: Ivp, request: Request) -> None:
        """Accept a request that can be met; raise :class:`BadInput` otherwise."""
        self.grid(ivp, request)

    def grid(self, ivp: Ivp, request: Request) -> Grid:
        """Return the steps that a request comes to; raise :class:`BadInput` if it cannot be met."""
        if request.precision != "float64":
            raise BadInput(f"{self.name} computes in float64, not in {request.precision}.")
        if request.raw:
            raise BadInput(f"{self.name} is from outside, and gives no multipliers of its stages; ask for lam(p, q) instead.")
        return Grid.fixed_step(self.name, request, ivp.size)

    def is_poisson(self, ivp: PoissonIvp) -> bool:
        """Return whether it is said to be a Poisson map."""
        return bool(self.claims.symplectic)

    def keeps(self, ivp: PoissonIvp) -> frozenset[str]:
        """Return the names of what is said to be conserved to round-off on a Poisson system."""
        return frozenset({"energy"} if self.claims.conserves_energy else ())

    def flow(self, ivp: Ivp, h: float, steps: int) -> Callable[..., Any]:
        """Return the map of ``steps`` steps, (p, q) -> (p, q) or y -> y, of real states, and of complex ones where the code takes them.

        It raises :class:`RunFailed` where the code cannot go on.
        """
        if self.step is not None:
            return partial(_chained, self.step, h, steps)

        def phi(*vectors: Any) -> Any:
            if any(map(np.iscomplexobj, vectors)):
                raise TypeError(f"{self.name} takes real numbers alone")
            names = ("p0", "q0") if len(vectors) == 2 else ("y0",)
            state: dict[str, Any] = {name: np.array(vector, dtype=float) for name, vector in zip(names, vectors, strict=True)}
            start = replace(ivp, **state)
            try:
                for block in self.blocks(start, Grid(h, steps, 0), Request(value=h, steps=steps)):
                    last = block.rows[-1]
            except Stopped as stop:
                raise RunFailed(f"{self.name}: {stop}.") from None
            return np.split(last, 2) if len(vectors) == 2 else last

        return phi

    def solve(self, ivp: Ivp, request: Request) -> Trajectory | PoissonTrajectory:
        """Return the trajectory; where the code stops early, what was computed so far and why.

        Raises
        ------
        BadInput
            If the request cannot be met, or what the code returns is no state.
        """
        record = _Record(self, ivp, request, self.grid(ivp, request))
        outcome = record.outcome()
        t, rows = record.states()
        if not isinstance(ivp, ConstrainedIvp):
            return PoissonTrajectory(**outcome, t=t, y=rows)
        p, q = rows[:, : ivp.d].copy(), rows[:, ivp.d :].copy()
        return Trajectory(**outcome, t=t, q=q, p=p, lam=ivp.along("lam", p, q) if request.multipliers else None)


def _chained(fresh: Callable[[], Step], h: float, steps: int, *vectors: Any) -> Any:
    """Return what a Python callable makes of a state in so many steps."""
    step, state = fresh(), tuple(np.array(vector) for vector in vectors)
    for _ in range(steps):
        result = step(*(vector.copy() for vector in state), h)
        state = tuple(map(np.asarray, result)) if len(state) == 2 else (np.asarray(result),)
    return state if len(state) == 2 else state[0]


class _Record:
    """What a run has given so far: largest errors over all states, and the states that are kept."""

    def __init__(self, method: OutsideMethod, ivp: Ivp, request: Request, grid: Grid) -> None:
        self.method, self.ivp, self.request, self.grid = method, ivp, request, grid
        kinds = CONSTRAINED if isinstance(ivp, ConstrainedIvp) else POISSON
        self.monitored = request.watched(kinds)
        start = np.concatenate(ivp.start)[None]
        self.steps, self.rows = [np.zeros(1, dtype=np.int64)], [start]
        self.last_step, self.last = 0, start[0]
        self.conserved = self._conserved(start)[0]
        self.maxima = np.zeros(len(self.conserved))
        self.seconds, self.failure, self.interrupted = 0.0, "", False

    def _conserved(self, rows: Array) -> Array:
        """Return the monitored quantities along states, shape(k, number of quantities)."""
        ivp, columns = self.ivp, [np.empty((len(rows), 0))]
        vectors = (rows[:, : ivp.d], rows[:, ivp.d :]) if isinstance(ivp, ConstrainedIvp) else (rows,)
        for kind in self.monitored:
            if kind == "energy":
                columns.append(ivp.along("H", *vectors)[:, None])
            elif kind == "manifold":
                columns += [_largest(ivp.along("g", vectors[-1])), _largest(ivp.along("Gv", *vectors))]
            elif getattr(ivp, kind):
                columns.append(ivp.along(kind, *vectors))
        return np.concatenate(columns, axis=1)

    def take(self, block: Block) -> None:
        """Monitor and store a block of states; stop at the first that is not finite."""
        if not len(block.rows):
            return
        count = _finite(block.rows)
        finite = count == len(block.rows)
        steps, rows = block.steps[:count], block.rows[:count]
        values = self._conserved(rows)
        count = _finite(values)
        steps, rows, values = steps[:count], rows[:count], values[:count]
        self.seconds += block.seconds
        if count:
            zero = np.array([name in ("g", "Gv") for name in self.names])
            errors = np.abs(values - np.where(zero, 0.0, self.conserved))
            self.maxima = np.maximum(self.maxima, errors.max(axis=0))
            self.last_step, self.last = int(steps[-1]), rows[-1].copy()
            kept = steps % self.grid.every == 0 if self.grid.every else np.full(count, False)
            self.steps.append(steps[kept])
            self.rows.append(rows[kept])
        if count < len(block.rows):
            raise Stopped(f"{MONITORED_NOT_FINITE if finite else NOT_FINITE}; {SMALLER}")

    @property
    def names(self) -> list[str]:
        """Names of the errors that are monitored."""
        return monitored_names(self.monitored, self.ivp)

    def _march(self) -> None:
        limit = time.perf_counter() + (self.request.seconds_limit or math.inf)
        for block in self.method.blocks(self.ivp, self.grid, self.request):
            self.take(block)
            if self.request.progress:
                self.request.progress(self.last_step / self.grid.steps)
            if self.last_step < self.grid.steps and time.perf_counter() > limit:
                raise Stopped(f"the limit of {self.request.seconds_limit:g} s is reached")

    def outcome(self) -> dict[str, Any]:
        """Run, and return what a trajectory of any kind says of it."""
        try:
            self._march()
        except Stopped as stop:
            self.failure = self._sentence(str(stop))
        except KeyboardInterrupt:
            if not self.request.keep_interrupted:
                raise
            self.failure, self.interrupted = self._sentence("interrupted"), True
        return {
            "problem": self.ivp.problem,
            "case": self.ivp.case,
            "method": self.method.name,
            "parameters": dict(self.ivp.parameters),
            "knob": "h",
            "value": self.grid.h,
            "steps": self.last_step,
            "maxima": dict(zip(self.names, map(float, self.maxima), strict=True)),
            "maxima_over": "steps" if self.method.every_step else "outputs",
            "seconds": self.seconds,
            "failure": self.failure or None,
            "interrupted": self.interrupted,
        }

    def _sentence(self, why: str) -> str:
        where = f"stopped at t = {self.last_step * self.grid.h:.9g} (step {self.last_step + 1} of {self.grid.steps}, h = {self.grid.h:g})"
        return f"{self.method.name} on {self.ivp.problem}, case {self.ivp.case}, {where}: {why.rstrip('.')}."

    def states(self) -> tuple[Array, Array]:
        """Return the times and the rows of states: the start, those that are kept, and the end."""
        steps, rows = np.concatenate(self.steps), np.concatenate(self.rows)
        if steps[-1] != self.last_step:
            steps, rows = np.append(steps, self.last_step), np.concatenate([rows, self.last[None]])
        return np.asarray(steps * self.grid.h), rows


def _largest(values: Array) -> Array:
    """Return the largest modulus of each row, as a column."""
    largest: Array = np.max(np.abs(values), axis=1, keepdims=True, initial=0.0)
    return largest


def _finite(rows: Array) -> int:
    """Return how many rows there are before the first that is not finite."""
    broken = np.flatnonzero(~np.isfinite(rows).all(axis=1))
    return int(broken[0]) if len(broken) else len(rows)
