"""The runs of one method in an order study: errors against the reference, when to stop refining, and which errors count as round-off."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from daebench.diagnostics.order import OrderFit, fit_order
from daebench.fixed_step import FixedStep
from daebench.method import Request
from daebench.order_ladder import COMMON
from daebench.order_series import Point, Series
from daebench.scene import Array, Scene
from daebench.trajectory import Trajectory
from daebench.truth import EPS, Truth, multipliers_between

ROUND_OFF = 500.0
"""Of errors up to so many units of rounding of the largest state, rounding is a per cent and more."""

NEAR = 1e-9
"""Round-off is looked for below this error, relative to the largest state."""

HIGH = 1e-6
"""Errors of q, p and lam above this, relative to the largest state, are not due to rounding; those of raw multipliers, eps/h^2, may be."""

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


@dataclass(frozen=True)
class Bench:
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
        lost = 0.0 if state else self._lost([point.h for point in own], errors)
        floor = max(self._floor(known), rest, lost, *(point.bound for point in own))
        fit = fit_order([point.h for point in own], errors, floor=floor)
        fit = _plateaus_named(fit, errors, floor, high=HIGH * self._size(name) if state else math.inf)
        return Series(self.method.name, name, self.method.claims.order if state else None, own, fit, floor)

    def _floor(self, name: str) -> float:
        size = max(self._size("p"), self._push()) if name == "p" else self._size(name)
        return max(self.known.bound[name], ROUND_OFF * EPS * size)

    def _push(self) -> float:
        """Return what the forces make of a momentum in T/32: their rounding is in p, however small they leave it."""
        return _largest(self.scene.along("H_q", self.known.p, self.known.q)) * float(self.known.t[-1]) / 32

    def _lost(self, h: Sequence[float], errors: Sequence[float]) -> float:
        """Return the largest error of a raw multiplier that the rounding of positions may have made, eps |G| |q| / (h^2 G M^-1 G^T)."""
        p, q = self.known.p[:1], self.known.q[:1]
        G, M_inverse = self.scene.along("G", q)[0], self.scene.along("H_pp", p, q)[0]
        least = float(np.linalg.svd(G @ M_inverse @ G.T, compute_uv=False)[-1])
        unit = EPS * float(np.linalg.norm(G)) * self._size("q") / least
        return max((error for each, error in zip(h, errors, strict=True) if error * each * each <= CLEAR * unit), default=0.0)

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
        parts = [0.0 * part if name in self.method.member.vanishing else part for name, part in zip(chosen, parts, strict=True)]
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
