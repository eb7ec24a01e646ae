"""The runs of the report on tolerances: every formulation with every treatment at every tolerance, and the outcome of each."""

import re
from collections.abc import Sequence
from functools import cache, lru_cache
from itertools import pairwise
from typing import Any

import numpy as np

from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.solvers.error_test import TREATMENTS
from daebench.methods.solvers.ida import DEFAULT_TREATMENTS, Ida
from daebench.reports.tolerances.exact import Exact, exact, refined
from daebench.runs.ivp import ConstrainedIvp
from daebench.runs.make_ivp import constrained
from daebench.runs.request import Request, WorkLimit
from daebench.runs.trajectory import Trajectory
from daebench.starts.members import neighbour

FAST = "spherical_pendulum-fig1.2"
IVPS = {
    "planar_pendulum-horizontal": "planar pendulum",
    "spherical_pendulum-fig1.1": "spherical pendulum, slow",
    FAST: "spherical pendulum, fast",
    "double_pendulum-horizontal": "double pendulum",
    "pendulum_chain-horizontal5": "chain of five",
}
"""The initial value problems, by the names of the references, with their display names."""

FORMULATIONS = ("index3", "index2", "index1", "ggl")
TOLERANCES = tuple(float(f"1e-{k}") for k in range(3, 15))
T_END = 10.0
STARTS = 32
"""Starts of each system: the start of the case, and neighbours of it."""

NEAR = 0.01
"""Distance of neighbours, relative to the largest position or momentum; see :func:`daebench.starts.members.neighbour`."""

WORK_LIMIT = WorkLimit(calls=450_000, slow_calls=20_000, slow_part=150)
"""Limits at which a run is given up."""

SHORT_WORK_LIMIT = WorkLimit(calls=150_000, slow_calls=20_000, slow_part=40)
"""Limits for a run without a treatment of the multipliers: most such runs fail, and would take half of all work."""

REACHED = "reached"
KINDS = {
    "the local error test failed": "error test",
    "Newton's iteration failed": "Newton",
    "the step size has collapsed": "step size",
    "calls of the residual": "patience",
}
"""Reasons for an early end: a phrase that the message contains, and a name."""

IN_WORDS = {
    "error test": "the local error test failed even with the smallest step",
    "Newton": "Newton's iteration did not converge even with the smallest step",
    "step size": "a thousand steps covered less than a billionth of the run",
    "patience": "it was given up after too many calls of the residual",
    "other": "it stopped for another reason",
}
STOPPED = ("error test", "Newton", "other")
"""Ends by IDA itself; the other runs are stopped by daebench."""

SMALL = 0.1
"""Errors from this on, in lengths of a rod, are of the size of the motion: such errors are not estimated."""

Row = dict[str, Any]


@cache
def ivp_of(name: str) -> ConstrainedIvp:
    """Return an initial value problem by the name of its reference, made once in a process."""
    problem, _, case = name.partition("-")
    return constrained(initial_value_problem(problem, case))


@cache
def exact_of(name: str, t_end: float) -> Exact:
    """Return the reference motion of an initial value problem, read once in a process."""
    return exact(ivp_of(name), t_end)


@lru_cache(maxsize=2)
def motion(name: str, start: int) -> tuple[ConstrainedIvp, Exact]:
    """Return an initial value problem and its motion to ``T_END``: start 0 is the start of the case, and has a certified reference."""
    ivp, certified = beside(name, start), exact_of(name, T_END)
    return ivp, certified if start == 0 else refined(ivp, certified.t)


def beside(name: str, start: int) -> ConstrainedIvp:
    """Return an initial value problem from one of its starts."""
    return constrained(neighbour(ivp_of(name), NEAR, start)) if start else ivp_of(name)


def member(name: str, start: int) -> tuple[list[Row], Exact]:
    """Return the runs from one start, and its motion.

    They are with all treatments from the start of the case, and with the default treatments from other starts.
    """
    rows = [
        row
        for formulation in FORMULATIONS
        for row in series(name, start, formulation, TOLERANCES, (DEFAULT_TREATMENTS[formulation],) if start else TREATMENTS)
    ]
    return rows, motion(name, start)[1]


def series(name: str, start: int, formulation: str, tolerances: Sequence[float], treatments: Sequence[str]) -> list[Row]:
    """Return a row per treatment and tolerance; each row has the difference from the next tolerance, an estimate that a user could make."""
    ivp, reference = motion(name, start)
    rows = []
    for treatment in treatments:
        runs = [solve(ivp, formulation, treatment, tol, reference) for tol in tolerances]
        estimates = [difference(one, finer) for one, finer in pairwise(runs)]
        of = {"scene": name, "start": start, "formulation": formulation, "cure": treatment}
        of["default"] = treatment == DEFAULT_TREATMENTS[formulation]
        rows += [of | row(reference, *pair) for pair in zip(runs, [*estimates, float("nan")], strict=True)]
    return rows


def solve(ivp: ConstrainedIvp, formulation: str, treatment: str, tol: float, reference: Exact) -> Trajectory:
    """Return the run of IDA, relative and absolute tolerance ``tol``, with output at the times of the reference."""
    work_limit = SHORT_WORK_LIMIT if treatment == "none" else WORK_LIMIT
    t_end, points = float(reference.t[-1]), len(reference.t)
    request = Request(value=tol, t_end=t_end, points=points, watch=("manifold",), work_limit=work_limit)
    return Ida(formulation, treatment).solve(ivp, request)


def difference(one: Trajectory, other: Trajectory) -> float:
    """Return the largest difference of two complete runs' positions, NaN if one is not complete."""
    return float("nan") if one.failure or other.failure else float(np.max(np.abs(one.q - other.q)))


def row(reference: Exact, run: Trajectory, estimate: float) -> Row:
    """Return the outcome of a run: ``error`` is the largest error of a component of q at any output, NaN if the run ended early."""
    return {
        "tol": run.value,
        "error": float("nan") if run.failure else float(np.max(np.abs(run.q - reference.q))),
        "estimate": estimate,
        "floor": reference.floor,
        "amplification": reference.amplification,
        "g": run.maxima["g"],
        "Gv": run.maxima["Gv"],
        "steps": run.steps,
        "residuals": run.work["residual"],
        "jacobians": run.work.get("jacobian", 0),
        "t_reached": float(run.t[-1]),
        "end": end(run.failure),
        "reason": reason(run.failure),
    }


def reason(failure: str | None) -> str:
    """Return why a run ended early, without place and advice; empty if it did not."""
    match = re.search(r"\(tol = [^)]*\): (.*); [^;]*\.$", failure or "")
    return match[1] if match else failure or ""


def end(failure: str | None) -> str:
    """Return how a run ended: "reached", or a name of ``KINDS``, or "other"."""
    return REACHED if failure is None else next((name for text, name in KINDS.items() if text in failure), "other")
