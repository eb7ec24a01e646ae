"""Reference motions of the report on tolerances, and bounds of their errors."""

from dataclasses import dataclass

import numpy as np

from daebench.errors import RunFailed
from daebench.runs.ivp import Array, ConstrainedIvp


@dataclass(frozen=True)
class Exact:
    """The motion of an initial value problem at the equidistant times that its reference has.

    Parameters
    ----------
    t : ndarray, shape(n,)
        Times, s, the first 0.
    q : ndarray, shape(n, d)
        Positions, rounded to double precision.
    floor : float
        Largest error of any of them: the reference's bound and the rounding.
    amplification : float
        Largest growth of a perturbation of the start up to the last time.
    """

    t: Array
    q: Array
    floor: float
    amplification: float


def exact(ivp: ConstrainedIvp, t_end: float) -> Exact:
    """Return the certified motion up to ``t_end``.

    Raises
    ------
    BadInput
        If the initial value problem has no reference.
    RunFailed
        If its reference ends before, or no run in double precision can follow it so far.
    """
    from daebench.reference.keep import store
    from daebench.reference.keep.record import EPS

    reference = store.find(ivp.problem, ivp.case)
    limit = min(reference.horizon, reference.double_horizon)
    if limit < t_end:
        raise RunFailed(f"the reference {reference.name} is of use up to t = {limit:g} only, and {t_end:g} is needed; build a longer one.")
    time_mask = reference.t <= t_end
    q = reference.q[time_mask]
    floor = float(np.max(reference.bound["q"][time_mask])) + EPS * float(np.max(np.abs(q)))
    return Exact(reference.t[time_mask], q, floor, float(np.max(reference.amplification[time_mask])))
