"""A second problem for the claims of a scheme: one with curvature in U, where the given one cannot show a fault of the force."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np

from daebench.errors import RunFailed
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.runs.ivp import Array, ConstrainedIvp, Ivp
from daebench.runs.make_ivp import constrained
from daebench.studies.claims.bench import FALLS_SHORT, NOT_CLAIMED, OK, UNDETERMINED, Finding
from daebench.studies.claims.measured_run import bench_of, default_step
from daebench.studies.measurable import claimed_order

CURVED = "two_bodies_on_sphere"
"""Problem of the catalogue whose U has curvature, with two constraints that are not linear and two masses."""

SAME = 1e-12
"""Largest change of a function, relative to its size, that is rounding."""

PLACES = 4
"""Positions at which functions of q are compared, beside that of the start."""

AWAY = 0.1
"""How far these positions are from the start, relative to the largest; they need not meet the constraints."""

STEPS = 8
"""Steps to the end of the motion that the order is read off, at the largest step size."""

PARTS = 2
"""The step size as :func:`daebench.studies.claims.measured_run.default_step` takes it: large, so that orders show above rounding."""

PARAMETERS = {"mass2": 3.0}
"""Two masses, so that the place of M^-1 shows."""

LESS = 0.3
"""By how much the order may be below that claimed."""

JUDGED = ("order", "symmetric", "symplectic")
"""Properties in which a fault of the force shows."""


def unseen(ivp: Ivp) -> list[str]:
    """Return the properties of a scheme that a problem cannot show, one sentence each."""
    if not ivp.on_manifold or ivp.arrays or ivp.facts.EXTENDED:
        return []
    return [f"{ivp.problem} cannot show {words}." for words in _unseen(ivp)]


def _unseen(ivp: ConstrainedIvp) -> Iterator[str]:
    force, mass, gradient = (_along(ivp, name) for name in ("H_q", "H_pp", "G"))
    if ivp.nonholonomic:
        yield "symplecticity: where constraints are on velocities, the motion itself preserves no two-form"
    if not force.any():
        yield "a fault of the force, because it has none"
    elif ivp.facts.SEPARABLE and _constant(force):
        yield "where a scheme evaluates the force, because its force is constant"
    if not ivp.m:
        return
    if ivp.m == 1:
        yield "how several multipliers are solved for together, because it has one constraint"
    if _constant(gradient):
        yield "where a scheme evaluates the gradients of the constraints, because they are constant"
    W = mass[0]
    if _constant(mass) and np.allclose(W, W[0, 0] * np.eye(len(W)), rtol=SAME, atol=0):
        yield "where M^-1 is missing beside the constraints, because all its masses are equal"


def _along(ivp: ConstrainedIvp, name: str) -> Array:
    """Return a function of q at some positions near the start, without momenta."""
    draw, size = np.random.default_rng(5), AWAY * (float(np.max(np.abs(ivp.q0))) or 1.0)
    q = np.stack([ivp.q0] + [ivp.q0 + size * draw.standard_normal(ivp.d) for _ in range(PLACES)])
    vectors = (q,) if name == "G" else (np.zeros_like(q), q)
    with np.errstate(all="ignore"):  # forces may have poles near the start
        return np.asarray(ivp.along(name, *vectors), dtype=float)


def _constant(values: Array) -> bool:
    return bool(np.max(np.abs(values - values[0])) <= SAME * np.max(np.abs(values)))


def constant_force(ivp: Ivp) -> bool:
    """Return whether the force of a problem is the same everywhere, so that a scheme may evaluate it anywhere."""
    if not ivp.on_manifold or ivp.arrays or ivp.facts.EXTENDED or not ivp.facts.SEPARABLE:
        return False
    return _constant(_along(ivp, "H_q"))


@cache
def curved() -> ConstrainedIvp:
    """Return the second problem."""
    return constrained(initial_value_problem(CURVED, None, PARAMETERS))


def on_second(ivp: Ivp, method: Any, names: Sequence[str] = JUDGED) -> list[Finding]:
    """Return the findings on a scheme on the second problem, none where the first shows the force, or the second cannot be taken."""
    if not isinstance(method, FixedStep) or not constant_force(ivp) or method.refusal(curved()) or method.system.instead:
        return []
    return judged(curved(), replace(method, compiled=False), names)


def judged(ivp: ConstrainedIvp, method: Any, names: Sequence[str] = JUDGED) -> list[Finding]:
    """Return the findings on some properties on a problem, by a few steps; their names have the problem."""
    h = default_step(ivp, PARTS)
    try:
        bench = bench_of(ivp, method, h, STEPS)
        rows = [row for name in names for row in (_order(ivp, method, h) if name == "order" else [bench.judged(name)])]
    except RunFailed as failure:
        nothing = float("nan")
        rows = [Finding(name, None, nothing, nothing, UNDETERMINED, note=str(failure)) for name in names]
    return [replace(row, property=f"{row.property} on {ivp.problem}") for row in rows]


def _order(ivp: ConstrainedIvp, method: Any, h: float) -> list[Finding]:
    """Return the finding on the order, by how the ends of a short motion come nearer as h is halved; none where they differ by rounding."""
    claimed = claimed_order(method)
    ends = [np.concatenate(method.flow(ivp, h / parts, STEPS * parts)(ivp.p0, ivp.q0)) for parts in (1, 2, 4)]
    first, second = (float(np.max(np.abs(one - other))) for one, other in pairwise(ends))
    if second <= SAME * float(np.max(np.abs(ends[0]))):
        return []
    least, slope = float("nan") if claimed is None else claimed - LESS, float(np.log2(first / second))
    verdict = NOT_CLAIMED if claimed is None else OK if slope > least else FALLS_SHORT
    return [Finding("order", claimed, slope, least, verdict, note="from a short motion with three step sizes.")]
