"""The runs of the lesson on SHAKE, RATTLE and Lobatto: errors against the exact motion, and momenta on and off the manifold."""

from dataclasses import dataclass
from functools import cache

import numpy as np
import pandas as pd

from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.pages.report.exact_motion import exact_motion
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.runs.make_ivp import constrained
from daebench.runs.request import Request
from daebench.runs.trajectory import Trajectory

PROBLEM = "spherical_pendulum"
CASES = {"slow": "fig1.1", "fast": "fig1.2"}
COARSEST = 2
"""Steps for a second of the slow motion with the largest step; the fast one has more, see ``FASTER``."""

FASTER = {"slow": 1, "fast": 20}


@cache
def ivp_of(start: str) -> ConstrainedIvp:
    """Return the pendulum with the start "slow" or "fast"."""
    return constrained(initial_value_problem(PROBLEM, CASES[start]))


@cache
def solve(scheme: str, start: str, t_end: float, steps: int, every: int = 0) -> Trajectory:
    """Return the run of a scheme with a number of steps."""
    request = Request(value=t_end / steps, steps=steps, every=every, watch=())
    run: Trajectory = parse(scheme).solve(ivp_of(start), request)
    return run


@cache
def exact(start: str, t_end: float) -> tuple[Array, Array]:
    """Return the exact position and momentum at the end."""
    q, p = exact_motion(ivp_of(start).source, CASES[start], [t_end])
    return q[0], p[0]


def step_sizes(scheme: str, start: str, t_end: float, rungs: int) -> pd.DataFrame:
    """Return the results of runs with halved steps: method, h, force evaluations, and errors of q and p at the end, NaN if stopped."""
    rows, (q, p) = [], exact(start, t_end)
    for k in range(rungs):
        steps = round(t_end * COARSEST * FASTER[start]) * 2**k
        run = solve(scheme, start, t_end, steps)
        errors = (np.nan, np.nan) if run.failure else (np.linalg.norm(run.q[-1] - q), np.linalg.norm(run.p[-1] - p))
        rows.append({"method": scheme, "h": t_end / steps, "evaluations": run.work["H_q"], "q": errors[0], "p": errors[1]})
    return pd.DataFrame(rows)


@dataclass(frozen=True)
class Hidden:
    """SHAKE beside RATTLE.

    Parameters
    ----------
    t : ndarray, shape(n,)
        Times, s.
    shake, rattle, projected : ndarray, shape(n,)
        Moduli of G H_p: of SHAKE's momenta, of RATTLE's, and of SHAKE's after the projection.
    energy, energy_projected : ndarray, shape(n,)
        Energy errors of SHAKE before and after the projection.
    positions, momenta : float
        Largest differences of SHAKE and RATTLE: of q, and of p after the projection.
    """

    t: Array
    shake: Array
    rattle: Array
    projected: Array
    energy: Array
    energy_projected: Array
    positions: float
    momenta: float


@cache
def hidden(h: float, t_end: float) -> Hidden:
    """Return SHAKE beside RATTLE, with one step size, on the fast motion."""
    ivp, steps = ivp_of("fast"), max(2, round(t_end / h))
    shake, rattle = (solve(name, "fast", h * steps, steps, every=1) for name in ("shake", "rattle"))
    n = min(len(shake.t), len(rattle.t))
    p = projected(shake.p[:n], shake.q[:n])
    levels = [ivp.along("H", momenta, shake.q[:n]) for momenta in (shake.p[:n], p)]
    return Hidden(
        t=shake.t[:n],
        shake=np.abs(ivp.along("Gv", shake.p[:n], shake.q[:n])).ravel(),
        rattle=np.abs(ivp.along("Gv", rattle.p[:n], rattle.q[:n])).ravel(),
        projected=np.abs(ivp.along("Gv", p, shake.q[:n])).ravel(),
        energy=levels[0] - levels[0][0],
        energy_projected=levels[1] - levels[1][0],
        positions=float(np.max(np.abs(shake.q[:n] - rattle.q[:n]))),
        momenta=float(np.max(np.abs(p - rattle.p[:n]))),
    )


def projected(p: Array, q: Array) -> Array:
    """Return momenta without their component across the sphere, shape(n, 3): p - G^T (G M^-1 G^T)^-1 G M^-1 p, for unit mass."""
    return np.asarray(p - q * (np.sum(p * q, axis=1) / np.sum(q * q, axis=1))[:, None])
