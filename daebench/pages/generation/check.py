"""The rows of the exact motion that generated code checks itself against, and by how much a run may be off them."""

from typing import Any

import numpy as np

from daebench.compiler.trace.ir import FLOAT64
from daebench.errors import BadInput
from daebench.methods.fixed_step.base import FixedStepMethod
from daebench.pages.generation.languages import Language
from daebench.reference.solution import TIGHT, reference_solution
from daebench.runs.ivp import InitialValueProblem
from daebench.runs.request import Request

ROWS, STEPS, MARGIN, COARSE = 5, 200, 1.25, 0.1
"""Rows of a check, steps from one to the next, by how much more than daebench's own error a run may be off, and the largest such error."""

FLOOR, READABLE = 64, 4096
"""Roundings by which a run may differ besides, in the order of operations of daebench and in another."""

ROUNDING = 3
"""How many times as far as rounding in float32 led daebench it may lead another mathematical library besides."""


def request(h: float, precision: str) -> Request:
    """Return the run that is checked."""
    return Request(value=h, steps=ROWS * STEPS, every=STEPS, watch=(), precision=precision)


def checked(ivp: InitialValueProblem, method: FixedStepMethod[Any, Any], h: float, precision: str, language: Language) -> dict[str, Any]:
    """Return rows of the exact motion, and by how much a run of the method may be off."""
    steps = [STEPS * k for k in range(1, ROWS + 1)]
    exact = reference_solution(ivp, [h * k for k in steps])
    key = ivp.state.position
    rows = exact.states[key]

    def apart(precision: str) -> Any:
        states = method.solve(ivp, request(h, precision)).complete()
        if states.failure:
            raise BadInput(states.failure, "generated-run-failed")
        return getattr(states, key)[1:] - rows

    differences = apart(precision)
    off = np.abs(differences).max(axis=1)
    if not off.max() <= COARSE * np.abs(rows).max():
        raise BadInput(
            f"with h = {h:g}, {method.name} on {ivp.problem} is off by {off.max():.2g} at t = {h * steps[-1]:g}; choose a smaller h.",
            "generated-code-is-off",
        )
    floor = (
        (READABLE if language.readable else FLOOR)
        * np.finfo("float32" if precision == "float32" else float).eps
        * max(1.0, float(np.abs(rows).max()))
    )
    bounds = MARGIN * off + exact.bound[key] + floor
    parts = ["a quarter more than daebench itself is off", "the bound of these rows"]
    if precision != "float64":
        bounds += ROUNDING * np.abs(differences - apart("float64")).max(axis=1)
        parts.append(f"{ROUNDING} times the difference that {precision} makes")
    return {
        "error": float(off.max()),
        "source": "the closed form of the motion" if exact.kind == "closed form" else f"a run of DOP853 with tolerance {TIGHT:g}",
        "why": f"{', '.join(parts[:-1])} and {parts[-1]}",
        "steps": ", ".join(map(str, steps)),
        "rows": [", ".join(language.number(x, FLOAT64) for x in row) for row in rows.tolist()],
        "bounds": ", ".join(language.number(x, FLOAT64) for x in bounds.tolist()),
    }
