"""Fixed-step methods: a scheme linked to a problem, and the run around the compiled loop."""

import importlib
import pickle
import time
import types
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from daebench.cache import damaged, generated
from daebench.claims import Claims
from daebench.errors import BadInput, RunFailed
from daebench.grid import Grid
from daebench.method import Request
from daebench.scene import Scene
from daebench.trajectory import WATCH, WORK, Array, Trajectory

REASONS = {
    1: ("Newton's iteration did not converge in 40 sweeps, residual {:.2e}", "use a smaller h"),
    2: ("the iteration matrix is singular to round-off, residual {:.2e}", "see whether constraints are redundant or G has lost rank there"),
    3: ("a value is no longer finite, residual {:.2e}", "use a smaller h, and see whether the motion has left the domain of H"),
    4: ("a watched quantity is not finite after this step", "see whether parameters and state are in the range of double precision"),
}
"""Why a scheme stopped, and what to do, by the status of its report."""

CHUNK_SECONDS = 0.2
Flow = Callable[[Sequence[complex], Sequence[complex]], tuple[Sequence[complex], Sequence[complex]]]


@dataclass(frozen=True)
class FixedStep:
    """A scheme of ``daebench.schemes`` run with constant step size.

    Parameters
    ----------
    scheme : str
        Name of the scheme, which is the name of its file.
    compiled : bool
        Whether the kernel is handed to numba.
    """

    scheme: str
    compiled: bool = True
    knob = "h"

    @property
    def name(self) -> str:
        """Name in the grammar of methods."""
        return self.scheme

    @cached_property
    def claims(self) -> Claims:
        """What the scheme says of itself."""
        claims = importlib.import_module(f"daebench.schemes.{self.scheme}").CLAIMS
        assert isinstance(claims, Claims)
        return claims

    def refusal(self, scene: Scene) -> str | None:
        """Return why the scheme cannot be used on this problem, as a sentence, or None."""
        if self.claims.separable_only and not scene.sheet.SEPARABLE:
            return f"{self.scheme} needs H = 1/2 p^T M^-1 p + U(q) with constant M, which {scene.problem} does not have; use rattle."
        return None

    def kernel(self, scene: Scene, precision: str, watch: tuple[str, ...], *, count: bool) -> types.ModuleType:
        """Return the generated module of this scheme and problem."""

        def build(cached: bool) -> str:
            from daebench.link import Linker, Options

            options = Options(precision=precision, watch=watch, count=count, compiled=self.compiled)
            linker = Linker(scene.source.derivation, options, f"daebench.schemes.{self.scheme}")
            loop = "daebench.kernels.loop"
            roots = [(loop, name) for name in ("integrate", "begin", "first") if name != "begin" or linker.constants["MULTISTEP"]]
            return linker.module(f"{self.scheme} on {scene.problem}, {precision}.", roots, cached)

        stem = f"{scene.problem}_{self.scheme}_{precision}"
        return generated(stem, f"{scene.source.key} {self.scheme} {precision} {watch} {count} {self.compiled}", build)

    def solve(self, scene: Scene, request: Request) -> Trajectory:
        """Return the trajectory; where the scheme stops early, what was computed so far and why.

        Raises
        ------
        BadInput
            If the request cannot be met: see :class:`daebench.grid.Grid`.
        """
        return _Run(self, scene, request, self._grid(scene, request)).trajectory()

    def check(self, scene: Scene, request: Request) -> None:
        """Accept a request that can be met; raise :class:`BadInput` otherwise."""
        self._grid(scene, request)

    def _grid(self, scene: Scene, request: Request) -> Grid:
        if refusal := self.refusal(scene):
            raise BadInput(refusal)
        return Grid.fixed_step(self.name, request, scene.d)

    def flow(self, scene: Scene, h: float, steps: int) -> Flow:
        """Return the map of ``steps`` steps for complex states, exact to first order in the imaginary part.

        The map raises :class:`RunFailed` where the scheme has no solution.
        """
        kernel = self.kernel(scene, "complex128", (), count=False)
        empty = np.empty((0, scene.d), dtype=complex)

        def phi(p: Sequence[complex], q: Sequence[complex]) -> tuple[Sequence[complex], Sequence[complex]]:
            state = tuple(np.complex128(x) for x in p), tuple(np.complex128(x) for x in q)
            with np.errstate(all="ignore"):
                memory, report = kernel.begin(*state, h, scene.par) if hasattr(kernel, "begin") else ((), (0,))
                if report[0]:
                    raise RunFailed(failure(self.name, scene, h, 0, steps, report))
                result = kernel.integrate(*state, memory, (), (), np.inf, h, steps, -1, 0, empty, empty, scene.par)
            if result[-1][0]:
                raise RunFailed(failure(self.name, scene, h, result[5], steps, result[-1]))
            return result[0], result[1]

        return phi


