"""The length and the rate of an initial value problem, in its own units: the scales with which the increments of a scheme are compared."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from daebench.runs.ivp import Array, ConstrainedIvp, PoissonIvp
from daebench.runs.members import Members

Leave = Callable[..., Any]
"""A map from the coordinates in which a scheme computes to those of the problem."""

SLACK = 2.0**10
"""Ratio of a radius of curvature r to the length above which r matters to Newton's iteration: r leaves positions uncertain by eps r."""

FLAT = 2.0**20
"""Ratio of a radius to the length above which a constraint is treated as flat."""

STEP = 1e-30
"""Imaginary step of the derivative of coordinates."""


def constrained_scales(ivp: ConstrainedIvp, h: float, *, rated: bool) -> tuple[float, float]:
    """Return the length L and the rate 1/T of a constrained initial value problem.

    ::

        L   = max(|q0|, min(s, r), min(r, 2^20 e) / 2^10),        e = max(|q0|, s),        s = h |v0| + h^2 |a0|
        1/T = max(|v0| / L, sqrt(|a0| / L)),                      v0 = H_p,  a0 = M^-1 H_q

    In most cases L is |q0|. The first step s and the radius r = min |G| / |g_qq| over the constraints matter if a motion begins at the
    origin of its coordinates and returns there: g = 0 determines positions up to the rounding of its terms, which are much larger there
    than q. g_qq is computed as a difference of G over the length e, and constraints without curvature are left out. Changes of the units
    of length, mass and time by powers of two cause no rounding, so that the motion in other units has the same digits. L and 1/T are
    positive unless nothing moves. For long chains L is |q0|, and no rate is computed. The time and its rate are left out.
    """
    q0 = np.asarray(ivp.q0)
    if ivp.arrays and np.any(q0):  # its functions would have to be compiled, and no scheme for it needs the rate
        return _largest(q0), 0.0
    with np.errstate(all="ignore"):
        n = ivp.moving  # without the time
        v, a = _largest(ivp.value("H_p", ivp.p0, q0)[:n]), _largest(_acceleration(ivp, q0)[:n])
        size, first = _largest(q0[:n]), _finite(h * v + h * h * a)
        radius = 0.0 if ivp.arrays or first + size == 0 else _radius(ivp, q0, max(size, first))
        # A radius counts only where it is far larger than the motion: then g = 0 leaves positions uncertain by roundings of the radius.
        length = max(size, min(first, radius) if radius else first, min(radius, FLAT * max(size, first)) / SLACK)
        rate = _finite(max(v / length, np.sqrt(a / length))) if rated and length > 0 else 0.0
    return length, float(rate)


def constrained_scales_of(members: Members, *, rated: bool) -> tuple[Array, Array]:
    """Return the length and the rate of each member, equal to those of :func:`constrained_scales` to the bit, shape(n,)."""
    p0, q0 = members.start
    with np.errstate(all="ignore"):
        n = members.ivp.moving
        v, a = _largest_of(members.along("H_p", p0, q0)[:, :n]), _largest_of(_acceleration_of(members)[:, :n])
        size, first = _largest_of(q0[:, :n]), _finite_of(members.h * v + members.h * members.h * a)
        extent = np.where(first > size, first, size)
        radius = np.where(first + size == 0, 0.0, _radius_of(members, extent))
        reached = np.where(radius != 0, np.minimum(first, radius), first)
        length = np.maximum(size, np.maximum(reached, np.minimum(radius, FLAT * extent) / SLACK))
        rate = _finite_of(np.maximum(v / length, np.sqrt(a / length))) if rated else np.zeros(len(members))
    return length, np.where(length > 0, rate, 0.0)


def _acceleration_of(members: Members) -> Array:
    p0, q0 = members.start
    gradient = members.along("H_q", p0, q0)
    if members.ivp.facts.QUADRATIC:
        return members.along("H_p", gradient, q0)
    return np.stack([matrix @ row for matrix, row in zip(members.along("H_pp", p0, q0), gradient, strict=True)])


