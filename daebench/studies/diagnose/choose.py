"""Problems for a code of which nobody says what it solves: those of the catalogue on which its steps are known."""

from collections.abc import Callable, Iterator
from typing import Any

from daebench.errors import BadInput, DaebenchError, RunFailed
from daebench.methods.catalogue import problems
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import method_of, parse
from daebench.methods.outside.method import OutsideMethod
from daebench.runs.ivp import ConstrainedIvp
from daebench.runs.make_ivp import constrained
from daebench.studies.diagnose.battery import map_of
from daebench.studies.diagnose.effects import PROBLEMS
from daebench.studies.diagnose.verdict import CORRECT, UNSURE, Diagnosis, diagnose

SMALL = 1e-3
"""Step with which it is seen whether a code takes a problem, s."""

Tell = Callable[[float, str], None]
"""Called with the fraction of the problems that have been tried, and the name of the next."""


def diagnose_somewhere(method: Any, *, scheme: str = "rattle", h: float | None = None, tell: Tell | None = None) -> Diagnosis:
    """Return the fault of a code, see :func:`daebench.studies.diagnose.verdict.diagnose`, on a problem of the catalogue.

    A code that solves one problem is known there, and one that takes many is right only if it is right on all of them.
    """
    code = parse(method)
    if not isinstance(code, OutsideMethod):
        raise BadInput(f"{code.name} is a method of daebench; give code from outside, for example ./mine.py:step.")
    diagnoses = [shown for shown in _on_each(method, scheme, h, tell or (lambda part, name: None)) if _known(shown)]
    if not diagnoses:
        raise BadInput(
            f"the steps of {method} are known on no problem of the catalogue; give the problem that it solves, for example --problem "
            f"./mine.py."
        )
    shown = next((shown for shown in diagnoses if shown.verdict != CORRECT), diagnoses[0])
    return diagnose(method, shown.problem, parameters=shown.parameters, scheme=scheme, h=h)


def _known(shown: Diagnosis) -> bool:
    return shown.verdict != UNSURE or bool(shown.faults or shown.resembles)


def _on_each(method: Any, scheme: str, h: float | None, tell: Tell) -> Iterator[Diagnosis]:
    names = list(problems("constrained"))
    for k, name in enumerate(names):
        tell(k / len(names), f"{method} on {name}")
        parameters = PROBLEMS.get(name)
        try:
            if _takes(method, constrained(initial_value_problem(name, None, parameters))):
                yield diagnose(method, name, parameters=parameters, scheme=scheme, h=h, measure=False)
        except DaebenchError:
            continue


def _takes(method: Any, ivp: ConstrainedIvp) -> bool:
    """Return whether a code takes a step from the start of a problem."""
    try:
        map_of(method_of(ivp, method), ivp)(ivp.p0, ivp.q0, SMALL)
    except (RunFailed, BadInput, ValueError):
        return False
    return True
