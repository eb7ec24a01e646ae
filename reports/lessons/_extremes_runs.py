"""The runs of the lesson on extremes: a mechanism that locks, a stiff spring, a long sum, two nearby pendulums, and thousands."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from daebench.diagnostics.integrals import energy_error
from daebench.methods.ensemble.run import run_members
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.pages.lesson.control import Values
from daebench.runs.ivp import Array
from daebench.runs.members import members
from daebench.runs.request import Request
from daebench.runs.trajectory import Trajectory

T_END = 3.0
"""End of the runs of the mechanism and of the spring, s."""

SHOWN, PARTED = 400, 0.1
"""Number of drawn states of a long sum, and the distance, m, at which pendulums count as separated."""


SIDE, SEEN = 64, 0.05
"""Number of angles of release of each arm on the map, and approximate sampling interval of an arm, s."""

ALIKE = 0.1 + SEEN / 2
"""Smallest difference between the times of two turns, s, above a tenth: times are multiples of the sampling interval."""


@cache
def locked(scheme: str, rod: float, h: float) -> tuple[Trajectory, Array, Array]:
    """Return a run of the slider-crank, its energy error, and the smaller singular value of G over the larger one."""
    ivp = initial_value_problem("slider_crank", "turning", {"rod": rod})
    run = parse(scheme).solve(ivp, Request(value=h, t_end=T_END, every=1, watch=()))
    singular = np.linalg.svd(ivp.along("G", run.q), compute_uv=False)
    return run, energy_error(ivp, run), singular[:, -1] / singular[:, 0]


@cache
def penalised(scheme: str, eps: float, h: float) -> tuple[Trajectory, Array, Array]:
    """Return a run of the penalised system, its distance from the constrained motion, and |g|; values that are not finite are left out."""
    ivp = initial_value_problem("spherical_pendulum", "fig1.2")
    request = Request(value=h, t_end=T_END, every=1, watch=())
    reference = parse("lobatto3").solve(ivp, request)
    run = parse(scheme, {"eps": eps}).solve(ivp, request)
    n = min(len(run.t), len(reference.t))
    away = np.linalg.norm(run.q[:n] - reference.q[:n], axis=1)
    return run, away, np.abs(ivp.along("g", run.q[:n])).ravel()


@cache
def summed(compensated: bool, h: float, steps: int) -> tuple[Array, Array]:
    """Return times and the error of the angular momentum about the vertical, which RATTLE keeps up to round-off."""
    ivp = initial_value_problem("spherical_pendulum", "fig1.1")
    request = Request(value=h, steps=steps, every=max(1, steps // SHOWN), watch=())
    run = parse("rattle", compensated=compensated).solve(ivp, request)
    L3 = run.q[:, 0] * run.p[:, 1] - run.q[:, 1] * run.p[:, 0]
    return run.t, L3 - L3[0]


@cache
def released(scheme: str, delta: float, h: float, t_end: float) -> tuple[Trajectory, Array]:
    """Return the run of a double pendulum released delta rad below the horizontal, and its energy error."""
    c, s = float(np.cos(delta)), float(np.sin(delta))
    ivp = initial_value_problem("double_pendulum", "horizontal", q0=(c, -s, 2 * c, -2 * s), p0=(0.0,) * 4)
    run = parse(scheme).solve(ivp, Request(value=h, t_end=t_end, every=max(1, round(t_end / h / 2000)), watch=()))
    return run, energy_error(ivp, run)


def apart(values: Values) -> tuple[Array, Array, Array]:
    """Return times, the distance of the lower points of both pendulums, and the energy error of the first."""
    (one, energy), (other, _) = (released(values["scheme"], delta, values["h"], values["t_end"]) for delta in (0.0, values["delta"]))
    n = min(len(one.t), len(other.t))
    return one.t[:n], np.linalg.norm(one.q[:n, 2:] - other.q[:n, 2:], axis=1), energy[:n]


def parted(t: Array, distance: Array) -> float:
    """Return the first time at which the distance is a tenth of an arm; NaN if there is none."""
    large = np.flatnonzero(distance > PARTED)
    return float(t[large[0]]) if len(large) else float("nan")


def releases() -> tuple[Array, Array]:
    """Return the edges of the angles of release on the map, shape(SIDE + 1,), and their middles, shape(SIDE,), rad from hanging."""
    edges = np.linspace(-np.pi, np.pi, SIDE + 1)
    return edges, (edges[1:] + edges[:-1]) / 2


@cache
def turned(scheme: str, h: float, t_end: float) -> tuple[Array, Array]:
    """Return the time at which the lower arm first turns over, s, and the largest energy error, J, from each release at rest.

    Both have shape(SIDE, SIDE), a row for each angle of the lower arm, a column for each of the upper one; infinite if it never turns over.
    """
    upper, lower = (angles.ravel() for angles in np.meshgrid(releases()[1], releases()[1]))
    one = np.stack([np.sin(upper), -np.cos(upper)], axis=1)
    q = np.concatenate([one, one + np.stack([np.sin(lower), -np.cos(lower)], axis=1)], axis=1)
    ivp, steps, every = initial_value_problem("double_pendulum", "horizontal"), round(t_end / h), max(1, round(SEEN / h))
    asked = Request(value=h, steps=steps, every=every, watch=("energy",), count=False)
    run = run_members(parse(scheme), members(ivp, (np.zeros_like(q), q), h, {}), asked)
    arm = run.states[:, :, 6:8] - run.states[:, :, 4:6]
    over = (arm[1:, :, 0] * arm[:-1, :, 0] < 0) & (np.minimum(arm[1:, :, 1], arm[:-1, :, 1]) > 0)
    when = np.where(over.any(axis=0), run.t[1 + over.argmax(axis=0)], np.inf)
    return when.reshape(SIDE, SIDE), run.maxima["energy"].reshape(SIDE, SIDE)


def alike(when: Array, after: float, until: float) -> float:
    """Return, for releases that turn over in a span of time, the fraction of neighbours that do so within a tenth of a second of them.

    Neighbours differ in one angle by one place on the map; a neighbour that never turns over does not count.

    Parameters
    ----------
    when : ndarray, shape(SIDE, SIDE)
        Times of :func:`turned`, s.
    after, until : float
        The span of time, s, without its beginning.
    """
    close: list[NDArray[np.bool_]] = []
    for times in (when, when.T):
        for one, other in ((times[1:], times[:-1]), (times[:-1], times[1:])):
            some = (one > after) & (one <= until)
            close.append(np.abs(one[some] - other[some]) < ALIKE)
    return float(np.mean(np.concatenate(close)))


def cannot_turn() -> NDArray[np.bool_]:
    """Return which releases have too little energy for the lower arm to stand upright, shape(SIDE, SIDE): 2 cos upper + cos lower > 1."""
    upper, lower = np.meshgrid(releases()[1], releases()[1])
    too_low: NDArray[np.bool_] = 2 * np.cos(upper) + np.cos(lower) > 1
    return too_low
