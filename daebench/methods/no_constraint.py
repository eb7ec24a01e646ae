"""Why a treatment of constraints cannot be used on a problem that has none."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from daebench.runs.ivp import InitialValueProblem

FORMS = {"stiff": "penalise", "soft": "soften", "baumgarte": "stabilise"}
"""What forms of the system do to constraints."""


def nothing_to(verb: str, name: str, ivp: "InitialValueProblem", remedy: str) -> str | None:
    """Return that a problem has no constraint for a method of this name to treat, and what to do, as a sentence; None if it has one."""
    return None if ivp.m else f"{name}: {ivp.problem} has no constraint to {verb}; {remedy}."
