"""Effects of the faults of the dictionary on order, defects, constraints and energy, as they are kept in ``fault_effects.csv``."""

import csv
from pathlib import Path

from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.outside.callables import method_of_callable
from daebench.runs.make_ivp import constrained
from daebench.studies.claims.measured_run import default_step
from daebench.studies.diagnose.battery import LARGE
from daebench.studies.diagnose.faulty_steps import FAULTY_STEPS
from daebench.studies.diagnose.measurements import GENTLER, measured
from daebench.studies.diagnose.mechanics import Mechanics

PROBLEMS = {"double_pendulum": {"mass2": 3.0}, "butane": {}, "slider_crank": {}}
"""Problems on which the effects of the faults are kept, and their parameters."""


def as_method(ivp, variant, name):
    """Return a faulty step as a method for a problem; it computes in real numbers."""
    mechanics = Mechanics(ivp)

    def step(p, q, h):
        return variant(mechanics, p.real, q.real, h)

    return method_of_callable(step, name)


def effects(fault, problem):
    """Return the effects of the common form of a fault on one of :data:`PROBLEMS`."""
    ivp = constrained(initial_value_problem(problem, None, PROBLEMS[problem]))
    return measured(ivp, as_method(ivp, next(iter(FAULTY_STEPS[fault].values())), fault), LARGE / GENTLER * default_step(ivp))


def table():
    """Yield the effects of all faults on all of :data:`PROBLEMS`, measured now: the rows that are kept."""
    for problem in PROBLEMS:
        for fault in FAULTY_STEPS:
            yield {"fault": fault, "problem": problem, **effects(fault, problem)}


def kept():
    """Return the rows of ``fault_effects.csv`` beside this file."""
    return list(csv.DictReader(Path(__file__).with_name("fault_effects.csv").read_text(encoding="utf-8").splitlines()))
