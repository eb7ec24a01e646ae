"""Measurements of a code on one problem for a certificate: claims, orders, errors and the energy, each number with its rounding.

An order study, three runs and the defects of a few steps are made. Each run is made a second time, from a start that is rounded elsewhere:
how far a number changes is how well another machine, which rounds elsewhere in every step, can be expected to have it. The rule::

    within = 64 sqrt(N) |x - x'|        N steps of the long run, x' from the start that is rounded elsewhere

for roundings are independent of each other, and 64 of the size of the state are allowed for in each step as in
:mod:`daebench.studies.claims.bench`. What is to be zero but for rounding is known no better than its bound there, and an energy no better
than the rounding of its terms.
"""

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from daebench.diagnostics.energy_verdict import energy_error, energy_scales, energy_verdict, size
from daebench.errors import BadInput, DaebenchError
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import method_of
from daebench.methods.outside.method import OutsideMethod, Stated
from daebench.reference.solution import certified_for
from daebench.runs.ivp import Array, Ivp
from daebench.runs.request import Request
from daebench.runs.trajectory import PoissonTrajectory, Trajectory
from daebench.studies.certificate import rounding
from daebench.studies.certificate.rounding import FALLS, contraction, leading, with_convergence
from daebench.studies.claims.bench import Bench
from daebench.studies.claims.check import NO_CLAIMS, STEPS, order_finding
from daebench.studies.claims.measured_run import BENCHES, MOST_STATES, default_step
from daebench.studies.comparison.position_error import PositionError, position_errors
from daebench.studies.measurable import measured
from daebench.studies.orders.series import COMMON, Series

Run = Trajectory | PoissonTrajectory
Numbers = dict[str, Any]
"""Numbers and words by their names, nested, as JSON has them."""

CURVE = 120
"""Spans of time over which the least and the largest energy error are kept for the picture."""

PARTS = 4
"""The step size, where none is given, is up to one of so many parts of a step of DOP853 at 1e-13."""

LONG, SHORT = 10_000, 1000
"""Steps of that size in the run from which the energy is judged, and in the one whose error is taken."""

OUTPUTS = 2000
"""States of the long run from which the energy is judged, about."""

AT_MOST_SECONDS = 8.0
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
        raise BadInput(
            f"{method.name} is a method of daebench, and states itself what it claims; leave claims out.", "claims-of-own-method"
        )
    itself = {name: value for name, value in asdict(method.claims).items() if value is not None}
    return ivp, replace(method, claims=Stated(**{**itself, **task["claims"]}))


def default_setting(ivp: Ivp, method: Any, h: float | None = None) -> Setting:
    """Return how a code is measured where nothing else is said: over the same part of the motion, whatever the step size."""
    usual = default_step(ivp, PARTS)
    step = usual if h is None else h
    method.check(ivp, Request(value=step, steps=1))
    if step > SHORT * usual:
        raise BadInput(
            f"h = {step:g} is larger than the time over which {ivp.problem} is measured, {SHORT * usual:g}; give a smaller one.",
            "certified-step-too-long",
        )
    shortest = _steps(SHORT * usual, step)
    long = max(shortest, min(_steps(LONG * usual, step), int(AT_MOST_SECONDS / _seconds(ivp, method, step, min(STEPS, shortest)))))
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


class NotSolved(DaebenchError):
    """A code runs on a problem, and does not come near its motion however small the steps are."""


@dataclass(frozen=True)
class Measurement:
    """Measurements of a code on a problem."""

    setting: Setting
    """How it was measured."""
    numbers: Numbers
    """Numbers and words, as the certificate has them."""
    within: Numbers
    """How far each number may be off by rounding, of the same shape."""
    elsewhere: Numbers
    """The same as ``numbers`` from a start that is rounded elsewhere, whose words are as good."""
    seconds: float
    """Wall time of a step, s, the better of two runs."""


@dataclass(frozen=True)
class _Runs:
    """The runs of a code on a problem: that of the energy, that of the error, and that along which claims are held."""

    long: Run
    error: Run
    checked: Run


