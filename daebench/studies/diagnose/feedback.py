"""Behaviour of a code off the manifold as h goes to zero: none, a feedback after Baumgarte, or a jump back."""

from dataclasses import dataclass

import numpy as np

from daebench.runs.ivp import Array
from daebench.studies.diagnose.battery import Battery, Map, Point, attempted

OFF = 1e-2
"""How far states are moved off the manifold, relative to the largest momentum and position."""

SMALL = 1e-3
"""The step in units of the battery's; results are extrapolated from it, its half and its quarter."""

FITS = 1e-5
"""Largest relative residual of the feedback that is fitted."""

LEFT = 1e-6
"""Least |g| relative to the size of G and q that is off the manifold."""

BIASED = 1e-11
"""Largest residual of a bias, relative to the size of G and q."""


@dataclass(frozen=True)
class Feedback:
    """The constraint that a code's accelerations meet: g'' = -damping g' - stiffness g."""

    damping: float
    stiffness: float
    """2 alpha and beta^2 of Baumgarte, 1/s and 1/s^2; zero for index-reduced equations."""
    residual: float
    """What is left over, relative to the accelerations."""


def feedback(battery: Battery, step: Map) -> Feedback | None:
    """Return the feedback that the code's accelerations show off the manifold, None where they are those of no index-reduced equations."""
    mechanics, draw = battery.mechanics, np.random.default_rng(11)
    size_p, size_q = (float(scale) for scale in battery.scales)
    columns, targets, sizes, rests = [], [], [], []
    for point in battery.points:
        p = point.p + OFF * size_p * draw.standard_normal(len(point.p))
        q = point.q + OFF * size_q * draw.standard_normal(len(point.q))
        limits = rates(step, p, q, SMALL * battery.h)
        if limits is None:
            return None
        rate_p, rate_q = limits
        G, W, v = mechanics.gradient(q), mechanics.inverse_mass(q), mechanics.velocity(p, q)
        pull = -(rate_p + mechanics.reduced_slope(p, q))
        lam = np.linalg.lstsq(G.T, pull, rcond=None)[0]
        rests.append(max(_largest(pull - G.T @ lam) / _largest(rate_p), _largest(rate_q - v) / _largest(v)))
        columns.append(np.stack([G @ v, mechanics.constraint(q)], axis=1))
        targets.append(G @ W @ G.T @ lam)
        sizes.append(_largest(G @ W @ rate_p))
    return _fitted(np.concatenate(columns), np.concatenate(targets), max(sizes), max(rests))


def _fitted(A: Array, b: Array, size: float, rest: float) -> Feedback | None:
    (damping, stiffness), *_ = np.linalg.lstsq(A, b, rcond=None)
    residual = max(rest, _largest(A @ [damping, stiffness] - b) / size)
    if not residual <= FITS:
        return None
    acts = _largest(A @ [damping, stiffness]) > 10 * FITS * size
    return Feedback(_short(damping), _short(stiffness), residual) if acts else Feedback(0.0, 0.0, residual)


def _short(value: float) -> float:
    """Return the number of five digits that was written in the code, of one that is known to about as many."""
    return float(f"{value:.4g}")


def rates(step: Map, p: Array, q: Array, h: float) -> tuple[Array, Array] | None:
    """Return p' and q' as h goes to zero, extrapolated twice; None where the step jumps."""
    quotients = []
    for size in (h, h / 2, h / 4):
        p1, q1 = attempted(step, Point(size, p, q, (p, q)))
        quotients.append(np.concatenate([(p1 - p) / size, (q1 - q) / size]))
    if not all(np.isfinite(quotient).all() for quotient in quotients):
        return None
    first, second, third = quotients
    once = 2 * second - first, 2 * third - second
    rate = (4 * once[1] - once[0]) / 3
    d = len(p)
    return rate[:d], rate[d:]


def _largest(values: Array) -> float:
    return float(np.max(np.abs(values)))


def bias(battery: Battery) -> float | None:
    """Return c where velocities are solved for with a bias, G(q0) (q1 - q0) = -c g(q0), as game engines do; None where they are not.

    It shows in steps from states of the code's own run, which has left the manifold.
    """
    mechanics = battery.mechanics
    g = np.concatenate([mechanics.constraint(point.q) for point in battery.points])
    taken = -np.concatenate([mechanics.gradient(point.q) @ (point.after[1] - point.q) for point in battery.points])
    size = max(_largest(mechanics.gradient(point.q)) for point in battery.points) * float(battery.scales[1])
    if _largest(g) < LEFT * size:
        return None
    c = float(g @ taken / (g @ g))
    return c if _largest(taken - c * g) <= BIASED * size and 0 < c < 1 else None
