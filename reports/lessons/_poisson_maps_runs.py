"""Predator and prey, and the free rigid body: runs step by step, the Poisson volume along them, and a cat that moves with them."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from daebench.diagnostics.derivative import STEP
from daebench.methods.names import POISSON, parse
from daebench.reports.poisson.orbits import level_curve
from daebench.reports.poisson.runs import ivp_of
from daebench.runs.ivp import Array, PoissonIvp
from daebench.runs.request import Request

PREY, BODY = "lotka_volterra", "free_rigid_body"
BY_HAND = "euler"
"""The explicit Euler method, y1 = y0 + h f(y0), a method that should not be used."""

SNAPSHOTS = 4
"""Number of times that the cat is drawn after the start."""

SIZE, FINE = 0.12, 4
"""Half the width of the cat in the logarithms, and points on each line of its outline."""

EARS = [(0.95, 0.55), (0.85, 1.25), (0.35, 0.93), (-0.35, 0.93), (-0.85, 1.25), (-0.95, 0.55)]
ROUND = np.radians(np.linspace(150, 390, 25))
CORNERS = np.array([*EARS, *zip(np.cos(ROUND), np.sin(ROUND), strict=True)])
"""Corners of the outline of a cat's head."""


@cache
def prey(start: str) -> PoissonIvp:
    """Return predator and prey from a start "u,v"."""
    u, v = map(float, start.split(","))
    return ivp_of(PREY, "4,2", y0=(u, v))


@cache
def orbit(start: str) -> Array:
    """Return the exact orbit, shape(n, 2)."""
    return np.asarray(level_curve(prey(start))[["u", "v"]])


def paths(ivp: PoissonIvp, name: str, h: float, steps: int, starts: Array) -> tuple[Array, str | None]:
    """Return the states after 0, 1, 2, ... steps from several complex starts, shape(k, n, 2), and why the first ended early.

    States that are not reached are NaN; n is the number of states from the first start.
    """
    runs, failure = by_hand(ivp, h, steps, starts) if name == BY_HAND else compiled(ivp, name, h, steps, starts)
    n = len(runs[0])
    states = np.full((len(runs), n, 2), np.nan, dtype=complex)
    for k, run in enumerate(runs):
        states[k, : len(run)] = run[:n]
    return states, failure


def compiled(ivp: PoissonIvp, name: str, h: float, steps: int, starts: Array) -> tuple[list[Array], str | None]:
    """Return the runs of a scheme from several starts, and why the first ended early."""
    method: Any = parse(name, kind=POISSON, anyway=True)
    path = method.path(ivp, h, steps)
    runs = [path(y) for y in starts]
    return [rows for rows, _ in runs], runs[0][1]


def by_hand(ivp: PoissonIvp, h: float, steps: int, starts: Array) -> tuple[list[Array], str | None]:
    """Return the runs of the explicit Euler method from several starts, and why the first ended early."""
    (a, b), states = ivp.par, [np.asarray(starts, dtype=complex).T]
    with np.errstate(all="ignore"):
        for _ in range(steps):
            u, v = states[-1]
            states.append(np.array([u + h * u * (v - b), v + h * v * (a - u)]))
    runs = np.moveaxis(np.array(states), (0, 2), (1, 0))
    good = np.logical_and.accumulate(np.all(np.isfinite(runs) & (np.real(runs) > 0), axis=2), axis=1)
    lengths = good.sum(axis=1)
    ended = None if lengths[0] > steps else f"euler stopped at t = {lengths[0] * h:.4g}: the populations are no longer positive."
    return [run[:length] for run, length in zip(runs, lengths, strict=True)], ended


@dataclass(frozen=True)
class Carried:
    """A run of predator and prey, with its Poisson volume and cats.

    Parameters
    ----------
    t : ndarray, shape(n,)
        Times, s.
    y : ndarray, shape(n, 2)
        States.
    energy : ndarray, shape(n,)
        Energy error.
    volume : ndarray, shape(n,)
        Poisson volume of a small piece about the state, over that at the start.
    cats : list of ndarray, shape(k, 2)
        The outline at the start and at equidistant times.
    share : float
        Poisson volume of the cat at the end, over that at the start; NaN if a part of it is lost.
    failure : str or None
        Why the run ended early.
    """

    t: Array
    y: Array
    energy: Array
    volume: Array
    cats: list[Array]
    share: float
    failure: str | None


