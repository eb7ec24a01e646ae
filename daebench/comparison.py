"""Several methods on one scene, side by side in one table."""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from daebench.api import knob_value, scene_of
from daebench.diagnostics.energy import energy_drift
from daebench.diagnostics.integrals import energy_error
from daebench.method import Method, Request
from daebench.names import several
from daebench.scene import Scene
from daebench.trajectory import Trajectory

if TYPE_CHECKING:
    from daebench.problem import ConstrainedHamiltonian

TOLERANCE = 1e-8
"""Tolerance of tolerance-driven methods where none is given."""

MOST_STATES = 20000
"""States kept by a fixed-step method in a comparison, about."""


def compare(
    problem: "str | ConstrainedHamiltonian",
    *,
    methods: Sequence[str],
    h: float | None = None,
    t_end: float,
    case: str | None = None,
    tol: float = TOLERANCE,
    parameters: Mapping[str, float] | None = None,
    options: Mapping[str, float] | None = None,
    project: bool = False,
) -> pd.DataFrame:
    """Return one row a method: drift of energy and from the manifold, work and time, on one scene.

    Parameters
    ----------
    problem : str or ConstrainedHamiltonian
        Name in the catalogue, or a definition.
    methods : sequence of str
        Names in the grammar of :mod:`daebench.names`.
    h : float, optional
        Step size of the fixed-step methods.
    t_end : float
        End time.
    case : str, optional
        Named initial values; by default the problem's first.
    tol : float
        Tolerance of the tolerance-driven methods.
    parameters : mapping of str to float, optional
        Values of the problem's parameters.
    options : mapping of str to float, optional
        Free numbers of the methods; each goes to those that have it.
    project : bool
        Whether initial values are first projected onto the manifold.

    Returns
    -------
    DataFrame
        Columns as :func:`row` gives them. A method that failed has its row, with the reason in ``failure``.

    Raises
    ------
    BadInput
        If the request cannot be met.
    """
    scene = scene_of(problem, case, parameters, project=project)
    runs = trajectories(scene, several(methods, options), h=h, tol=tol, t_end=t_end)
    return pd.DataFrame([row(scene, trajectory) for trajectory in runs])


def trajectories(
    scene: Scene,
    methods: Sequence[Method],
    *,
    h: float | None,
    tol: float = TOLERANCE,
    t_end: float,
    began: Callable[[str], None] | None = None,
) -> list[Trajectory]:
    """Return one trajectory a method, in order; all requests are checked before the first run, and an interruption ends all.

    Raises
    ------
    BadInput
        If a method needs a step size and none is given, or refuses the problem.
    """
    for method in methods:
        knob_value(method, h=h if method.knob == "h" else None, tol=tol if method.knob == "tol" else None)
        method.check(scene, _request(method, h, tol, t_end))
    found = []
    for method in methods:
        if began:
            began(method.name)
        found.append(method.solve(scene, _request(method, h, tol, t_end)))
        if found[-1].interrupted:
            break
    return found


def _request(method: Method, h: float | None, tol: float, t_end: float) -> Request:
    watch = ("energy", "manifold", "integrals")
    if method.knob == "tol" or h is None:
        return Request(value=tol, t_end=t_end, watch=watch)
    every = max(1, int(t_end / h / MOST_STATES)) if h > 0 and np.isfinite(t_end / h) else 1
    return Request(value=h, t_end=t_end, every=every, watch=watch)


def row(scene: Scene, trajectory: Trajectory) -> dict[str, Any]:
    """Return what a comparison says of one run, by column.

    ``energy_error`` is the largest modulus, ``slope`` and ``growth`` are those of :func:`energy_drift`, ``g``, ``Gv`` and the first
    integrals are maxima, ``seconds`` is CPU time of stepping and ``us_per_step`` the same for one step, in microseconds.
    """
    resolution = float(np.finfo(float).eps * max(1.0, abs(float(scene.value("H", scene.p0, scene.q0)))))
    drift = energy_drift(trajectory.t, energy_error(scene, trajectory), resolution=resolution)
    own = {name: value for name, value in trajectory.maxima.items() if name not in ("energy", "g", "Gv")}
    return {
        "method": trajectory.method,
        trajectory.knob: trajectory.value,
        "steps": trajectory.steps,
        "t_reached": float(trajectory.t[-1]),
        "energy_error": trajectory.maxima["energy"],
        "slope": drift.slope,
        "growth": drift.growth,
        "kind": drift.kind,
        "g": trajectory.maxima["g"],
        "Gv": trajectory.maxima["Gv"],
        **own,
        "seconds": trajectory.seconds,
        "us_per_step": 1e6 * trajectory.seconds / trajectory.steps if trajectory.steps else float("nan"),
        **{f"n_{kind}": count for kind, count in trajectory.work.items()},
        "failure": trajectory.failure,
    }
