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
    failure : str or None
        Why the run ended early.
    """

    t: Array
    y: Array
    energy: Array
    volume: Array
    cats: list[Array]
    failure: str | None


@cache
def carried(scheme: str, start: str, h: float, t_end: float) -> Carried:
    """Return a run with its Poisson volume and the cat."""
    ivp, steps = prey(start), max(1, round(t_end / h))
    states, failure = paths(ivp, scheme, h, steps, ivp.y0 + 1j * STEP * np.eye(2))
    y, J = np.real(states[0]), np.imag(states) / STEP
    volume = (J[0, :, 0] * J[1, :, 1] - J[0, :, 1] * J[1, :, 0]) * np.prod(y[0]) / np.prod(y, axis=1)
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
        failure=failure,
    )


def cat(y0: Array) -> Array:
    """Return the outline of a cat's head about a state, shape(n, 2): its ears are in the logarithms of both populations."""
    ears = [(0.95, 0.55), (0.85, 1.25), (0.35, 0.93), (-0.35, 0.93), (-0.85, 1.25), (-0.95, 0.55)]
    angles = np.radians(np.linspace(150, 390, 25))
    corners = np.array([*ears, *zip(np.cos(angles), np.sin(angles), strict=True)])
    following = np.roll(corners, -1, axis=0)
    fine = np.concatenate([a + (b - a) * np.linspace(0, 1, FINE, endpoint=False)[:, None] for a, b in zip(corners, following, strict=True)])
    return np.asarray(np.asarray(y0) * np.exp(SIZE * fine))


def log_area(points: Array) -> float:
    """Return the area of an outline in the plane of ln u and ln v, its Poisson volume du dv/(u v); NaN if it is incomplete.

    It is half the integral of x dy - y dx; each line of the outline was straight once and is a polynomial through its points now.
    """
    nodes = np.arange(FINE + 1.0)
    powers = np.vander(nodes, increasing=True)
    slopes = np.column_stack([np.zeros(FINE + 1), *(k * nodes ** (k - 1) for k in range(1, FINE + 1))]) @ np.linalg.inv(powers)
    weights = np.linalg.solve(powers.T, FINE ** (nodes + 1) / (nodes + 1))
    lines = np.log(points).reshape(-1, FINE, 2)
    lines = np.concatenate([lines, np.roll(lines[:, :1], -1, axis=0)], axis=1)
    x, y = np.moveaxis(lines, 2, 0)
    return float(0.5 * np.sum((x * (y @ slopes.T) - y * (x @ slopes.T)) @ weights))


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