def failure(name: str, scene: Scene, h: float, done: int, steps: int, report: Sequence[Any]) -> str:
    """Return the sentence that says where a scheme stopped and why."""
    where = f"{name} on {scene.problem}, case {scene.case}, stopped at t = {done * h:.9g} (step {done + 1} of {steps}, h = {h:g})"
    why, advice = REASONS[report[0]]
    return f"{where}: {why.format(float(report[1]))}; {advice}."


class _Run:
    """One run: the compiled loop called piece by piece, so that it can be watched and interrupted."""

    def __init__(self, method: FixedStep, scene: Scene, request: Request, grid: Grid) -> None:
        self.method, self.scene, self.request, self.grid = method, scene, request, grid
        began = time.perf_counter()
        self.watch = tuple(name for name in WATCH if name in request.watch)
        self.kernel = method.kernel(scene, request.precision, self.watch, count=request.count)
        self.number: Callable[[Any], Any] = (
            np.dtype(request.precision).type if request.precision == "float32" or not method.compiled else float
        )
        self.zero, self.infinity = self.typed(0.0), self.typed(np.inf)
        self.par, self.h = self.typed(scene.par), self.typed(grid.h)
        self.p, self.q = self.typed(tuple(scene.p0)), self.typed(tuple(scene.q0))
        self.names = _watched_names(self.watch, scene)
        self.P, self.Q = (np.empty((grid.rows, scene.d), dtype=request.precision) for _ in range(2))
        self.done, self.row, self.left = 0, 0, grid.every or -1
        self.work = np.zeros(len(WORK), dtype=np.int64)
        self.seconds = 0.0
        self.failure: str | None = None
        self.interrupted = False
        with np.errstate(all="ignore"):
            try:
                self._prepare()
            except (EOFError, pickle.UnpicklingError) as error:
                raise damaged(self.kernel) from error
        self.compile_seconds = time.perf_counter() - began

    def typed(self, x: Any) -> Any:
        """Return a number or nested tuple in the run's number type, which is lost when a kernel hands a float32 back to Python."""
        return tuple(map(self.typed, x)) if isinstance(x, tuple) else self.number(x)

    def _prepare(self) -> None:
        """Make the first memory and the conserved quantities, and have the loop compiled."""
        self.conserved = self.typed(self.kernel.first(self.p, self.q, self.par))
        self.maxima: Any = tuple(self.zero for _ in self.names)
        self.pivot = self.infinity
        self.memory: Any = ()
        report: Any = (0, self.zero, self.infinity, ())
        if hasattr(self.kernel, "begin"):
            memory, report = self.kernel.begin(self.p, self.q, self.h, self.par)
            self.memory = self.typed(memory)
            self.work += self._tally(self.kernel.EACH_START, 1) + self._tally(report[3], 1)
        if report[0]:
            self.failure = self._sentence(report)
        self._call(0)

    def _tally(self, counts: Sequence[int], times: int) -> Any:
        return times * np.array(counts, dtype=np.int64) if self.request.count and len(counts) else np.zeros(len(WORK), dtype=np.int64)

    def _sentence(self, report: Sequence[Any]) -> str:
        return failure(self.method.name, self.scene, self.grid.h, self.done, self.grid.steps, report)

    def _call(self, steps: int) -> Any:
        P, Q = self.P[self.row :], self.Q[self.row :]
        state = (self.p, self.q, self.memory, self.conserved, self.maxima, self.pivot)
        return self.kernel.integrate(*state, self.h, steps, self.left, self.grid.every, P, Q, self.par)

    def _advance(self, steps: int) -> float:
        """Take so many steps, or as many as there are; return the CPU time it took."""
        began = time.thread_time()
        with np.errstate(all="ignore"):
            result = self._call(steps)
        took = time.thread_time() - began
        self.p, self.q, self.memory, self.maxima, self.pivot = self.typed(result[:5])
        done, rows, self.left, work, report = result[5:]
        self.done, self.row = self.done + done, self.row + rows
        self.work += self._tally(work, 1) + self._tally(self.kernel.EACH_STEP, done + (report[0] != 0))
        self.seconds += took
        if report[0]:
            self.failure = self._sentence(report)
        return took

    def _march(self) -> None:
        """Take all steps, in pieces of a fifth of a second."""
        piece, limit = 64, time.perf_counter() + (self.request.seconds_limit or np.inf)
        while self.done < self.grid.steps and self.failure is None:
            took = self._advance(min(piece, self.grid.steps - self.done))
            piece = int(min(8 * piece, max(1, piece * CHUNK_SECONDS / max(took, 1e-6))))
            if self.request.progress:
                self.request.progress(self.done / self.grid.steps)
            if self.failure is None and self.done < self.grid.steps and time.perf_counter() > limit:
                self.failure = self._stopped(f"the limit of {self.request.seconds_limit:g} s is reached")

    def _stopped(self, why: str) -> str:
        t = self.done * self.grid.h
        return f"{self.method.name} on {self.scene.problem}, case {self.scene.case}, stopped at t = {t:.9g}: {why}."

    def trajectory(self) -> Trajectory:
        """Run, and return what there is."""
        try:
            self._march()
        except KeyboardInterrupt:
            self.failure, self.interrupted = self._stopped("interrupted"), True
        scene, request = self.scene, self.request
        t, p, q = self._outputs()
        return Trajectory(
            problem=scene.problem,
            case=scene.case,
            method=self.method.name,
            parameters=dict(scene.parameters),
            knob="h",
            value=self.grid.h,
            t=t,
            q=q,
            p=p,
            lam=scene.along("lam", p, q) if request.multipliers else None,
            steps=self.done,
            work=dict(zip(WORK, map(int, self.work), strict=True)) if request.count else {},
            maxima=dict(zip(self.names, map(float, self.maxima), strict=True)),
            pivot=float(self.pivot) if np.isfinite(self.pivot) else None,
            seconds=self.seconds,
            compile_seconds=self.compile_seconds,
            failure=self.failure,
            interrupted=self.interrupted,
        )

    def _outputs(self) -> tuple[Array, Array, Array]:
        """Return t, p and q: the start, what the loop stored, and the end."""
        index = self.grid.every * np.arange(1, self.row + 1)
        end = [self.done] if self.done and (not len(index) or index[-1] != self.done) else []
        last_p, last_q = (np.array([x] * len(end), dtype=float).reshape(-1, self.scene.d) for x in (self.p, self.q))
        p = np.concatenate([self.scene.p0[None], self.P[: self.row].astype(float), last_p])
        q = np.concatenate([self.scene.q0[None], self.Q[: self.row].astype(float), last_q])
        return np.array([0, *index, *end], dtype=float) * self.grid.h, p, q


def _watched_names(watch: Sequence[str], scene: Scene) -> list[str]:
    names = {"energy": ["energy"], "manifold": ["g", "Gv"], "integrals": list(scene.integrals)}
    return [name for each in watch for name in names[each]]
