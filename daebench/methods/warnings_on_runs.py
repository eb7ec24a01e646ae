"""Warnings on a run that reached its end but is of no use: its energy or its constraints are lost."""

import numpy as np

from daebench.diagnostics.energy import ROUNDED
from daebench.diagnostics.energy_verdict import EnergyScales, energy_error, energy_scales, kinetic_energy
from daebench.diagnostics.negative_damping import negative_damping
from daebench.runs.ivp import ConstrainedIvp, Ivp
from daebench.runs.trajectory import Array, Outcome

BROKEN = 0.25
"""Fraction of the possible change of g along the path from the start above which a constraint is broken."""

RESOLVED = 1e-6
"""Relative change of positions below which g is not compared with their path, because a motion may begin at rest."""

SMALLER = "use a smaller h or tol, or another method"
"""What to do."""


def doubts_at_start(ivp: Ivp) -> list[str]:
    """Return sentences on an initial value problem that is allowed but unusual: a negative damping adds energy."""
    if not (ivp.on_manifold and negative_damping(ivp)):
        return []
    return [f"{ivp.problem}, case {ivp.case}: the damping is negative at the start, so that the force feeds energy in."]


def losses(ivp: Ivp, run: Outcome) -> list[str]:
    """Return sentences on why the motion of a completed run is lost: its energy, or a constraint.

    The energy is lost if its error is larger than the mean kinetic energy T of the motion, or, on a Poisson system, than the modulus of H
    at the start, and larger than rounding, or the tolerance, explains. The T of the run contains the energy error e, so the mean modulus of
    T - e is used in its place. The largest error is that over all steps; the states are those that the run looked at, whatever it stored.
    """
    if run.failure is not None:
        return []
    seen = run.looked_at()
    reasons = [_lost_energy(ivp, seen)]
    if ivp.on_manifold:
        reasons.append(_broken_constraint(ivp, seen))
    return [f"{run.method} on {run.problem}, case {run.case}: {reason}; {SMALLER}." for reason in reasons if reason]


def _lost_energy(ivp: Ivp, run: Outcome) -> str:
    error = energy_error(ivp, run)
    T = kinetic_energy(ivp, *run.vectors)
    if T is None:
        scale, what = abs(float(ivp.along("H", *(vector[:1] for vector in run.vectors))[0])), "|H|"
    else:
        scale, what = float(np.mean(np.abs(T - error))), "the mean kinetic energy"
    largest = max(float(np.max(np.abs(error))), run.maxima.get("energy", 0.0))
    if not largest > max(scale, _explained(ivp, run)) or not scale > 0:
        return ""
    beyond = np.flatnonzero(np.abs(error) > scale)
    since = f" from t = {run.t[beyond[0]]:.9g} on" if len(beyond) else ""
    return f"the motion is lost{since}: the energy error, {largest:.3g}, is {largest / scale:.3g} times {what}, {scale:.3g}"


def _explained(ivp: Ivp, run: Outcome) -> float:
    """Return the energy error that rounding of the terms of H explains, or a tolerance."""
    scales: EnergyScales = energy_scales(ivp, run)
    most = float(scales.most)
    if ivp.on_manifold and not ivp.arrays:
        n = ivp.moving
        slopes = np.abs(np.asarray(ivp.value("H_q", *ivp.start), dtype=float)[:n])
        most = max(most, float(slopes @ np.abs(ivp.q0[:n])))
    rounding = ROUNDED * float(np.finfo(run.position.dtype).eps) * max(1, run.steps) ** 0.5
    return float(max(rounding, run.value if run.knob == "tol" else 0.0) * most)


def _broken_constraint(ivp: ConstrainedIvp, run: Outcome) -> str:
    """Return which constraint has an error of a large fraction of its possible change along the path, and from when on; "" if none has."""
    if ivp.arrays:
        return ""
    g, G = np.abs(ivp.along("g", run.position)), np.abs(ivp.along("G", run.position))
    room, floor = (np.einsum("rij,rj->ri", G, length) for length in (_way(run.position), 1.0 + np.abs(run.position)))
    broken = np.argwhere(g > np.maximum(BROKEN * room, RESOLVED * floor))
    if not len(broken):
        return ""
    row, k = broken[0]
    name, since, sizes = ivp.named(int(k)), f"from t = {run.t[row]:.9g} on", f"is {g[row, k]:.3g}, and {g[:, k].max():.3g} at most"
    if ivp.words(int(k)):
        return f"{name} is broken {since}, where its equation {sizes}"
    return f"{name} = 0 is broken {since}, where |{name}| {sizes}"


def _way(q: Array) -> Array:
    """Return the largest distance of each position from its start, up to each row."""
    distances: Array = np.maximum.accumulate(np.abs(q - q[0]), axis=0)
    return distances
