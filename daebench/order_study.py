"""The orders of methods, measured: errors against step size for each component apart, and what slope they have.

Errors are taken at the common times t = T k/8, k = 1, ..., 8, which every step size meets exactly: h = T/(8 n) with whole n. The
error of a component at one time is the Euclidean norm over its entries, in the problem's own units; that of a run is the largest
over the common times. A raw multiplier that belongs to grid points is taken at those that are common times; one that belongs to
times inside of a step in the steps that begin at a common time, against the reference at the very time it belongs to.

By default the step sizes depend on the order that is claimed, for a method of high order reaches round-off in a few halvings from
T/8, while one of order 1 may show it at very small steps only. Methods of order 5 and more are given three step sizes between the
halvings, at which raw multipliers are not measured. Refinement ends where q and p have not fallen any more for two step sizes, near
round-off or below what the reference is good for, and after a run of more than a second.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd

from daebench.api import scene_of
from daebench.diagnostics.order import OrderFit, fit_order
from daebench.errors import BadInput
from daebench.fixed_step import FixedStep
from daebench.inputs import positive
from daebench.method import Method, Request
from daebench.names import parse
from daebench.order_ladder import COMMON, ladder
from daebench.order_series import OrderStudy, Point, Series
from daebench.scene import Array, Scene
from daebench.trajectory import Trajectory
from daebench.truth import EPS, Truth, multipliers_between, reach, truth

if TYPE_CHECKING:
    from daebench.problem import ConstrainedHamiltonian

LONG, LONGEST = 256, 2.0**10
"""The default end time is at most so many steps of DOP853 at 1e-13, and at most so long, s: what is at rest has no time of its own."""

ROUND_OFF = 500.0
"""Of errors up to so many units of rounding of the largest state, rounding is a per cent and more."""

NEAR = 1e-9
"""Round-off is looked for below this error, relative to the largest state."""

HIGH = 1e-6
"""Errors above this, relative to the largest state, are not due to rounding; raw multipliers have it divided by h^2."""

FAR, LIMIT = 100.0, 1.01
"""Errors have a limit other than 0 where the finest three are this far above the floor and differ by a factor below this one."""

FALLEN = 0.7
"""An error has fallen where it is at most so many times the least at larger steps."""

CLEAR = 100.0
"""Errors must be so many times those at which falling ended, for local slopes between close step sizes feel one per cent of them."""

SLOW = 1.0
"""Seconds of a run after which no finer one is made, unless it was asked for."""

STATE = ("q", "p", "lam")
"""Components that every method has."""

ON_GRID = 1e-6
"""Times this close to a grid point, in steps, are it."""

MOST_RAW = 2e7
"""Raw multipliers are measured in runs of at most so many numbers, for those of all steps have to be kept."""

Began = Callable[[float, str], None]
"""Told the fraction done and what is being done."""


def order(
    problem: "str | ConstrainedHamiltonian",
    *,
    methods: Sequence[str | Method],
    case: str | None = None,
    t_end: float | None = None,
    h: float | None = None,
    halvings: int | None = None,
    parameters: Mapping[str, float] | None = None,
) -> pd.DataFrame:
    """Return one row for each method and component: claimed and measured order, and how many points were used.

    Takes what :func:`study` takes besides a scene, and raises what it raises.

    Returns
    -------
    DataFrame
        Columns method, component, claimed, order, order_error (its standard error), used, points, dropped, note.
    """
    return study(scene_of(problem, case, parameters), methods, t_end=t_end, h=h, halvings=halvings).table()


def study(
    scene: Scene,
    methods: Sequence[str | Method],
    *,
    t_end: float | None = None,
    h: float | None = None,
    halvings: int | None = None,
    began: Began | None = None,
) -> OrderStudy:
    """Return the errors and orders of several methods on one scene; all requests are checked before the first run.

    Parameters
    ----------
    scene : Scene
        A problem with consistent initial values.
    methods : sequence of str or Method
        Fixed-step methods, or their names.
    t_end : float, optional
        End time T, s; by default the power of two that 256 steps of DOP853 at 1e-13 just reach, at most 1024.
    h : float, optional
        Largest step size, s, rounded down to T/(8 n). By default it depends on the order that a method claims.
    halvings : int, optional
        How often it is halved. By default until round-off is reached, see above.
    began : callable, optional
        Told the fraction done and what is being done.

    Raises
    ------
    BadInput
        If a method is unknown, is not a fixed-step method or refuses the problem, or a number is not what it must be.
    RunFailed
        If there is no reference.
    """
    chosen = [_fixed_step(each, scene) for each in methods]
    if not chosen:
        raise BadInput("an order study needs at least one method, for example rattle.")
    end = positive("t_end", t_end) if t_end is not None else min(LONGEST, 2.0 ** math.floor(math.log2(reach(scene, LONG))))
    ladders = [ladder(end, method.claims.order, h, halvings) for method in chosen]
    known = truth(scene, [end * k / COMMON for k in range(1, COMMON + 1)])
    series: list[Series] = []
    for k, (method, counts) in enumerate(zip(chosen, ladders, strict=True)):
        if began:
            began(k / len(chosen), f"{method.name} on {scene.problem}")
        series += _Bench(scene, method, known).series(counts, stop=halvings is None)
    return OrderStudy(scene, end, known, tuple(series))


def _fixed_step(method: str | Method, scene: Scene) -> FixedStep:
    found = parse(method) if isinstance(method, str) else method
    if not isinstance(found, FixedStep):
        raise BadInput(f"{found.name} chooses its own steps, so that it has no order in h; give fixed-step methods, for example rattle.")
    if refusal := found.refusal(scene):
        raise BadInput(refusal)
    return found


@dataclass(frozen=True)
class _Bench:
    """Where the runs of one method are made and held against the reference at the common times."""

    scene: Scene
    method: FixedStep
    known: Truth

    def series(self, counts: Sequence[int], *, stop: bool) -> list[Series]:
        """Return the components, measured with these numbers of steps between common times, or until it is enough."""
        points: list[Point] = []
        for n in counts:
            points.append(self._point(n, halved=math.log2(n / counts[0]).is_integer()))
            if stop and (points[-1].seconds > SLOW or self._spent(points)):
                break
        names = dict.fromkeys(name for point in points for name in point.errors)
        return [self._component(name, points) for name in names or STATE]

    @property
    def _raw(self) -> Mapping[str, float]:
        """Names and nodes of the raw multipliers; those of a composition belong to its substeps and are not given."""
        return {} if self.method.composition else self.method.member.multipliers()

    def _component(self, name: str, points: Sequence[Point]) -> Series:
        own = tuple(point for point in points if point.failure or name in point.errors)
        state = name in STATE
        errors = [point.errors.get(name, math.nan) for point in own]
        known = name if state else "lam"
        rest = CLEAR * self._rest([error for error in errors if math.isfinite(error)], known)
        floor = max(self._floor(known), rest, *(point.bound for point in own))
        fit = fit_order([point.h for point in own], errors, floor=floor)
        fit = _plateaus_named(fit, errors, floor, high=HIGH * self._size(name) if state else math.inf)
        return Series(self.method.name, name, self.method.claims.order if state else None, own, fit, floor)

    def _floor(self, name: str) -> float:
        return max(self.known.bound[name], ROUND_OFF * EPS * self._size(name))

    def _least(self, name: str) -> float:
        return max(self.known.bound[name], EPS * self._size(name))

    def _size(self, name: str) -> float:
        return _largest(getattr(self.known, name))

    def _rest(self, errors: Sequence[float], name: str) -> float:
        """Return the larger of the finest two errors if neither has fallen, where that is to be expected; else 0."""
        late = errors[-2:]
        if len(errors) < 3 or max(late) > NEAR * self._size(name):
            return 0.0
        return max(late) if all(x > FALLEN * min(errors[: k - 2]) for k, x in enumerate(late)) else 0.0

    def _spent(self, points: Sequence[Point]) -> bool:
        """Whether the errors of q and p in the last two points have not fallen, or are below what can be told."""
        good = {name: [point.errors[name] for point in points if not point.failure] for name in ("q", "p")}
        return all(self._rest(errors, name) > 0 or max(errors[-2:], default=math.inf) <= self._least(name) for name, errors in good.items())

    def _point(self, n: int, *, halved: bool) -> Point:
        """Return the errors of the run with n steps from one common time to the next; raw multipliers only after halvings.

        The rounding of a state makes an error in a raw multiplier that grows with 1/h, so that slopes between close step sizes are lost.
        """
        steps = COMMON * n
        h = float(self.known.t[-1]) / steps
        raw = bool(self._raw) and steps * (2 * self.scene.d + len(self._raw) * self.scene.m) <= MOST_RAW
        run = self.method.solve(self.scene, Request(value=h, steps=steps, every=1 if raw else n, raw=raw, watch=(), count=False))
        if run.interrupted:
            raise KeyboardInterrupt
        if run.failure is not None:
            return Point(h, steps, {}, run.failure, run.seconds)
        errors, bound = self._raw_errors(run, n) if halved else ({}, 0.0)
        return Point(h, steps, self._state_errors(run) | errors, seconds=run.seconds, bound=bound)

    def _state_errors(self, run: Trajectory) -> dict[str, float]:
        stride = (len(run.t) - 1) // COMMON
        q, p = run.q[stride::stride], run.p[stride::stride]
        found = {"q": q, "p": p, "lam": self.scene.along("lam", p, q)}
        return {name: _largest(rows - getattr(self.known, name)) for name, rows in found.items()}

    def _raw_errors(self, run: Trajectory, n: int) -> tuple[dict[str, float], float]:
        if not run.raw:
            return {}, 0.0
        chosen = {name: self._at_common_times(*series, run.value, n) for name, series in run.raw.items()}
        times = np.concatenate([t for t, _ in chosen.values()])
        exact, bound = multipliers_between(self.scene, self.known, times)
        parts = np.split(exact, np.cumsum([len(t) for t, _ in chosen.values()])[:-1])
        return {name: _largest(chosen[name][1] - part) for name, part in zip(chosen, parts, strict=True)}, bound

    def _at_common_times(self, t: Array, values: Array, h: float, n: int) -> tuple[Array, Array]:
        """Return the times and values at common times, or in the steps that begin there; the grid's times exactly."""
        step = np.rint(t / h)
        if np.all(np.abs(t / h - step) < ON_GRID):
            kept = step % n == 0
            return np.concatenate([[0.0], self.known.t])[(step[kept] // n).astype(int)], values[kept]
        kept = np.floor(t / h) % n == 0
        return t[kept], values[kept]


def _plateaus_named(fit: OrderFit, errors: Sequence[float], floor: float, high: float) -> OrderFit:
    """Return the fit with "plateau" in place of "round-off" where what stops the errors from falling is no rounding.

    That is so above ``high``, and where errors have a limit, which rounding, being random, has not.
    """
    finest = [error for error in errors if math.isfinite(error)][-3:]
    limit = len(finest) == 3 and min(finest) > FAR * floor and max(finest) < LIMIT * min(finest)
    least = floor if limit else max(floor, high)
    reasons = tuple(
        "plateau" if reason == "round-off" and error > least else reason for reason, error in zip(fit.reasons, errors, strict=True)
    )
    if reasons == fit.reasons or not fit.note:
        return replace(fit, reasons=reasons)
    why = f"tend to {finest[-1]:.3g} and not to 0" if limit else "stop falling far above rounding"
    advice = "this is not what the reference stands for" if limit else "give more step sizes, or smaller ones"
    return replace(fit, reasons=reasons, note=f"the errors {why}; {advice}.")


def _largest(rows: Array) -> float:
    """Return the largest Euclidean norm of a row, NaN if there is one in it."""
    return float(np.max(np.linalg.norm(rows, axis=1)))
