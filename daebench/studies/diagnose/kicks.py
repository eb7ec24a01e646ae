"""A step of kick, drift and kick with its constraints, and each of its parts as codes have it."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from daebench.runs.ivp import Array
from daebench.studies.diagnose.mechanics import Mechanics, State, drift, iterated
from daebench.studies.diagnose.positions import Positions, along_first_gradient, one_body

Momenta = Callable[[Mechanics, Array, Array], Array]
"""Maps the momentum after the second kick, and q1, to p1."""


def tangent(mechanics: Mechanics, p: Array, q: Array, factor: float = 1.0) -> Array:
    """Return p - G^T mu with G M^-1 p1 = 0, RATTLE's, or with a multiple of this mu."""
    G, W = mechanics.gradient(q), mechanics.inverse_mass(q)
    return np.asarray(p - factor * G.T @ np.linalg.solve(G @ W @ G.T, G @ mechanics.velocity(p, q)))


def as_it_is(mechanics: Mechanics, p: Array, q: Array) -> Array:
    """Return p."""
    return p


def fewer_tangent(mechanics: Mechanics, p: Array, q: Array, *, rows: slice) -> Array:
    """Return p - G^T mu with G M^-1 p1 = 0 of some of the constraints."""
    return tangent(replace(mechanics, rows=rows), p, q)


def on_one(mechanics: Mechanics, p: Array, q: Array, *, size: int, last: bool) -> Array:
    """Return p - D mu with G M^-1 p1 = 0, D the gradients of one body of each constraint alone."""
    G, W = mechanics.gradient(q), mechanics.inverse_mass(q)
    D = one_body(G, size, last=last).T
    return np.asarray(p - D @ np.linalg.solve(G @ W @ D, G @ W @ p))


def euclidean(mechanics: Mechanics, p: Array, q: Array) -> Array:
    """Return p - G^T mu with G p1 = 0: M^-1 is left out of the constraint."""
    G = mechanics.gradient(q)
    return np.asarray(p - G.T @ np.linalg.solve(G @ G.T, G @ p))


def wrong_matrix(mechanics: Mechanics, p: Array, q: Array) -> Array:
    """Return p - G^T (G G^T)^-1 G M^-1 p: M^-1 is left out of the matrix."""
    G = mechanics.gradient(q)
    return np.asarray(p - G.T @ np.linalg.solve(G @ G.T, G @ mechanics.velocity(p, q)))


def wrong_side(mechanics: Mechanics, p: Array, q: Array) -> Array:
    """Return p - G^T (G M^-1 G^T)^-1 G p: M^-1 is left out of the right-hand side."""
    G = mechanics.gradient(q)
    return np.asarray(p - G.T @ np.linalg.solve(G @ mechanics.inverse_mass(q) @ G.T, G @ p))


def orthogonal_velocity(mechanics: Mechanics, p: Array, q: Array) -> Array:
    """Return M times the velocity less its part along G^T: M^-1 is left out where the velocity is corrected."""
    G, v = mechanics.gradient(q), mechanics.velocity(p, q)
    return np.asarray(p - mechanics.mass(q) @ G.T @ np.linalg.solve(G @ G.T, G @ v))


def weighted_velocity(mechanics: Mechanics, p: Array, q: Array) -> Array:
    """Return M (v - G^T (G M^-1 G^T)^-1 G v): M^-1 is left out where a velocity is corrected by RATTLE's multipliers."""
    G, v = mechanics.gradient(q), mechanics.velocity(p, q)
    return np.asarray(p - mechanics.mass(q) @ G.T @ np.linalg.solve(G @ mechanics.inverse_mass(q) @ G.T, G @ v))


@dataclass(frozen=True)
class KickDriftKick:
    """A step, by default that of RATTLE, HLW (1.26).

    ::

        p_half = p0 - first h H_q(p_half, q0) - impulse
        q1, impulse = positions(...)
        p1 = momenta(p_half - second h H_q(p_half, q1))
    """

    first: float = 0.5
    second: float = 0.5
    """Parts of h in the two kicks."""
    positions: Positions = along_first_gradient
    """See :data:`daebench.studies.diagnose.positions.Positions`."""
    momenta: Momenta = tangent
    """See :data:`Momenta`."""
    second_at: str = "q1"
    projected_at: str = "q1"
    """Where the second kick is computed, and where the gradients for the momenta are taken: at "q0", at "q1", or at the "free" position
    that is reached without an impulse.
    """
    kicked_first: bool = True
    """Whether positions drift with the momentum after the first kick; otherwise with p0."""
    projected_first: bool = False
    """Whether momenta are projected before the second kick."""
    impulse_at_end: float = 0.0
    """How much of the impulse, its multipliers along G(q1), is taken from p1 once more."""

    def __call__(self, mechanics: Mechanics, p0: Array, q0: Array, h: float) -> State:
        """Return p1 and q1."""
        q1 = q0

        def half(p: Array) -> Array:
            nonlocal q1
            kick = self.first * h * mechanics.slope(p, q0)
            q1, impulse = self.positions(mechanics, p0 - kick if self.kicked_first else p0, q0, h)
            return p0 - kick - impulse

        p = half(p0) if mechanics.separable else iterated(half, p0)
        places = {"q0": q0, "q1": q1}
        if "free" in (self.second_at, self.projected_at):
            places["free"] = drift(mechanics, p0 - self.first * h * mechanics.slope(p, q0), q0, h)
        kick = self.second * h * mechanics.slope(p, places[self.second_at])
        if self.impulse_at_end:
            lam = np.linalg.lstsq(mechanics.gradient(q0).T, p0 - self.first * h * mechanics.slope(p, q0) - p, rcond=None)[0]
            kick = kick + self.impulse_at_end * mechanics.gradient(q1).T @ lam
        at = places[self.projected_at]
        return (self.momenta(mechanics, p, at) - kick if self.projected_first else self.momenta(mechanics, p - kick, at)), q1


RATTLE = KickDriftKick()
"""The right step."""
