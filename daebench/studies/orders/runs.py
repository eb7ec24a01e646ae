"""The runs of one method in an order study: when to stop refining, and which errors count as round-off."""

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from daebench.diagnostics.order import OrderFit, fit_order
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.outside.method import OutsideMethod
from daebench.reference.solution import EPS, ReferenceSolution
from daebench.runs.ivp import Array, InitialValueProblem
from daebench.studies.measurable import PoissonScheme, claimed_order
from daebench.studies.orders.series import Point, Series
from daebench.studies.orders.step_sizes import COMMON

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
