"""The runs of one method in an order study: errors by component, when to stop refining, and which errors count as round-off."""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, cast

import numpy as np

from daebench.diagnostics.order import OrderFit, fit_order
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.outside.method import OutsideMethod
from daebench.reference.solution import EPS, ReferenceSolution, multipliers_between
from daebench.runs.ivp import Array, ConstrainedIvp, InitialValueProblem, PoissonIvp
from daebench.runs.request import Request
from daebench.runs.state import CONSTRAINED, POISSON, State
from daebench.runs.trajectory import PoissonTrajectory, Trajectory
from daebench.schemes.kernels.claims import Member
from daebench.studies.measurable import PoissonScheme, claimed_order
from daebench.studies.orders.series import COMMON, Point, Series

ROUND_OFF = 500.0
"""Of errors up to so many units of rounding of the largest state, rounding is a per cent and more."""

ADDED = 10.0
"""Of errors up to so many units of rounding of the largest state for each step, what rounding has added up to may be a large part."""

NEAR = 1e-9
"""Round-off is looked for below this error, relative to the largest state."""

HIGH = 1e-6
"""Errors of states above this, relative to the largest state, are not due to rounding; those of stage multipliers, eps/h^2, may be."""

FAR, LIMIT = 100.0, 1.01
"""Errors have a limit other than 0 where the finest three are this far above the floor and differ by a factor below this one."""

FALLEN = 0.7
"""An error has fallen where it is at most so many times the least at larger steps."""

CLEAR = 100.0
"""Errors must be so many times those at which falling ended, for local slopes between close step sizes feel one per cent of them."""

SLOW = 1.0
"""Seconds of a run after which no finer one is made, unless it was asked for."""

ON_GRID = 1e-6
"""Times this close to a grid point, in steps, are it."""

MOST_STAGE_MULTIPLIERS = 2e7
"""Stage multipliers are measured in runs of at most so many numbers, for those of all steps have to be kept."""


@dataclass(frozen=True)
class Runs(ABC):
    """The runs of one method, compared with the reference at the common times."""

    ivp: InitialValueProblem
    """What is solved."""
    method: FixedStep | PoissonScheme | OutsideMethod
    """What is measured."""
    known: ReferenceSolution
    """The reference at the common times."""
    state: ClassVar[tuple[str, ...]]
    """Components that every method has."""
    leading: ClassVar[tuple[str, ...]]
    """Those of them that decide when to stop refining."""

    def series(self, counts: Sequence[int], *, stop: bool) -> list[Series]:
        """Return the components, measured with these numbers of steps between common times, or until it is enough."""
        points: list[Point] = []
        for n in counts:
            points.append(self._point(n, halved=math.log2(n / counts[0]).is_integer()))
            if stop and (points[-1].seconds > SLOW or self._spent(points)):
                break
        names = dict.fromkeys(name for point in points for name in point.errors)
        return [self._component(name, points) for name in names or self.state]

    @abstractmethod
    def _run(self, h: float, steps: int, n: int) -> Any:
        """Return the trajectory with a state, at least, after every n steps."""

    @abstractmethod
    def _errors(self, run: Any, n: int, *, halved: bool) -> tuple[dict[str, float], float]:
        """Return the errors by component, and what the reference of those that are not in ``state`` may be wrong by.

        ``halved`` says that the step size is the largest one, halved again and again.
        """

    def _exact(self, name: str) -> Array:
        """Return the exact component at the common times, shape(8, k)."""
        return self.known.states[name]

    @abstractmethod
    def _floor(self, name: str, h: Sequence[float], errors: Sequence[float]) -> float:
        """Return the error of a component that the reference and rounding may make."""

    def _component(self, name: str, points: Sequence[Point]) -> Series:
        measured = tuple(point for point in points if point.failure or name in point.errors)
        state = name in self.state
        h, errors = [point.h for point in measured], [point.errors.get(name, math.nan) for point in measured]
        rest = CLEAR * self._rest([error for error in errors if math.isfinite(error)], name)
        floor = max(self._floor(name, h, errors), rest, self._added(name, measured), *(point.bound for point in measured))
        fit = fit_order(h, errors, floor=floor)
        fit = _plateaus_named(fit, errors, floor, high=HIGH * self._size(name) if state else math.inf)
        return Series(self.method.name, name, claimed_order(self.method) if state else None, measured, fit, floor)

    def _size(self, name: str) -> float:
        return largest(self._exact(name))

    def _rest(self, errors: Sequence[float], name: str) -> float:
        """Return the larger of the finest two errors if neither has fallen, where that is to be expected; else 0."""
        late = errors[-2:]
        if len(errors) < 3 or max(late) > NEAR * self._size(name):
            return 0.0
        return max(late) if all(x > FALLEN * min(errors[: k - 2]) for k, x in enumerate(late)) else 0.0

    def _added(self, name: str, points: Sequence[Point]) -> float:
        """Return the largest error of a component of the state that roundings, one a step, may have added up to; 0 if there is none."""
        size = self._size(name) if name in self.state else 0.0
        errors = [(point.errors.get(name, math.nan), ADDED * EPS * size * point.steps) for point in points]
        return max((error for error, most in errors if error <= most), default=0.0)

    def _spent(self, points: Sequence[Point]) -> bool:
        """Whether the leading errors in the last two points have not fallen, or are below what can be told."""
        good = {name: [point.errors[name] for point in points if not point.failure] for name in self.leading}
        least = {name: max(self.known.bound[name], EPS * self._size(name)) for name in good}
        return all(self._rest(errors, name) > 0 or max(errors[-2:], default=math.inf) <= least[name] for name, errors in good.items())

    def _point(self, n: int, *, halved: bool) -> Point:
        """Return the errors of the run with n steps from one common time to the next."""
        steps = COMMON * n
        h = float(self.known.t[-1]) / steps
        run = self._run(h, steps, n)
        if run.failure is not None:
            return Point(h, steps, {}, run.failure, run.seconds)
        errors, bound = self._errors(run, n, halved=halved)
        return Point(h, steps, errors, seconds=run.seconds, bound=bound)


