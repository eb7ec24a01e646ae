"""Orbit closure: where a planar trajectory crosses a ray at each revolution, and whether the orbit closes."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from daebench.diagnostics.drift import Drift
from daebench.diagnostics.energy import energy_drift
from daebench.errors import BadInput
from daebench.runs.ivp import Array, PoissonIvp
from daebench.runs.trajectory import PoissonTrajectory
from daebench.systems.lazily import scipy


@dataclass(frozen=True)
class Section:
    """A Poincare section: the crossings of a ray, all in the same sense.

    Parameters
    ----------
    t : ndarray, shape(k,)
        Times.
    y : ndarray, shape(k, 2)
        Places.
    distance : ndarray, shape(k,)
        Distances from the origin of the ray.
    """

    t: Array
    y: Array
    distance: Array


@dataclass(frozen=True)
class Closure:
    """How well an orbit closes.

    Parameters
    ----------
    revolutions : int
        Number of revolutions, one less than crossings.
    period : float
        Mean time of one.
    spread : float
        Largest less smallest distance of the crossings from the origin of the ray: 0 for a closed orbit.
    drift : Drift
        The secular part of the distances; "undetermined" of fewer than 32 crossings.
    """

    revolutions: int
    period: float
    spread: float
    drift: Drift


def section(ivp: PoissonIvp, trajectory: PoissonTrajectory, *, center: ArrayLike, direction: ArrayLike) -> Section:
    """Return the crossings of a planar trajectory with the ray center + r direction, r > 0, in the sense of the first one.

    Between outputs y is the cubic Hermite interpolant of states and of right sides B grad H, whose error of order four in their distance
    bounds what can be told from a crossing. A periodic orbit about the center crosses each ray from there once in a revolution, if it
    winds round it evenly.

    Parameters
    ----------
    ivp : PoissonIvp
        The problem with its numbers, of two coordinates.
    trajectory : PoissonTrajectory
        A run on it, with several outputs in each revolution.
    center : array_like, shape(2,)
        Origin of the ray, for example an equilibrium.
    direction : array_like, shape(2,)
        Direction of the ray; with a coordinate axis it is part of a coordinate line.

    Raises
    ------
    BadInput
        If the system is not planar, or center or direction is not valid.
    """
    begin, along = _ray(ivp, center, direction)
    across = np.array([-along[1], along[0]])
    t, y, rate = trajectory.t, trajectory.y, ivp.along("field", trajectory.y)
    if len(t) < 2:
        return _crossed(np.empty(0), np.empty((0, 2)), begin, along)
    orbit = scipy.interpolate.CubicHermiteSpline(t, y, rate)
    # Roots of one cubic polynomial in each interval, instead of a search along the orbit.
    height = scipy.interpolate.CubicHermiteSpline(t, (y - begin) @ across, rate @ across)
    times = np.unique(height.roots(discontinuity=False, extrapolate=False))
    times = times[np.isfinite(times) & ((orbit(times) - begin) @ along > 0)]
    sense = np.sign(height(times, 1))
    # Where an orbit winds unevenly it may cross the ray backwards, which is no revolution.
    times = _apart(times[sense == sense[0]], t) if len(times) else times
    return _crossed(times, orbit(times), begin, along)


def _ray(ivp: PoissonIvp, center: ArrayLike, direction: ArrayLike) -> tuple[Array, Array]:
    if ivp.size != 2:
        raise BadInput(f"a section by a ray is for planar systems, and {ivp.problem} has {ivp.size} coordinates.", "ray-not-planar")
    ray = [np.asarray(vector, dtype=float) for vector in (center, direction)]
    if any(vector.shape != (2,) or not np.all(np.isfinite(vector)) for vector in ray) or not np.any(ray[1]):
        raise BadInput(
            f"a ray needs a center and a direction of two finite numbers each, not {center!r} and {direction!r}.", "ray-malformed"
        )
    return ray[0], ray[1] / np.linalg.norm(ray[1])


def _apart(times: Array, t: Array) -> Array:
    """Return times without those that follow another within rounding: a crossing at an output is a root on either side of it."""
    close = 1e-9 * float(np.max(np.diff(t)))
    return np.asarray(times[np.concatenate([[True], np.diff(times) > close])], dtype=float)


def _crossed(t: Array, y: Array, begin: Array, along: Array) -> Section:
    return Section(np.asarray(t, dtype=float), np.asarray(y, dtype=float), np.asarray((y - begin) @ along, dtype=float))


def closure(crossings: Section, *, resolution: float = 0.0) -> Closure:
    """Return how well an orbit closes, from its crossings of a ray.

    For a Poisson integrator of a planar system the distances stay in a band, whose width is that of the interpolation and of the
    modified Hamiltonian; for others they wander off, which the drift tells by its slope, see
    :func:`daebench.diagnostics.energy.energy_drift`.

    Parameters
    ----------
    crossings : Section
        At least two.
    resolution : float
        Error of one distance, where it is known.

    Raises
    ------
    BadInput
        If there are fewer than two crossings.
    """
    t, r = crossings.t, crossings.distance
    if len(t) < 2:
        raise BadInput(
            f"the trajectory crosses the ray {('0 times', 'once')[len(t)]}, and closure needs two crossings; run longer, or move the ray.",
            "too-few-ray-crossings",
        )
    drift = energy_drift(t, r - r[0], resolution=resolution)
    return Closure(len(t) - 1, float(t[-1] - t[0]) / (len(t) - 1), float(np.ptp(r)), drift)
