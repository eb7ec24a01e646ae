"""Reference motions of the report on tolerances, from the start of a case and from starts near it, and bounds of their errors."""

from dataclasses import dataclass

import numpy as np

from daebench.errors import RunFailed
from daebench.methods.names import parse
from daebench.reference.keep import store
from daebench.reference.keep.record import EPS
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.runs.request import Request

REFINED = "rattle/kahan_li8"
"""The method for motions without a certified reference, with compensated sums: of order 8, and not among the methods under test."""

HALVINGS = (8, 16, 32, 64, 128, 256)
"""Its numbers of steps from one output to the next, tried until the motion no longer changes."""

ROUNDINGS = 8.0
"""Additional error bound of a refined motion, in roundings of the largest coordinate."""


@dataclass(frozen=True)
class Exact:
    """The motion of an initial value problem at the equidistant times of its reference."""

    t: Array
    """Times, s, the first 0; shape (n,)."""
    q: Array
    """Positions, rounded to double precision; shape (n, d)."""
    floor: float
    """Largest error of any position: the reference's bound and the rounding."""
    amplification: float
    """Largest growth of a perturbation of the start up to the last time; NaN where it is not known."""
    p: Array
    """Momenta; shape (n, d)."""


def exact(ivp: ConstrainedIvp, t_end: float) -> Exact:
    """Return the certified motion up to ``t_end``."""
    reference = store.find(ivp.problem, ivp.case)
    limit = min(reference.horizon, reference.double_horizon)
    if limit < t_end:
        raise RunFailed(
            f"the reference {reference.name} can be used only up to t = {limit:g}, and {t_end:g} is needed; build a longer one.",
            "reference-too-short",
        )
    time_mask = reference.t <= t_end
    q = reference.q[time_mask]
    floor = float(np.max(reference.bound["q"][time_mask])) + EPS * float(np.max(np.abs(q)))
    return Exact(reference.t[time_mask], q, floor, float(np.max(reference.amplification[time_mask])), reference.p[time_mask])


def refined(ivp: ConstrainedIvp, t: Array) -> Exact:
    """Return the motion at equidistant times by :data:`REFINED`, whose step is halved until only round-off changes.

    The changes by the last two halvings bound the error, because at order 8 the second halving leaves less than a hundredth of it.
    """
    method, changes, last = parse(REFINED, compensated=True), list[float](), None
    for between in HALVINGS:
        request = Request(value=float(t[1]) / between, steps=between * (len(t) - 1), every=between, watch=())
        run = method.solve(ivp, request).complete()
        if last is not None:
            changes.append(float(np.max(np.abs(run.q - last.q))))
        last = run
        if len(changes) > 1 and changes[-1] > changes[-2] / 2:
            break
    assert last is not None
    floor = max(changes[-2:]) + ROUNDINGS * float(np.finfo(float).eps) * float(np.max(np.abs(last.q)))
    return Exact(t, last.q, floor, float("nan"), last.p)