def _radius_of(members: Members, extent: Array) -> Array:
    q0 = members.start[1]
    d = q0.shape[1]
    n = members.ivp.moving
    shift = extent[:, None] * np.append(np.cos(1.0 + np.arange(n)), np.zeros(d - n))
    here, there = members.along("G", q0)[:, :, :n], members.along("G", q0 + shift)[:, :, :n]
    slope, turn = np.abs(here).sum(axis=2), np.abs(there - here).sum(axis=2)
    radii = np.where((turn > 0) & np.isfinite(slope / turn), extent[:, None] * slope / turn, np.inf)
    least = radii.min(axis=1, initial=np.inf)
    return np.where(np.isfinite(least), least, 0.0)


def _largest_of(rows: Array) -> Array:
    moduli = np.abs(rows)
    largest: Array = np.where(np.isfinite(moduli), moduli, 0.0).max(axis=1, initial=0.0)
    return largest


def _finite_of(x: Array) -> Array:
    return np.where(np.isfinite(x), x, 0.0)


def poisson_scales_of(members: Members) -> tuple[Array, Array]:
    """Return the scales of :func:`poisson_scales` for each member, shape(n,)."""
    (y0,) = members.start
    size = _largest_of(y0)
    if not np.all(np.any(y0, axis=1)):
        size = np.where(np.any(y0, axis=1), size, _finite_of(members.h * _largest_of(members.along("field", y0))))
    return size, np.zeros(len(members))


def poisson_scales(ivp: PoissonIvp, h: float) -> tuple[float, float]:
    """Return the size of the initial state of a Poisson system, or of its first step if the state is zero; and 0 for the unknown rate."""
    y0 = np.asarray(ivp.y0)
    if np.any(y0):
        return _largest(y0), 0.0
    return _finite(h * _largest(ivp.value("field", y0))), 0.0


def scales_of(members: Members, *, rated: bool) -> tuple[Array, Array]:
    """Return the length and the rate of each member, shape(n,); the rate of a Poisson system is unknown, and 0."""
    return constrained_scales_of(members, rated=rated) if members.ivp.on_manifold else poisson_scales_of(members)


def in_coordinates(
    scales: tuple[float, float], leave: Leave, start: Sequence[Any], moved: int, *, timed: bool = False
) -> tuple[float, float]:
    """Return length and rate in other coordinates x of the same motion: L / |dq/dx|, and the same rate."""
    length, rate = scales
    parts = [np.asarray(part, dtype=complex) for part in start]
    largest = 0.0
    with np.errstate(all="ignore"):
        for k in range(len(parts[moved]) - timed):
            # Parts are changed in place and changed back: complex numbers of 1e-30 leave real parts as they are.
            parts[moved][k] += 1j * STEP
            left = leave(*(tuple(part) for part in parts))
            places = np.asarray(left[-1] if len(parts) > 1 else left)
            largest = max(largest, _largest(np.imag(places[: len(places) - timed]) / STEP))
            parts[moved][k] -= 1j * STEP
        return (_finite(length / largest) if largest > 0 else _largest(np.real(parts[moved]))), rate


def _acceleration(ivp: ConstrainedIvp, q0: Array) -> Any:
    """Return M^-1 H_q at the start, including the part that the constraint forces balance."""
    gradient = ivp.value("H_q", ivp.p0, q0)
    if ivp.facts.QUADRATIC:
        return ivp.value("H_p", gradient, q0)
    return ivp.value("H_pp", ivp.p0, q0) @ gradient


def _radius(ivp: ConstrainedIvp, q0: Array, extent: float) -> float:
    """Return the smallest radius |G| / |g_qq| of the curved constraints; 0 if no constraint is curved."""
    n = ivp.moving
    # Irregular components, so that no constraint keeps its gradient along the shift by symmetry.
    shift = extent * np.append(np.cos(1.0 + np.arange(n)), np.zeros(ivp.d - n))
    here, there = ivp.value("G", q0)[:, :n], ivp.value("G", q0 + shift)[:, :n]
    slope, turn = np.abs(here).sum(axis=1), np.abs(there - here).sum(axis=1)
    radii = [extent * a / b for a, b in zip(slope, turn, strict=True) if b > 0 and np.isfinite(a / b)]
    return min(radii, default=0.0)


def _largest(x: Any) -> float:
    """Return the largest modulus that is finite."""
    return max((_finite(float(abs(component))) for component in np.ravel(x)), default=0.0)


def _finite(x: float) -> float:
    return float(x) if np.isfinite(x) else 0.0
