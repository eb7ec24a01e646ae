"""The motion that errors are taken against: a certified reference where one fits, else a finer run of daebench's own, with a bound."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from daebench.catalogue import find_setting
from daebench.errors import BadInput, RunFailed
from daebench.reference.certified import store
from daebench.reference.certified.record import Reference
from daebench.scene import Array, PoissonScene, Scene
from daebench.solution import TIGHT, reference_solution

CALLS = 400_000
"""Most calls of the right side in each of the two runs of DOP853: some seconds."""

CONSERVED = 1e-6
"""Energy error of a finer run, in parts of its largest energy, from which on it has passed something that it did not see."""


@dataclass(frozen=True)
class OwnRun:
    """A run that is finer than those held against it, and is not certified.

    Parameters
    ----------
    words : str
        What it is.
    t : ndarray, shape(n,)
        Times, s.
    states : mapping of str to ndarray, shape(n, components)
        "q", "p" and "lam", or "y".
    bound : mapping of str to ndarray
        Largest error of each number, of the same shapes.
    """

    words: str
    t: Array
    states: Mapping[str, Array]
    bound: Mapping[str, Array]


def certified_for(scene: Scene | PoissonScene, end: float) -> Reference | None:
    """Return the certified reference of a scene: of this definition, case, start and parameters, up to this time; None if there is none.

    Parameters
    ----------
    scene : Scene or PoissonScene
        The problem with the numbers of a case.
    end : float
        Time, s, that it has to reach.

    Raises
    ------
    Damaged
        If the reference cannot be read.
    """
    try:
        reference = store.find(scene.problem, scene.case)
        own = find_setting(scene.problem, scene.case)
    except BadInput:
        return None
    return reference if _same(scene, own) and reference.parameters == dict(scene.parameters) and end <= reference.horizon else None


def _same(scene: Scene | PoissonScene, other: Scene | PoissonScene) -> bool:
    """Return whether two scenes have the same equations, parameters and start, exactly."""
    starts = len(scene.start) == len(other.start) and all(map(np.array_equal, scene.start, other.start))
    return scene.source.key == other.source.key and scene.par == other.par and starts


def own_run(scene: Scene | PoissonScene, times: ArrayLike, calls: float = CALLS) -> OwnRun:
    """Return the motion at these times, and how far it may be off, see :func:`daebench.solution.reference_solution`.

    Parameters
    ----------
    scene : Scene or PoissonScene
        The problem with the numbers of a case.
    times : array_like, shape(n,)
        Ascending, at least 0.
    calls : float
        Most calls of the right side in each run.

    Raises
    ------
    RunFailed
        If a run stops early, takes more calls, or does not keep the energy: it has then passed a collision or a rank loss unseen.
    """
    t = np.asarray(times, dtype=float)
    exact = reference_solution(scene, t, calls)
    kind, states, bound = exact.kind, exact.states, exact.bound
    energy = scene.along("H", *(states[name] for name in ("p", "q", "y") if name in states))
    start = float(scene.value("H", *scene.start))
    if not np.max(np.abs(energy - start)) <= CONSERVED * _energy_size(scene, states, start):
        raise RunFailed(f"a finer run of {scene.problem}, case {scene.case}, does not keep the energy; choose a shorter end time.")
    words = kind if kind == "closed form" else f"own finer run ({kind}, tol {TIGHT:g})"
    return OwnRun(words, t, states, {part: np.full(rows.shape, bound[part]) for part, rows in states.items()})


def _energy_size(scene: Scene | PoissonScene, states: Mapping[str, Array], start: float) -> float:
    """Return what an energy is large or small against: |H| at the start, or the largest |p^T H_p| if that is more."""
    if "y" in states:
        return max(abs(start), float(np.finfo(float).tiny))
    p, q = states["p"], states["q"]
    return max(abs(start), float(np.max(np.abs(np.sum(p * scene.along("H_p", p, q), axis=1)))), float(np.finfo(float).tiny))