def at_common_times(rows: Array) -> Array:
    """Return those of equidistant states, the start among them, that are at the common times."""
    stride = (len(rows) - 1) // COMMON
    return rows[stride::stride]


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


def largest(rows: Array) -> float:
    """Return the largest Euclidean norm of a row, NaN if there is one in it."""
    return float(np.max(np.linalg.norm(rows, axis=1)))


@dataclass(frozen=True)
class Bench(Runs):
    """Where the runs of one method are made and compared with the reference at the common times."""

    ivp: ConstrainedIvp
    """What is solved."""
    method: FixedStep | OutsideMethod
    """What is measured."""
    leading = ("q", "p")

    @property
    def state(self) -> tuple[str, ...]:  # type: ignore[override]
        """Components that are compared: lam too, where there is one."""
        return ("q", "p", "lam") if self.ivp.m else ("q", "p")

    @property
    def _member(self) -> Member | None:
        """The scheme in its file; None of a composition, and of a method from outside."""
        return None if isinstance(self.method, OutsideMethod) or self.method.composition else self.method.member

    @property
    def _stage_multipliers(self) -> Mapping[str, float]:
        """Names and nodes of the stage multipliers; those of a composition belong to its substeps and are not given."""
        return self._member.multipliers() if self._member and self.ivp.m else {}

    def _exact(self, name: str) -> Array:
        return self.known.states[self._like(name)]

    def _like(self, name: str) -> str:
        """Return the component that one is compared with: stage multipliers stand for lam."""
        return name if name in self.state else "lam"

    def _floor(self, name: str, h: Sequence[float], errors: Sequence[float]) -> float:
        size = max(self._size("p"), self._push()) if name == "p" else self._size(name)
        lost = 0.0 if name in self.state else self._lost(h, errors)
        return max(self.known.bound[self._like(name)], ROUND_OFF * EPS * size, lost)

    def _push(self) -> float:
        """Return the change of a momentum by the forces in T/32: their rounding is in p, however small they leave it."""
        return largest(self.ivp.along("H_q", self.known.states["p"], self.known.states["q"])) * float(self.known.t[-1]) / 32

    def _lost(self, h: Sequence[float], errors: Sequence[float]) -> float:
        """Return the largest error of a stage multiplier that the rounding of positions may have made, eps |G| |q| / (h^2 G M^-1 G^T)."""
        p, q = (self.known.states[name][:1] for name in ("p", "q"))
        G, M_inverse = self.ivp.along("G", q)[0], self.ivp.along("H_pp", p, q)[0]
        least = float(np.linalg.svd(G @ M_inverse @ G.T, compute_uv=False)[-1])
        unit = EPS * float(np.linalg.norm(G)) * self._size("q") / least
        return max((error for step, error in zip(h, errors, strict=True) if error * step * step <= CLEAR * unit), default=0.0)

    def _run(self, h: float, steps: int, n: int) -> Trajectory:
        stage_multipliers = (
            bool(self._stage_multipliers) and steps * (2 * self.ivp.d + len(self._stage_multipliers) * self.ivp.m) <= MOST_STAGE_MULTIPLIERS
        )
        request = Request(value=h, steps=steps, every=1 if stage_multipliers else n, raw=stage_multipliers, watch=(), count=False)
        return cast(Trajectory, self.method.solve(self.ivp, request))

    def _errors(self, run: Trajectory, n: int, *, halved: bool) -> tuple[dict[str, float], float]:
        """Return the errors and the bound; stage multipliers only after halvings.

        The rounding of a state makes an error in a stage multiplier that grows with 1/h, so that slopes between close step sizes are lost.
        """
        errors, bound = self._raw_errors(run, n) if halved else ({}, 0.0)
        return self._state_errors(run) | errors, bound

    def _state_errors(self, run: Trajectory) -> dict[str, float]:
        q, p = at_common_times(run.q), at_common_times(run.p)
        states = {"q": q, "p": p} | ({"lam": self.ivp.along("lam", p, q)} if self.ivp.m else {})
        return {name: largest(rows - self._exact(name)) for name, rows in states.items()}

    def _raw_errors(self, run: Trajectory, n: int) -> tuple[dict[str, float], float]:
        if not run.raw:
            return {}, 0.0
        chosen = {name: self._at_common_times(*series, run.value, n) for name, series in run.raw.items()}
        times = np.concatenate([t for t, _ in chosen.values()])
        exact, bound = multipliers_between(self.ivp, self.known, times)
        parts = np.split(exact, np.cumsum([len(t) for t, _ in chosen.values()])[:-1])
        vanishing = self._member.vanishing if self._member else ()
        parts = [0.0 * part if name in vanishing else part for name, part in zip(chosen, parts, strict=True)]
        return {name: largest(chosen[name][1] - part) for name, part in zip(chosen, parts, strict=True)}, bound

    def _at_common_times(self, t: Array, values: Array, h: float, n: int) -> tuple[Array, Array]:
        """Return the times and values at common times, or in the steps that begin there; the grid's times exactly."""
        step = np.rint(t / h)
        if np.all(np.abs(t / h - step) < ON_GRID):
            mask = step % n == 0
            return np.concatenate([[0.0], self.known.t])[(step[mask] // n).astype(int)], values[mask]
        mask = np.floor(t / h) % n == 0
        return t[mask], values[mask]


@dataclass(frozen=True)
class PoissonBench(Runs):
    """Where the runs of one method are made and compared with the reference at the common times."""

    ivp: PoissonIvp
    """What is solved."""
    method: PoissonScheme
    """What is measured."""
    state = leading = ("y",)

    def _floor(self, name: str, h: Sequence[float], errors: Sequence[float]) -> float:
        return max(self.known.bound["y"], ROUND_OFF * EPS * self._size("y"))

    def _run(self, h: float, steps: int, n: int) -> PoissonTrajectory:
        return self.method.solve(self.ivp, Request(value=h, steps=steps, every=n, watch=(), count=False))

    def _errors(self, run: PoissonTrajectory, n: int, *, halved: bool) -> tuple[dict[str, float], float]:
        return {"y": largest(at_common_times(run.y) - self._exact("y"))}, 0.0


BENCHES: Mapping[State, Any] = {CONSTRAINED: Bench, POISSON: PoissonBench}
