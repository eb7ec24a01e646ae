"""What a tolerance-driven solver gave, read as the trajectory of a constrained problem."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from daebench.method import Request
from daebench.pose import Dae
from daebench.reference.tolerance import Array, Driven
from daebench.scene import Scene
from daebench.trajectory import CONSTRAINED, Trajectory


def trajectory(dae: Dae, request: Request, found: Driven) -> Trajectory:
    """Return the trajectory: momenta in the place of velocities, and what is watched, over all outputs.

    Parameters
    ----------
    dae : Dae
        What was solved.
    request : Request
        What was asked for.
    found : Driven
        What the solver gave.
    """
    scene, kept = dae.scene, found.kept
    q, v = dae.unpack(found.Y)
    p = dae.momenta(q, v)
    p[0] = scene.p0  # as given, without the round-off of p = M v
    watched = request.watched(CONSTRAINED)
    return Trajectory(
        **found.outcome,
        t=found.t[kept],
        q=q[kept],
        p=p[kept],
        lam=scene.along("lam", p[kept], q[kept]) if request.multipliers else None,
        maxima=_maxima(scene, watched, p, q),
        pivot=_smallest_pivot(scene, p, q) if "manifold" in watched else None,
    )


def _maxima(scene: Scene, watch: tuple[str, ...], p: Array, q: Array) -> Mapping[str, float]:
    """Return the largest moduli over all outputs, those at the ends of ``every = 0`` and between them alike."""
    maxima: dict[str, Any] = {}
    if "energy" in watch:
        H = scene.along("H", p, q)
        maxima["energy"] = np.max(np.abs(H - H[0]))
    if "manifold" in watch:
        maxima |= {"g": np.max(np.abs(scene.along("g", q))), "Gv": np.max(np.abs(scene.along("Gv", p, q)))}
    if "integrals" in watch and scene.integrals:
        errors = scene.along("integrals", p, q)
        maxima |= dict(zip(scene.integrals, np.max(np.abs(errors - errors[0]), axis=0), strict=True))
    return {name: float(value) for name, value in maxima.items()}


def _smallest_pivot(scene: Scene, p: Array, q: Array) -> float:
    """Return the smallest relative pivot of G H_pp G^T over all outputs: no solver's flag tells of rank loss, this does."""
    call = scene.functions("lam_and_pivot").lam_and_pivot
    with np.errstate(all="ignore"):
        return float(min(call(tuple(a), tuple(b), scene.par)[1] for a, b in zip(p, q, strict=True)))
