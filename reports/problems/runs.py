"""One row per method: errors of energy, manifold and integrals of a problem, and the cost; or the reason why there is no run."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from typing import Any

import numpy as np

from daebench.diagnostics.drift import KEPT, UNDETERMINED
from daebench.diagnostics.energy_verdict import energy_error, kinetic_energy
from daebench.diagnostics.integrals import integral_errors
from daebench.diagnostics.manifold import residual_scales
from daebench.errors import DaebenchError
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.names import parse
from daebench.reports.problems.ivps import STEPS, TOL, horizon, ivp_of, step_size
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.runs.request import Method, Request, WorkLimit
from daebench.runs.trajectory import Trajectory
from daebench.studies.claims.bench import ROUNDINGS
from daebench.studies.held_verdict import held_verdict

FAMILIES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "on the manifold, symplectic": ("symplectic_euler", "rattle", "rattle/suzuki4", "lobatto3", "strang"),
        "positions on the manifold, symplectic": ("shake",),
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

BUTANE = "the derivation and compilation of the derivatives of the torsion force that they need takes too long"
SQUEEZER = "the derivation and compilation of the derivatives of M(q) of seven bodies on three loops that they need takes too long"
BODY = "the derivation and compilation of the derivatives that they need for nine positions under six constraints takes too long"
REDUNDANT = "the derivation and compilation for so many positions under redundant constraints takes too long"
SOLVERS = ("ida:index3", "ida:index2", "ida:index1", "ida:ggl", "cvode:adams", "scipy:DOP853")
LEFT_OUT: Mapping[tuple[str, str], str] = MappingProxyType(
    {("butane", name): BUTANE for name in ("ida:index2", "ida:index1", "ida:ggl", "cvode:adams")}
    | {("andrews_squeezer", name): SQUEEZER for name in ("ida:index1", "ida:ggl", "cvode:adams")}
    | {(problem, name): REDUNDANT for problem in ("bricard", "cyclohexane_ring") for name in ("radau2_ggl", *SOLVERS)}
    | {("rigid_body_rotation", name): BODY for name in ("ida:index2", "ida:index1", "ida:ggl", "cvode:adams")}
)
"""Pairs of a problem and a method that are not run, with the reason."""

LENGTHS = (1, 5, 25, 125)
"""Lengths of the runs from which a trend is read, in lengths of the run itself: one after another, until one decides it."""

ENOUGH = WorkLimit(calls=200_000, slow_calls=20_000, slow_part=100)
"""Work of a longer run with a tolerance, after which its trend is left open: beyond a loss of rank steps may become very small."""

ROUND_OFF = ROUNDINGS * STEPS * float(np.finfo(float).eps)
"""Relative residuals and errors up to this are round-off: the tolerance of ``daebench check`` for a run of so many steps."""

EVALUATIONS = ("H_p", "H_q", "g", "G", "second", "residual", "rhs")
SOLVES = ("solve", "jacobian")


TINY = 1e-6
"""Relative change of a state for the slopes of integrals: a size needs only a few digits."""


@dataclass(frozen=True)
class Sizes:
    """Sizes along a run.

    Parameters
    ----------
    energy : float
        Largest kinetic energy p.v / 2, in the unit of H; 1 if nothing moves.
    g, Gv : float
        Largest :func:`daebench.diagnostics.manifold.residual_scales`.
    integrals : mapping of str to float
        The size of each other first integral: its change under a change of p and q by a relative unit.
    """

    energy: float
    g: float
    Gv: float
    integrals: dict[str, float]


def sizes(ivp: ConstrainedIvp, run: Trajectory) -> Sizes:
    """Return the sizes along a run."""
    T = np.asarray(kinetic_energy(ivp, run.p, run.q))
    residuals = np.max([residual_scales(ivp, p, q) for p, q in zip(run.p, run.q, strict=True)], axis=0)
    return Sizes(float(np.max(T)) or 1.0, float(residuals[0]), float(residuals[1]), integral_sizes(ivp, run.p, run.q))


def integral_sizes(ivp: ConstrainedIvp, P: Array, Q: Array) -> dict[str, float]:
    """Return sum_j |I_q_j| max |q| + sum_j |I_p_j| max |p| of each first integral I, the largest over states of shape(n, d), by name.

    It is not |I|, because the terms of an integral that is zero are rounded, too.
    """
    if not ivp.integrals:
        return {}
    here, total = ivp.along("integrals", P, Q), np.zeros((len(P), len(ivp.integrals)))
    for j in range(ivp.d):
        for there in (moved(P, j), Q), (P, moved(Q, j)):
            total += np.abs(ivp.along("integrals", *there) - here) / TINY
    return {name: float(size) or 1.0 for name, size in zip(ivp.integrals, np.max(total, axis=0), strict=True)}


def moved(states: Array, j: int) -> Any:
    """Return states of shape(n, d) with column j moved by ``TINY`` times the largest number in each."""
    return states + TINY * np.max(np.abs(states), axis=1)[:, None] * np.eye(states.shape[1])[j]


def sizes_of(problem: str) -> Sizes:
    """Return the sizes along the run of RATTLE on the first case of a problem."""
    return sizes(ivp_of(problem), rattle(problem))


@lru_cache(maxsize=1)
def rattle(problem: str) -> Trajectory:
    """Return the run of RATTLE, by whose sizes all runs on a problem are measured."""
    return solve(problem, ivp_of(problem), parse("rattle"))


def row(problem: str, name: str, against: Sizes) -> dict[str, Any]:
    """Return the result of a method on the first case of a problem, with errors relative to sizes; a left-out pair has the reason."""
    ivp, solver = ivp_of(problem), parse(name)
    about: dict[str, Any] = {"problem": problem, "case": ivp.case, "family": FAMILY[name], "method": name, "knob": solver.knob}
    about |= {"claims_manifold": isinstance(solver, FixedStep) and solver.claims.on_manifold}
    if (problem, name) in LEFT_OUT:
        return about | {"end": "not run", "why": LEFT_OUT[problem, name], "t": 0.0}
    if (why := solver.refusal(ivp)) is not None:
        return about | {"end": "refused", "why": why, "t": 0.0}
    try:
        run = rattle(problem) if name == "rattle" else solve(problem, ivp, solver)
    except DaebenchError as error:
        return about | {"end": "stopped", "why": str(error), "t": 0.0}
    return about | measured(ivp, run, against) | trend(problem, ivp, solver, run, against)


def solve(problem: str, ivp: ConstrainedIvp, solver: Method[ConstrainedIvp, Trajectory]) -> Trajectory:
    """Return the run of a method to the end of an initial value problem."""
    return solver.solve(ivp, asked(problem, solver))


def asked(problem: str, solver: Method[ConstrainedIvp, Trajectory], length: int = 1) -> Request:
    """Return the request of a run to the end of an initial value problem, or of one that is longer."""
    steps = length * STEPS
    if solver.knob == "h":
        return Request(value=step_size(problem), steps=steps, watch=())
    limit = None if length == 1 else ENOUGH
    return Request(value=TOL, t_end=length * horizon(problem).t_end, points=steps + 1, watch=(), work_limit=limit)


def measured(ivp: ConstrainedIvp, run: Trajectory, against: Sizes) -> dict[str, Any]:
    """Return the errors of energy, manifold and integrals of a run, complete or not, and its work.

    Errors are the largest over the outputs; errors of energy and integrals are relative to their sizes. ``g_rounding`` and ``Gv_rounding``
    are the residuals that rounding explains.
    """
    error = energy_error(ivp, run) / against.energy
    relative_errors = {name: largest(errors) / against.integrals[name] for name, errors in integral_errors(ivp, run).items()}
    metrics: dict[str, Any] = {"end": "reached" if run.failure is None else "stopped", "why": run.failure or "", "t": float(run.t[-1])}
    metrics |= {"energy": largest(error), "energy_scale": against.energy}
    metrics |= {"g": largest(ivp.along("g", run.q)), "Gv": largest(ivp.along("Gv", run.p, run.q))}
    metrics |= {"g_rounding": ROUND_OFF * against.g, "Gv_rounding": ROUND_OFF * against.Gv}
    metrics |= {
        "integrals": max(relative_errors.values(), default=float("nan")),
        "worst_integral": max(relative_errors, key=relative_errors.__getitem__, default=""),
    }
    metrics |= {"steps": run.steps}
    metrics |= {"evaluations": total(run.work, EVALUATIONS), "solves": total(run.work, SOLVES)}
    metrics |= {f"work_{name}": count for name, count in run.work.items()}
    metrics |= {"passages": len(run.passages), "branches": ", ".join(sorted({passage.branch for passage in run.passages}))}
    return metrics


def largest(values: Any) -> float:
    """Return the largest modulus, infinite if one is not finite."""
    values = np.abs(np.asarray(values, dtype=float))
    return float(np.max(values)) if np.all(np.isfinite(values)) else float("inf")


def trend(problem: str, ivp: ConstrainedIvp, solver: Method[ConstrainedIvp, Trajectory], run: Trajectory, against: Sizes) -> dict[str, Any]:
    """Return the verdict on the energy, and the length of the shortest run that decides it.

    It is "kept", or the short form of :func:`daebench.studies.held_verdict.held_verdict`.
    """
    if largest(energy_error(ivp, run) / against.energy) <= ROUND_OFF:
        return {"kind": KEPT, "length": 1}
    # Each loss of rank that a run passes is located, which takes longer than the run.
    for length in LENGTHS[: 2 if run.passages else None]:
        request = asked(problem, solver, length)
        run = run if length == 1 else solver.solve(ivp, request)
        verdict = held_verdict(ivp, solver, request, run)
        if verdict.verdict != UNDETERMINED:
            break
    # A longer run that stops decides nothing: the run itself did not.
    return {"kind": verdict.brief if length == 1 or run.failure is None else UNDETERMINED, "length": length, "doubt": verdict.reason}


def total(work: Mapping[str, int], kinds: Sequence[str]) -> int:
    """Return the total count of the given kinds of work."""
    return sum(count for name, count in work.items() if name in kinds)
