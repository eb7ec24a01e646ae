"""Energies of the members of an ensemble along their runs, and the verdict on each."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.diagnostics.branch import jump_and_way
from daebench.diagnostics.drift import DRIFTS, UNDETERMINED
from daebench.diagnostics.energy import energy_verdicts
from daebench.diagnostics.energy_verdict import may_be_a_part, scales_along, size
from daebench.methods.ensemble.result import EnsembleRun
from daebench.runs.ivp import Array
from daebench.runs.members import Members

AT_ONCE = 2**14
"""States of which functions are computed at a time."""

EPS = 2.0**-52


def ended_members(run: EnsembleRun) -> NDArray[np.int64]:
    """Return the members that came to their end with numbers that are all finite."""
    finite = np.isfinite(run.states).all(axis=(0, 2)) & np.logical_and.reduce([np.isfinite(x) for x in run.maxima.values()])
    return np.flatnonzero((run.status == 0) & finite)


@dataclass(frozen=True)
class Along:
    """Positions or coordinates of members, shape(n, members, c), energies, shape(members, n), and their largest jumps."""

    states: Array
    H: Array
    T: Array | None
    """Kinetic energy, without the time; None of a Poisson system."""
    received: Array
    """Energy received by a system in time, with the other sign, of which H is less: the momentum of the time."""
    jump: Array


def along_members(some: Members, t: Array, states: Array) -> Along:
    """Return energies and defects of members along states, shape(n, members, c), from a few times at once, which stay in the cache."""
    n, m, _ = states.shape
    H, T, received = np.zeros((3, n, m))
    off, way = np.zeros((2, m))
    length = max(2, AT_ONCE // m)
    for k in range(0, n, length):
        vectors = some.ivp.vectors(states[k : k + length + 1])
        H[k : k + length + 1] = some.along("H", *vectors)
        if some.ivp.on_manifold:
            moves = some.ivp.moving
            p, q, v = (x[..., :moves] for x in (*vectors, some.along("H_p", *vectors)))
            T[k : k + length + 1] = np.sum(p * v, axis=2) / 2
            received[k : k + length + 1] = np.sum(vectors[0][..., moves:], axis=2)
            if len(v) > 1:
                of_part = jump_and_way(t[k : k + length + 1], q, v)
                off, way = np.maximum(off, of_part[0]), np.maximum(way, of_part[1])
    jump = np.divide(off, way, out=np.zeros_like(way), where=way > 0)
    H, T, received = (np.ascontiguousarray(x.T) for x in (H, T, received))
    return Along(some.ivp.vectors(states)[-1], H, T if some.ivp.on_manifold else None, received, jump)


def energy_columns(t: Array, along: Along, largest: Array, steps: int) -> dict[str, Any]:
    """Return the columns of the energy: its largest error, that over the mean kinetic energy, and the verdict on its trend."""
    scales = scales_along(along.H) if along.T is None else scales_along(along.T, along.H - along.T - along.received)
    resolution = scales.resolution(along.H[:, 0], EPS)
    verdicts = energy_verdicts(t, along.H - along.H[:, :1], resolution=resolution, scale=scales.most, steps=steps)
    sizes = size(largest, scales)
    drifting = np.flatnonzero(verdicts == DRIFTS)
    if len(drifting):
        verdicts[drifting[may_be_a_part(along.states[:, drifting], sizes[drifting])]] = UNDETERMINED
    return {
        "energy_error": largest.tolist(),
        "energy_size": sizes.tolist(),
        "energy_scale": (np.max(np.abs(along.H), axis=1) if along.T is None else 2 * np.max(np.abs(along.T), axis=1)).tolist(),
        "energy_verdict": verdicts.tolist(),
    }


def along_run(run: EnsembleRun, some: NDArray[np.int64]) -> tuple[Array, Along]:
    """Return the times of a run, shape(n,), the mean where members have steps of their own, and what is computed of some members."""
    states = np.take(run.states.transpose(0, 2, 1), some, axis=2).transpose(0, 2, 1)
    t = run.t if run.t.ndim == 1 else run.t.mean(axis=1)
    return t, along_members(run.members.some(some), t, states)


def member_energies(run: EnsembleRun, some: NDArray[np.int64]) -> dict[str, Any]:
    """Return the columns of the energy of some members of an ensemble, by their numbers."""
    return energy_columns(*along_run(run, some), run.maxima["energy"][some], int(run.index[-1]))
