"""Members of an ensemble by heyoka's batch mode: Taylor series for as many members at once as fit into a vector of the processor."""

from typing import Any

import numpy as np

from daebench.diagnostics.combined import combined
from daebench.errors import BadInput
from daebench.methods.names import method_of
from daebench.methods.solvers.heyoka_ode import FIRST, compact, equations_of
from daebench.runs.ivp import Array, Ivp
from daebench.runs.members import Members
from daebench.systems.lazily import heyoka as hy

MOST_STEPS = 100_000
"""Steps after which a member is given up."""


def refusal(members: Members) -> str | None:
    """Return why members cannot be run by heyoka's batch mode, as a sentence, or None."""
    if members.parameters:
        return f"heyoka's equations contain the values of parameters, and {', '.join(members.parameters)} differ between members."
    ivp: Any = members.ivp
    why: str | None = method_of(ivp, "heyoka:taylor").refusal(ivp)
    return why


def batch_of(ivp: Ivp, tol: float) -> Any:
    """Return heyoka's integrator of a batch, ``taylor_adaptive_batch``, of the size that it recommends for this processor.

    Its unknowns are q and p, or y; large problems are compiled as loops, as :data:`daebench.methods.solvers.heyoka_ode.COMPACT` says.
    Constraints that are redundant for good are combined, where they are to be solved by least squares.
    """
    ivp = combined(ivp) if ivp.on_manifold and ivp.singular else ivp
    zeros = np.zeros((ivp.size, hy.recommended_simd_size()))
    return hy.taylor_adaptive_batch(equations_of(ivp), zeros, tol=tol, compact_mode=compact(ivp.size))


def in_batches(members: Members, times: Array, tol: float) -> Array:
    """Return the states of all members at these times, each with its own step sizes.

    A batch in which a member is no longer finite ends there; its members are then run one by one, as batches of equal members.

    Parameters
    ----------
    members : Members
        The members; their step sizes are ignored.
    times : ndarray, shape(k,)
        Times, s, ascending from 0.
    tol : float
        Tolerance, relative and absolute.

    Returns
    -------
    ndarray, shape(k, n, c)
        States as (p, q) or y, NaN after a member is no longer finite, or has taken more than 100 000 steps.

    Raises
    ------
    BadInput
        If heyoka is not installed, or cannot take the problem, or parameters differ from member to member.
    """
    if why := refusal(members):
        raise BadInput(why, "heyoka-batches-refused")
    batch, n = batch_of(members.ivp, tol), len(members)
    start = np.concatenate(members.start[::-1], axis=1)
    rows = np.full((len(times), n, members.ivp.size), np.nan)
    for k in range(0, n, batch.batch_size):
        some = np.minimum(np.arange(k, k + batch.batch_size), n - 1)
        states = _propagated(batch, start[some], times)
        if not np.all(np.isfinite(states)):
            states = np.stack([_propagated(batch, start[np.full_like(some, i)], times)[:, 0] for i in some], axis=1)
        rows[:, some] = states
    return np.concatenate(members.ivp.vectors(rows)[::-1], axis=2)  # heyoka has q before p, which is as long


def _propagated(batch: Any, start: Array, times: Array) -> Array:
    """Return the states of a batch at these times, shape(k, batch, c), from its starts, shape(batch, c)."""
    size = batch.batch_size
    batch.set_time(0.0)
    batch.state[:] = start.T
    batch.step(np.full(size, FIRST * times[-1]))  # a start at which coefficients vanish is left by a short step
    grid = np.repeat(times[:, None], size, axis=1)
    grid[0] = batch.time
    rows = np.full((len(times), size, start.shape[1]), np.nan)
    if np.all(np.isfinite(grid[0])):
        with np.errstate(all="ignore"):
            states = np.asarray(batch.propagate_grid(grid, max_steps=MOST_STEPS)[1])
        rows[: len(states)] = states.transpose(0, 2, 1)
    rows[0] = start
    return rows
