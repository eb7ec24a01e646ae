"""How a code is measured on a problem: step size, numbers of steps, and over how much of the motion."""

import math
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

from daebench.errors import BadInput
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import method_of
from daebench.methods.outside.method import OutsideMethod, Stated
from daebench.reference.solution import certified_for
from daebench.runs.ivp import Ivp
from daebench.runs.request import Request
from daebench.studies.claims.check import NO_CLAIMS, STEPS
from daebench.studies.claims.measured_run import default_step
from daebench.studies.measurable import measured

PARTS = 4
"""The step size, where none is given, is up to one of so many parts of a step of DOP853 at 1e-13."""

LONG, SHORT = 10_000, 1000
"""Steps of that size in the run from which the energy is judged, and in the one whose error is taken."""

OUTPUTS = 2000
"""States of the long run from which the energy is judged, about."""

SECONDS = 8.0
"""The long run is shortened to about so many seconds, and not to less than the short one."""


@dataclass(frozen=True)
class Setting:
    """How a code is measured on a problem, so that it can be measured in the same way again."""

    h: float
    """Step size, s, of all but the orders."""
    steps: int
    every: int
    """Steps of the run from which the energy is judged, and after how many of them a state is kept."""
    error_steps: int
    """Steps of the run whose error is taken."""
    checked_steps: int = STEPS
    """Steps of the run along which claims to keep something are held."""
    counts: tuple[int, ...] = ()
    """Steps between common times of the order study, see :mod:`daebench.studies.orders.study`; empty for those that it chooses."""


def posed(task: Mapping[str, Any]) -> tuple[Ivp, Any]:
    """Return the problem and the method of a task."""
    ivp = initial_value_problem(task["problem"], task["case"], task["parameters"], on_singular=task.get("on_singular"))
    method = measured(method_of(ivp, task["method"], task["options"], anyway=task["anyway"]), ivp, NO_CLAIMS)
    if not task["claims"]:
        return ivp, method
    if not isinstance(method, OutsideMethod):
        raise BadInput(f"{method.name} is a method of daebench, and states itself what it claims; leave claims out.")
    itself = {name: value for name, value in asdict(method.claims).items() if value is not None}
    return ivp, replace(method, claims=Stated(**{**itself, **task["claims"]}))


def default_setting(ivp: Ivp, method: Any, h: float | None = None) -> Setting:
    """Return how a code is measured where nothing else is said: over the same part of the motion, whatever the step size."""
    usual = default_step(ivp, PARTS)
    step = usual if h is None else h
    method.check(ivp, Request(value=step, steps=1))
    if step > SHORT * usual:
        raise BadInput(f"h = {step:g} is larger than the time that is looked at on {ivp.problem}, {SHORT * usual:g}; give a smaller one.")
    shortest = _steps(SHORT * usual, step)
    long = max(shortest, min(_steps(LONG * usual, step), int(SECONDS / _seconds(ivp, method, step, min(STEPS, shortest)))))
    every = max(1, long // OUTPUTS)
    reference = certified_for(ivp, 0.0)
    end = min(SHORT * usual, reference.horizon if reference else math.inf)
    return Setting(step, long // every * every, every, _steps(end, step))


def _steps(end: float, h: float) -> int:
    return max(1, math.floor(end / h + 1e-9))


def _seconds(ivp: Ivp, method: Any, h: float, steps: int) -> float:
    """Return the wall time of a step, s, with nothing compiled any more."""
    for count in (1, steps):
        began = time.perf_counter()
        method.solve(ivp, Request(value=h, steps=count, every=0, watch=())).complete()
    return (time.perf_counter() - began) / steps