@cache
def carried(scheme: str, start: str, h: float, t_end: float) -> Carried:
    """Return a run with its Poisson volume and the cat."""
    ivp, steps = prey(start), max(1, round(t_end / h))
    states, failure = paths(ivp, scheme, h, steps, ivp.y0 + 1j * STEP * np.eye(2))
    y, J = np.real(states[0]), np.imag(np.moveaxis(states, 0, 1)) / STEP
    volume = piece(y[:1], y, J)
    level, outline = ivp.along("H", y), cat(ivp.y0)
    walked = np.real(paths(ivp, scheme, h, len(y) - 1, outline.astype(complex))[0]) if len(y) > 1 else outline[:, None]
    snapshots = dict.fromkeys(
        (len(y) - 1) * k // SNAPSHOTS for k in range(SNAPSHOTS + 1) if (len(y) - 1) * k // SNAPSHOTS < walked.shape[1]
    )
    return Carried(
        t=np.asarray(h * np.arange(len(y)), dtype=float),
        y=y,
        energy=level - level[0],
        volume=volume,
        cats=[walked[:, snapshot] for snapshot in snapshots],
        share=grown(ivp, scheme, h, len(y) - 1),
        failure=failure,
    )


def cat(y0: Array) -> Array:
    """Return the outline of a cat's head about a state, shape(n, 2): its ears are in the logarithms of both populations."""
    following = np.roll(CORNERS, -1, axis=0)
    fine = np.concatenate([a + (b - a) * np.linspace(0, 1, FINE, endpoint=False)[:, None] for a, b in zip(CORNERS, following, strict=True)])
    return np.asarray(np.asarray(y0) * np.exp(SIZE * fine))


def inside() -> tuple[Array, Array]:
    """Return points in the head of a cat, shape(n, 2), and weights that sum to 1: the mean over the cat of a function.

    They are Gauss's rules on the triangles between the middle and the lines of the outline.
    """
    a, b = CORNERS, np.roll(CORNERS, -1, axis=0)
    outwards, along = (np.polynomial.legendre.leggauss(n) for n in (3, 2))
    r, s = ((nodes + 1) / 2 for nodes, _ in (outwards, along))
    edge = a[:, None] + (b - a)[:, None] * s[:, None]
    points = r[:, None, None, None] * edge
    area = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    weights = (outwards[1] * r)[:, None, None] * area[:, None] * along[1]
    return points.reshape(-1, 2), weights.ravel() / weights.sum()


def grown(ivp: PoissonIvp, scheme: str, h: float, steps: int) -> float:
    """Return the Poisson volume of the cat after so many steps, over that at the start; NaN where a part of it is lost.

    It is the mean over the cat of the volume of a small piece, by derivatives in both directions at every point, and not the area of an
    outline, which needs more points the longer the cat gets.
    """
    points, weights = inside()
    starts = np.asarray(ivp.y0) * np.exp(SIZE * points)
    pushed = (starts[:, None] + 1j * STEP * np.eye(2)).reshape(-1, 2)
    states, _ = paths(ivp, scheme, h, steps, pushed)
    if states.shape[1] <= steps:
        return float("nan")
    ends = states[:, -1].reshape(-1, 2, 2)
    return float(weights @ piece(starts, np.real(ends[:, 0]), np.imag(ends) / STEP))


def piece(start: Array, end: Array, J: Array) -> Array:
    """Return the Poisson volume of a small piece about a state, over that at the start; ``J[..., k, :]`` is the derivative along y_k."""
    determinant = J[..., 0, 0] * J[..., 1, 1] - J[..., 0, 1] * J[..., 1, 0]
    return np.asarray(determinant * np.prod(start, axis=-1) / np.prod(end, axis=-1))


@dataclass(frozen=True)
class Spun:
    """A run of the rigid body: t, states of shape(n, 3), and errors of the energy and of the Casimir function."""

    t: Array
    y: Array
    energy: Array
    casimir: Array
    failure: str | None


STARTS = {"axis3": (np.cos(1.1), 0.0, np.sin(1.1)), "axis1": (np.cos(0.45), 0.0, np.sin(0.45)), "middle": (np.sin(0.12), np.cos(0.12), 0.0)}


@cache
def spun(scheme: str, start: str, h: float, steps: int) -> Spun:
    """Return a run of the rigid body."""
    ivp = ivp_of(BODY, "hlw", y0=STARTS[start])
    run = parse(scheme, kind=POISSON, anyway=True).solve(ivp, Request(value=h, steps=steps, watch=()))
    level, length = ivp.along("H", run.y), np.sum(run.y**2, axis=1) / 2
    return Spun(run.t, run.y, level - level[0], length - length[0], run.failure)
