"""A tolerance-driven run on a constrained problem: what it needs at the start, and its trajectory from what the solver gave."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from daebench.diagnostics.rank import REDUNDANT, dependence
from daebench.errors import DaebenchError
from daebench.methods.formulations.chain import BandedDae
from daebench.methods.formulations.constrained import Dae
from daebench.methods.solvers.chain_rank_monitor import ChainRankMonitor
from daebench.methods.solvers.drive import Array, Driven
from daebench.methods.solvers.rank_monitor import RankMonitor
from daebench.runs.ivp import ConstrainedIvp
from daebench.runs.request import Request
from daebench.runs.trajectory import CONSTRAINED, Passage, Trajectory

Drive = Callable[[Dae, Callable[..., RankMonitor]], Driven]
"""Drives a solver on what is posed, with the monitor that is made."""


def constrained(name: str, ivp: ConstrainedIvp, request: Request, posed: Callable[[ConstrainedIvp], Dae], drive: Drive) -> Trajectory:
    """Return the trajectory of a run that monitors whether G keeps its rank.

    Parameters
    ----------
    name : str
        Name of the method.
    ivp : ConstrainedIvp
        The problem.
    request : Request
        What is asked for, already checked.
    posed : callable
        Poses the initial value problem, whose ``on_singular`` says what to do where G loses rank.
    drive : callable
        See :data:`Drive`.

    Raises
    ------
    DaebenchError
        If constraints are dependent at the start, which are named, and are not to be solved by least squares.
    """
    mode = request.at_rank_loss(ivp)
    ivp = replace(ivp, on_singular=mode)
    if mode != "least-squares" and (why := dependence(ivp)):
        raise DaebenchError(f"{name} cannot start on {ivp.problem}, case {ivp.case}: G M^-1 G^T is singular there; {why}; {REDUNDANT}.")
    dae = posed(ivp)
    monitors: list[RankMonitor] = []

    def make_monitor(*settings: Any) -> RankMonitor:
        monitors.append(ChainRankMonitor(dae, mode, *settings) if isinstance(dae, BandedDae) else RankMonitor(dae, mode, *settings))
        return monitors[-1]

    found = drive(dae, make_monitor)
    failure = found.outcome["failure"]
    if failure and not found.outcome["interrupted"]:
        found = replace(found, outcome={**found.outcome, "failure": f"{failure[:-1]}{monitors[-1].reason()}."})
    return _trajectory(dae, request, found, monitors[-1].ended())


def _trajectory(dae: Dae, request: Request, found: Driven, passages: tuple[Passage, ...]) -> Trajectory:
    """Return the trajectory: momenta in the place of velocities, and the monitored quantities, over all outputs."""
    ivp, kept = dae.ivp, found.kept
    q, v = dae.unpack(found.Y)
    p = dae.momenta(q, v)
    p[0] = ivp.p0  # as given, without the round-off of p = M v
    monitored = request.watched(CONSTRAINED)
    return Trajectory(
        **found.outcome,
        t=found.t[kept],
        q=q[kept],
        p=p[kept],
        lam=ivp.along("lam", p[kept], q[kept]) if request.multipliers else None,
        maxima=_maxima(ivp, monitored, p, q),
        pivot=_smallest_pivot(ivp, p, q) if "manifold" in monitored else None,
        passages=passages,
    )


def _maxima(ivp: ConstrainedIvp, watch: tuple[str, ...], p: Array, q: Array) -> Mapping[str, float]:
    """Return the largest moduli over all outputs, those at the ends of ``every = 0`` and between them alike."""
    maxima: dict[str, Any] = {}
    if "energy" in watch:
        H = ivp.along("H", p, q)
        maxima["energy"] = np.max(np.abs(H - H[0]))
    if "manifold" in watch:
        maxima |= {"g": np.max(np.abs(ivp.along("g", q))), "Gv": np.max(np.abs(ivp.along("Gv", p, q)))}
    if "integrals" in watch and ivp.integrals:
        errors = ivp.along("integrals", p, q)
        maxima |= dict(zip(ivp.integrals, np.max(np.abs(errors - errors[0]), axis=0), strict=True))
    return {name: float(value) for name, value in maxima.items()}


def _smallest_pivot(ivp: ConstrainedIvp, p: Array, q: Array) -> float:
    """Return the smallest relative pivot of G H_pp G^T over all outputs: no solver's flag tells of rank loss, this does."""
    if ivp.arrays:
        return float(np.min(ivp.along("independence", p, q)))
    call = ivp.functions("lam_and_pivot").lam_and_pivot
    with np.errstate(all="ignore"):
        return float(min(call(tuple(a), tuple(b), ivp.par)[1] for a, b in zip(p, q, strict=True)))
