"""One row a method: what becomes of energy, manifold and integrals of a scene, and what it costs; or why there is no run."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np

from daebench.diagnostics.energy import energy_drift
from daebench.diagnostics.integrals import energy_error, integral_errors
from daebench.diagnostics.manifold import residual_scales
from daebench.errors import DaebenchError
from daebench.fixed_step import FixedStep
from daebench.method import Method, Request
from daebench.names import parse
from daebench.reports._problems_scenes import STEPS, TOL, horizon, scene_of, step_size
from daebench.scene import Scene
from daebench.trajectory import Trajectory

FAMILIES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "on the manifold, symplectic": ("symplectic_euler", "rattle", "rattle/suzuki4", "lobatto3", "strang"),
        "positions on it, symplectic": ("shake",),
        "index-reduced ODE": ("se", "midpoint", "rk4"),
        "with projection": ("seproj", "rk4+proj"),
        "local coordinates": ("local:midpoint",),
        "mechanics codes": ("generalized_alpha", "radau2_ggl"),
        "DAE solver": ("ida:index3", "ida:index2", "ida:index1", "ida:ggl"),
        "ODE solver": ("cvode:adams", "scipy:DOP853"),
    }
)
"""Representatives of each family of methods."""

METHODS = tuple(name for members in FAMILIES.values() for name in members)
FAMILY = {name: family for family, members in FAMILIES.items() for name in members}

DEAR = ("local:midpoint", "ida:index2", "ida:index1", "ida:ggl", "cvode:adams")
"""Methods that need long derivations; they are run where there are at most ``FEW`` positions."""

FEW = 4
OUTPUTS = 101

ROUNDING = 1e5
"""Residuals and errors of up to so many roundings of a state are round-off."""

EVALUATIONS = ("H_p", "H_q", "g", "G", "second", "residual", "rhs")
SOLVES = ("solve", "jacobian")


def method(name: str) -> Method:
    """Return a method, uncompiled if it has fixed steps: runs are so short that compiling would take longer."""
    found = parse(name)
    return replace(found, compiled=False) if isinstance(found, FixedStep) else found


def chosen(scene: Scene) -> list[str]:
    """Return the methods that are run on a scene, or asked whether they can be."""
    return [name for name in METHODS if scene.d <= FEW or name not in DEAR]


def row(problem: str, name: str) -> dict[str, Any]:
    """Return what becomes of the first case of a problem with a method."""
    scene, found = scene_of(problem), method(name)
    about: dict[str, Any] = {"problem": problem, "case": scene.case, "family": FAMILY[name], "method": name, "knob": found.knob}
    about |= claimed(found)
    if (why := found.refusal(scene)) is not None:
        return about | {"end": "refused", "why": why, "t": 0.0}
    try:
        run = solve(problem, scene, found)
    except DaebenchError as error:
        return about | {"end": "stopped", "why": str(error), "t": 0.0}
    return about | measured(scene, run)


def solve(problem: str, scene: Scene, found: Method) -> Trajectory:
    """Return the run of a method to the end of a scene."""
    if found.knob == "h":
        return found.solve(scene, Request(value=step_size(problem), steps=STEPS, watch=()))
    return found.solve(scene, Request(value=TOL, t_end=horizon(problem).t_end, points=OUTPUTS, watch=()))


def claimed(found: Method) -> dict[str, bool]:
    """Return what a fixed-step method says of itself; a solver says nothing."""
    if not isinstance(found, FixedStep):
        return {"claims_manifold": False, "claims_energy": False}
    return {"claims_manifold": found.claims.on_manifold, "claims_energy": found.claims.conserves_energy}


def measured(scene: Scene, run: Trajectory) -> dict[str, Any]:
    """Return what a run, complete or not, did to energy, manifold and integrals, and its work.

    Errors are the largest over the outputs, that of the energy as a part of ``energy_scale``. ``g_rounding`` and ``Gv_rounding`` are the
    residuals that rounding explains.
    """
    scale, error = energy_scale(scene, run), energy_error(scene, run)
    eps = float(np.finfo(float).eps)
    rounding = [ROUNDING * eps * x for x in residual_scales(scene, run.p[0], run.q[0])]
    kept = integral_errors(scene, run)
    found: dict[str, Any] = {"end": "reached" if run.failure is None else "stopped", "why": run.failure or "", "t": float(run.t[-1])}
    found |= {"energy": largest(error) / scale, "kind": kind(run, error / scale), "energy_scale": scale}
    found |= {"g": largest(scene.along("g", run.q)), "Gv": largest(scene.along("Gv", run.p, run.q))}
    found |= {"g_rounding": rounding[0], "Gv_rounding": max(rounding[1], ROUNDING * eps)}
    found |= {"integrals": max((largest(each) for each in kept.values()), default=float("nan"))}
    found |= {"worst_integral": max(kept, key=lambda name: largest(kept[name]), default=""), "steps": run.steps}
    found |= {"evaluations": total(run.work, EVALUATIONS), "solves": total(run.work, SOLVES)}
    found |= {f"work_{name}": count for name, count in run.work.items()}
    found |= {"passages": len(run.passages), "branches": ", ".join(sorted({each.branch for each in run.passages}))}
    return found


def energy_scale(scene: Scene, run: Trajectory) -> float:
    """Return the largest kinetic energy, p.v / 2, in a run, or that of the start if it is larger; 1 if there is none."""
    T = np.einsum("ij,ij->i", run.p, scene.along("H_p", run.p, run.q)) / 2
    finite = T[np.isfinite(T)]
    return float(max(finite, default=0.0)) or 1.0


def largest(values: Any) -> float:
    """Return the largest modulus, infinite if one is not finite."""
    values = np.abs(np.asarray(values, dtype=float))
    return float(np.max(values)) if np.all(np.isfinite(values)) else float("inf")


def kind(run: Trajectory, error: Any) -> str:
    """Return what becomes of a relative energy error: "round-off", or a kind of :func:`daebench.diagnostics.energy.energy_drift`."""
    if largest(error) <= ROUNDING * float(np.finfo(float).eps):
        return "round-off"
    return energy_drift(run.t, error).kind


def total(work: Mapping[str, int], kinds: Sequence[str]) -> int:
    """Return how often anything of these kinds was done."""
    return sum(count for name, count in work.items() if name in kinds)