def measure(ivp: Ivp, method: Any, setting: Setting, *, guessed: bool = False) -> Measurement:
    """Measure a code on a problem."""
    order, series = order_finding(ivp, method, counts=setting.counts or None)
    if guessed and contraction(series) > FALLS:
        raise NotSolved(
            f"{method.name} does not converge to the motion of {ivp.problem}, case {ivp.case}, but to another one, or none.",
            "converges-elsewhere",
        )
    setting = replace(setting, counts=tuple(point.steps // COMMON for point in rounding.points(series)))
    runs = [_runs(start, method, setting) for start in (ivp, rounded(ivp))]
    bench: Bench[Any, Any] = BENCHES[ivp.state](ivp, method, runs[0].checked)
    findings = [with_convergence(order, series), *bench.findings()]
    numbers, elsewhere = _of_runs(ivp, method, runs)
    within = rounding.of_runs(numbers, elsewhere, bench, setting.steps)
    fixed = {"claims": {finding.property: asdict(finding) for finding in findings}, "orders": _orders(series)}
    within |= {"claims": rounding.of_claims(findings), "orders": rounding.of_orders(series)}
    seconds = min(run.long.seconds / run.long.steps for run in runs if run.long.steps)
    return Measurement(setting, numbers | fixed, within, elsewhere | fixed, seconds)


def _runs(ivp: Ivp, method: Any, setting: Setting) -> _Runs:
    watch = ivp.state.monitors
    every = max(1, setting.checked_steps // MOST_STATES)
    checked = method.solve(ivp, Request(value=setting.h, steps=setting.checked_steps, every=every, watch=watch)).complete()
    error = method.solve(ivp, Request(value=setting.h, steps=setting.error_steps, watch=()))
    long = method.solve(ivp, Request(value=setting.h, steps=setting.steps, every=setting.every, watch=watch))
    return _Runs(long, error, checked)


def rounded(ivp: Ivp) -> Any:
    """Return a problem with a start that is rounded elsewhere: its numbers by one unit in the last place, up and down in turn."""

    def moved(vector: Array) -> Array:
        directions = np.where(np.arange(len(vector)) % 2, -np.inf, np.inf)
        return np.where(vector == 0, vector, np.nextafter(vector, directions))

    return ivp.at(*map(moved, ivp.start))


def _of_runs(ivp: Ivp, method: Any, runs: Sequence[_Runs]) -> list[Numbers]:
    """Return the entry on each of the runs; errors are against the motion from the problem's own start."""
    errors = position_errors(ivp, [method] * len(runs), [run.error for run in runs])
    return [
        {
            "error": _error(ivp, run.error, error),
            "energy": _energy(ivp, run.long),
            "conserved": {name: value for name, value in run.long.maxima.items() if name != "energy"},
            "curve": curve(run.long.t, energy_error(ivp, run.long)),
        }
        for run, error in zip(runs, errors, strict=True)
    ]


def _error(ivp: Ivp, run: Run, error: PositionError) -> Numbers:
    """Return the error of a run, and what it was taken against, with the digest of a certified reference."""
    certified = certified_for(ivp, float(run.t[-1]))
    digest = certified.certificate["data"]["sha256"] if certified else None
    return {"t": float(run.t[-1]), **asdict(error), "sha256": digest, "failure": run.failure}


def _energy(ivp: Ivp, run: Run) -> Numbers:
    """Return size, verdict and law of the energy error of a run."""
    drift, largest = energy_verdict(ivp, run), run.maxima["energy"]
    words = {"verdict": drift.verdict, "law": drift.law, "reason": drift.reason, "failure": run.failure}
    numbers = {"exponent": drift.exponent, "change_bound": drift.change_bound, "size": size(largest, energy_scales(ivp, run))}
    return {"t": float(run.t[-1]), "largest": largest, **numbers, **words}


def curve(t: Array, error: Array) -> dict[str, list[float]]:
    """Return the least and the largest of an error over spans of time, and the ends of these."""
    starts = np.unique(np.linspace(0, len(t), CURVE + 1).astype(int)[:-1])
    ends = np.append(starts[1:], len(t)) - 1
    least, largest = np.minimum.reduceat(error, starts), np.maximum.reduceat(error, starts)
    return {"t": t[ends].tolist(), "least": least.tolist(), "largest": largest.tolist()}


def _orders(series: Sequence[Series]) -> Numbers:
    """Return the orders of the components of a state, and their errors by step size."""
    state = leading(series)
    return {
        "components": {curve.component: {"order": curve.fit.slope, "standard_error": curve.fit.slope_error} for curve in state},
        "contraction": contraction(series),
        "h": [point.h for point in rounding.points(series)],
        "errors": {curve.component: curve.errors for curve in state},
    }
