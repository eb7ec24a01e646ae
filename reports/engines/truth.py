"""Reference solutions of the motions: certified references, a closed form, and for chains two runs of a method of order eight."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from daebench.methods.names import method_of
from daebench.reference.keep import store
from daebench.reference.keep.dense_evaluation import states_at
from daebench.reference.motion import certified_for
from daebench.reference.solution import SAFETY, reference_solution
from daebench.reports.engines.contender import Array
from daebench.reports.engines.motions import BY_KEY, T_END, Motion
from daebench.runs.ivp import ConstrainedIvp
from daebench.runs.request import Request

TOP = ("heavy_top_lie_poisson", "heavy_top")
"""Certified reference of the heavy top, in angular momentum and Gamma, the upward vertical, both seen from the body."""

FINE = "rattle/kahan_li8"
"""Method of the reference runs of chains."""

FINE_STEP = 1 / 256
"""Step size of the coarser of these two runs, s."""


@dataclass(frozen=True)
class Truth:
    """The motion at the end.

    Parameters
    ----------
    words : str
        Description of the reference solution.
    value : ndarray
        Positions, or quantities in their place, see :func:`compared`.
    bound : float
        Error bound of a component.
    """

    words: str
    value: Array
    bound: float


def compared(motion: Motion, q: Array) -> Array:
    """Return the compared part of a position: the whole position, or for the top the upward vertical seen from the body, its third row."""
    return q[..., 6:9] if motion.key == "top" else q


@cache
def truth(key: str) -> Truth:
    """Return the reference solution of a motion at its end."""
    motion, end = BY_KEY[key], np.array([T_END])
    if motion.key == "top":
        known = states_at(store.find(*TOP), end)
        return Truth(f"certified {'-'.join(TOP)}", known.states["y"][0, 3:], float(np.max(known.bound["y"])))
    if motion.problem == "pendulum_chain":
        return fine(motion.ivp)
    if reference := certified_for(motion.ivp, T_END):
        known = states_at(reference, end)
        return Truth(f"certified {reference.name}", known.states["q"][0], float(np.max(known.bound["q"])))
    solution = reference_solution(motion.ivp, end)
    return Truth(solution.kind, solution.states["q"][0], solution.bound["q"])


def fine(ivp: ConstrainedIvp) -> Truth:
    """Return the end of a run of order eight, and as its bound a multiple of the difference from a run with twice the step size."""
    method = method_of(ivp, FINE)
    coarse, finer = (
        method.solve(ivp, Request(value=h, t_end=T_END, every=0, watch=(), count=False)).complete().q[-1]
        for h in (FINE_STEP, FINE_STEP / 2)
    )
    return Truth(f"two runs of {FINE}", finer, SAFETY * float(np.max(np.abs(finer - coarse))))
