"""A method and a problem as a script for a page: the linked module in JavaScript, and the numbers to run it with."""

import types
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from daebench.compiler.javascript import Layout, functions, kernel
from daebench.errors import BadInput
from daebench.methods.fixed_step.base import FixedStepMethod
from daebench.methods.monitored_errors import monitored_names
from daebench.runs.ivp import InitialValueProblem

MOST = 24
"""Largest number of numbers in a state: tuples are written out as variables."""


@dataclass(frozen=True)
class Script:
    """A kernel in JavaScript, see :mod:`daebench.compiler.javascript`, with its start."""

    name: str
    """Name of the method."""
    text: str
    """The object with the methods ``start`` and ``integrate``."""
    state: tuple[float, ...]
    par: tuple[float, ...]
    weights: tuple[float, ...]
    """State of the problem's start, run-time data, and weights of the substeps."""
    directions: int = 0
    """In how many directions the kernel carries derivatives."""


def script(
    method: FixedStepMethod[Any, Any],
    ivp: InitialValueProblem,
    h: float,
    *,
    watch: tuple[str, ...] = (),
    directions: int = 0,
    rank: bool = False,
) -> Script:
    """Return a fixed-step method on a problem as a script."""
    if refusal := method.refusal(ivp):
        raise BadInput(refusal, "method-refuses-problem")
    require_small(ivp)
    precision = f"dual{directions}" if directions else "float64"
    source = method.source(ivp, precision, watch, singular="watch" if rank else "")
    state, par = _numbers(method, ivp, h)
    layout = Layout(nested(state), nested(par), ivp.size, directions, len(monitored_names(watch, ivp)), rank)
    return Script(method.name, kernel(source, layout), flat(state), flat(par), tuple(map(float, method.weights)), directions)


def require_small(ivp: InitialValueProblem) -> None:
    """Refuse a problem with more numbers in a state than a page takes."""
    if ivp.arrays or ivp.size > MOST:
        raise BadInput(
            f"{ivp.problem} has {ivp.size} numbers in a state, and a page takes {MOST} at most; take a smaller problem.",
            "state-too-large-for-page",
        )


def numbers(method: FixedStepMethod[Any, Any], ivp: InitialValueProblem, h: float) -> dict[str, tuple[float, ...]]:
    """Return the state and the run-time data of a script for a problem with other numbers, or a method with other options.

    The script itself stays the same. The keys are those of :class:`Script`: "state" and "par".
    """
    state, par = _numbers(method, ivp, h)
    return {"state": flat(state), "par": flat(par)}


def _numbers(method: FixedStepMethod[Any, Any], ivp: InitialValueProblem, h: float) -> tuple[Any, Any]:
    """Return the state that the scheme computes in at the problem's start, and the run-time data."""
    linked = method.linked(ivp, _no_module(), h)
    # The module is not called: what a page runs is JavaScript.
    return linked.enter(ivp.start), linked.par


def script_of_functions(ivp: InitialValueProblem, names: Sequence[str]) -> str:
    """Return functions of a problem, H or g for example, as methods ``name(S, P, O)`` of a JavaScript object."""
    source = ivp.source.text(f"Functions of {ivp.problem}.", names)
    return functions(source, names, [len(vector) for vector in ivp.start], nested(ivp.par))


def nested(x: Any) -> Any:
    """Return a nested tuple of floats."""
    return float(x) if not hasattr(x, "__len__") else tuple(map(nested, x))


def flat(x: Any) -> tuple[float, ...]:
    """Return the numbers of a nested tuple in a row."""
    return (float(x),) if not hasattr(x, "__len__") else tuple(number for entry in x for number in flat(entry))


def _no_module() -> Any:
    """Return a module in place of the compiled one where nothing of it is called."""
    return types.ModuleType("none")
