"""The reference solution of a Poisson system: the closed form where the problem has one, else two runs of DOP853."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from daebench.errors import RunFailed
from daebench.poisson_pose import pose_poisson
from daebench.scene import Array, PoissonScene
from daebench.truth import LOOSE, TIGHT, advanced, bound_of, exactly, reached, rounding


@dataclass(frozen=True)
class PoissonTruth:
    """States of the exact motion, and by how much they may be wrong; see :class:`daebench.truth.Truth`.

    Parameters
    ----------
    kind : str
        "closed form" or "DOP853".
    t : ndarray, shape(n,)
        Times, s, ascending.
    y : ndarray, shape(n, size)
        States.
    bound : mapping of str to float
        Euclidean norm of the error of "y", at most, at any of the times.
    """

    kind: str
    t: Array
    y: Array
    bound: Mapping[str, float]


def poisson_truth(scene: PoissonScene, times: ArrayLike, calls: float = np.inf) -> PoissonTruth:
    """Return the motion from the scene's own initial values, with the bounds of :func:`daebench.truth.truth`.

    Parameters
    ----------
    scene : PoissonScene
        The system with the numbers of one case.
    times : array_like, shape(n,)
        Ascending, at least 0.
    calls : float
        Most calls of the right side in each of the two runs.

    Raises
    ------
    RunFailed
        If the integration stops early, takes more calls or leaves the domain.
    """
    if not scene.sheet.CLOSED_FORM:
        return poisson_integrated(scene, times, calls)
    closed_form = scene.source.derivation.problem.closed_form
    states = exactly(closed_form, times, scene.start, scene.parameters)
    y = np.array([[float(x) for x in state] for state in states])
    return PoissonTruth("closed form", np.asarray(times, dtype=float), y, bound={"y": rounding(y)})


def poisson_integrated(scene: PoissonScene, times: ArrayLike, calls: float = np.inf) -> PoissonTruth:
    """Return the motion by two runs of DOP853, see :func:`poisson_truth`."""
    dae = pose_poisson(scene, "ode")
    tight, loose = (advanced(dae, times, tol, calls) for tol in (TIGHT, LOOSE))
    for t, y in zip(np.asarray(times, dtype=float), tight, strict=True):
        if left := dae.outside(y):
            raise RunFailed(
                f"the reference solution of {scene.problem}, case {scene.case}, has left {left} at t = {t:.9g}; choose a shorter end time."
            )
    return PoissonTruth("DOP853", np.asarray(times, dtype=float), tight, bound={"y": bound_of(tight, loose)})


def poisson_reach(scene: PoissonScene, steps: int) -> float:
    """Return the time that DOP853 at 1e-13 reaches in so many steps: what the motion itself calls long."""
    return reached(pose_poisson(scene, "ode"), steps)
