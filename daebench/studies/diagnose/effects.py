"""What a fault does to order, defects, constraints and energy."""

import csv
import warnings
from collections.abc import Iterator, Mapping
from functools import cache
from importlib.resources import files

from daebench.diagnostics.energy_verdict import energy_verdict
from daebench.errors import DaebenchError
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.outside.callables import method_of_callable
from daebench.methods.outside.method import OutsideMethod
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.runs.request import Request
from daebench.studies.claims.check import check_claims, default_step
from daebench.studies.diagnose.battery import LARGE
from daebench.studies.diagnose.faulty_steps import FAULTY_STEPS, Step
from daebench.studies.diagnose.mechanics import Mechanics, State

PROBLEMS: Mapping[str, Mapping[str, float]] = {
    "double_pendulum": {"mass2": 3.0},
    "two_bodies_on_sphere": {"mass2": 3.0},
    "slider_crank": {},
}
"""Problems on which the effects of the faults are kept, and their parameters."""

DEFECTS_AT = 200
"""Steps of the run along which constraints and energy are monitored."""

OSCILLATIONS_AT = 4000
"""Steps of the run of which it is told whether the energy drifts."""

COLUMNS = ("order", "symmetric", "symplectic", "g", "G H_p", "H", "energy")
"""What is measured."""


def measured(ivp: ConstrainedIvp, code: OutsideMethod, h: float) -> dict[str, float | str]:
    """Return what a code does on a problem.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem with its numbers.
    code : OutsideMethod
        The code.
    h : float
        Step size, s, of all but the order.

    Returns
    -------
    dict
        order: the slope of the error of q and p over h, the smaller; symmetric and symplectic: defects of 10 steps; g, G H_p and H: largest
        errors along 200 steps; energy: the verdict of a run of 4000 steps, or why there is none. NaN where a number cannot be measured.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            findings = {x.property.removeprefix("keeps "): x.measured for x in check_claims(ivp, code, h=h, steps=DEFECTS_AT)}
            run = code.solve(ivp, Request(value=h, steps=OSCILLATIONS_AT, every=2)).complete()
        except DaebenchError as error:
            return {"energy": f"failed: {error}"}
        verdict = energy_verdict(ivp, run)
    return {name: findings[name] for name in COLUMNS[:-1]} | {"energy": verdict.verdict}


def effects(fault: str, problem: str) -> dict[str, float | str]:
    """Return what the common form of a fault does on one of :data:`PROBLEMS`."""
    ivp = initial_value_problem(problem, None, PROBLEMS[problem])
    assert isinstance(ivp, ConstrainedIvp)
    return measured(ivp, as_method(ivp, next(iter(FAULTY_STEPS[fault].values()))), LARGE * default_step(ivp))


def as_method(ivp: ConstrainedIvp, variant: Step) -> OutsideMethod:
    """Return a faulty step as a method for a problem; it computes in real numbers."""
    mechanics = Mechanics(ivp)

    def step(p: Array, q: Array, h: float) -> State:
        return variant(mechanics, p.real, q.real, h)

    return method_of_callable(step)


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
