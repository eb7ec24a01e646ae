"""Effects of a fault on order, defects, constraints and energy."""

import csv
import warnings
from collections.abc import Iterator, Mapping
from functools import cache
from importlib.resources import files

import numpy as np
from numpy.typing import NDArray

from daebench.diagnostics.derivative import DerivativeWarning
from daebench.diagnostics.energy_verdict import energy_verdict
from daebench.errors import RunFailed
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.outside.callables import method_of_callable
from daebench.methods.outside.method import OutsideMethod
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.runs.make_ivp import constrained
from daebench.runs.request import Request
from daebench.studies.claims.measured_run import bench_of, default_step
from daebench.studies.diagnose.battery import EPS, LARGE, map_of, uncompiled
from daebench.studies.diagnose.faulty_steps import FAULTY_STEPS, Step
from daebench.studies.diagnose.mechanics import Mechanics, State

PROBLEMS: Mapping[str, Mapping[str, float]] = {
    "double_pendulum": {"mass2": 3.0},
    "butane": {},
    "slider_crank": {},
}
"""Problems on which the effects of the faults are kept, and their parameters."""

GENTLER = 4.0
"""Part of the step at which faults show that order and defects are measured with."""

MONITORED = 200
"""Steps of the run along which constraints and energy are monitored."""

WATCHED = 4000
"""Steps of the run of which it is told whether the energy drifts."""

REFERENCE = "lobatto4"
"""Scheme of order 6 whose motion the order is measured against."""

SPAN = 8
"""Steps of the longest kind to the end of the motion that the order is read off: short, so that every slope is that of the order."""

REFINEMENTS = (2, 4, 8)
"""Parts of the step size that the order is read off."""

ROUNDINGS = 64.0
"""Roundings of each step up to which errors are round-off."""

ROUND_OFF = "round-off"
"""In place of an order: errors are round-off at all step sizes."""

LESS = 0.1
"""By how much an order may be below that of the scheme in the same motion."""

COLUMNS = ("order", "symmetric", "symplectic", "g", "G H_p", "H", "energy")
"""What is measured."""


def measured(ivp: ConstrainedIvp, code: OutsideMethod, h: float, eps: float = EPS) -> dict[str, float | str]:
    """Return the measurements of a code on a problem."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DerivativeWarning)
        try:
            values: dict[str, float | str] = {"order": short_order(ivp, code, h, eps)}
            findings = bench_of(ivp, code, h, MONITORED).findings()
            values |= {name: x.measured for x in findings if (name := x.property.removeprefix("keeps ")) in COLUMNS}
            run = code.solve(ivp, Request(value=h, steps=WATCHED, every=2)).complete()
        except RunFailed as error:
            return {"failure": str(error)}
        return values | {"energy": energy_verdict(ivp, run).verdict}


def short_order(ivp: ConstrainedIvp, code: OutsideMethod | FixedStep, h: float, eps: float = EPS) -> float | str:
    """Return the slope of the error over h at the end of a short motion, of q and p the smaller; or that errors are round-off.

    A slope is that of errors at two or more step sizes that are above the rounding of the code: others say nothing of an order.
    """
    start = ivp.p0, ivp.q0
    finest = SPAN * max(REFINEMENTS)
    truth = map_of(uncompiled(FixedStep(REFERENCE)), ivp, finest)(*start, SPAN * h / finest)
    errors = []
    for part in REFINEMENTS:
        end = map_of(code, ivp, SPAN * part)(*start, h / part)
        errors.append([float(np.linalg.norm(x - y)) for x, y in zip(end, truth, strict=True)])
    sizes = [max(float(np.linalg.norm(x)), float(np.linalg.norm(y))) for x, y in zip(start, truth, strict=True)]
    floor = ROUNDINGS * finest * eps * np.array(sizes)
    slopes = [_slope(column, column > least) for column, least in zip(np.transpose(errors), floor, strict=True)]
    return min((slope for slope in slopes if slope is not None), default=ROUND_OFF)


def _slope(errors: Array, seen: NDArray[np.bool_]) -> float | None:
    """Return the slope of the errors over the step size where they are seen, None where fewer than two are."""
    if np.count_nonzero(seen) < 2:
        return None
    return float(-np.polyfit(np.log(REFINEMENTS)[seen], np.log(errors[seen]), 1)[0])


def contradiction(ivp: ConstrainedIvp, values: Mapping[str, float | str], meant: FixedStep, h: float, rounding: float) -> str:
    """Return how measurements of a code contradict that it is a scheme, "" where they do not: the scheme's own are no better."""
    scheme = uncompiled(meant)
    order, claimed = values.get("order"), short_order(ivp, scheme, h)
    if isinstance(order, float) and not (isinstance(claimed, float) and order > claimed - LESS):
        return f"against it speaks that its order is {order:.3g} in a short motion, and that of {meant.name} {_number(claimed)}"
    if "failure" in values:
        run = scheme.solve(ivp, Request(value=h, steps=WATCHED, every=0))
        return "" if run.failure else f"against it speaks that it stops where {meant.name} does not"
    return ""


def _number(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.3g}"


def effects(fault: str, problem: str) -> dict[str, float | str]:
    """Return the effects of the common form of a fault on one of :data:`PROBLEMS`."""
    ivp = constrained(initial_value_problem(problem, None, PROBLEMS[problem]))
    return measured(ivp, as_method(ivp, next(iter(FAULTY_STEPS[fault].values())), fault), LARGE / GENTLER * default_step(ivp))


def as_method(ivp: ConstrainedIvp, variant: Step, name: str) -> OutsideMethod:
    """Return a faulty step as a method for a problem; it computes in real numbers."""
    mechanics = Mechanics(ivp)

    def step(p: Array, q: Array, h: float) -> State:
        return variant(mechanics, p.real, q.real, h)

    return method_of_callable(step, name)


def table() -> Iterator[dict[str, float | str]]:
    """Yield the effects of all faults on all of :data:`PROBLEMS`, measured now: the rows that are kept."""
    for problem in PROBLEMS:
        for fault in FAULTY_STEPS:
            yield {"fault": fault, "problem": problem, **effects(fault, problem)}


@cache
def kept() -> tuple[Mapping[str, str], ...]:
    """Return the rows of ``effects.csv`` beside this file."""
    text = (files("daebench.studies.diagnose") / "effects.csv").read_text(encoding="utf-8")
    return tuple(csv.DictReader(text.splitlines()))
