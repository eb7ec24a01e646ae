"""A constrained problem's functions in NumPy, for steps that are written out with a mistake."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from daebench.runs.ivp import Array, ConstrainedIvp

State = tuple[Array, Array]
"""Momenta and positions."""

ITERATIONS = 200
"""Most sweeps of an iteration; one that has not settled by then has no solution here."""

SETTLED = 1e-15
"""Relative size of an increment that ends an iteration."""

STAGNANT = 1e-12
"""Relative size below which increments that no longer shrink end it too."""


def largest(*vectors: Array) -> float:
    """Return the largest modulus of the entries of some vectors, infinite if one is not finite."""
    value = max(float(np.max(np.abs(vector))) for vector in vectors)
    return value if np.isfinite(value) else np.inf


def multiples(G: Array, vector: Array) -> Array:
    """Return the factors of the rows of G whose sum is nearest to a vector."""
    return np.asarray(np.linalg.lstsq(G.T, vector, rcond=None)[0], dtype=float)


def beside(G: Array, vector: Array) -> Array:
    """Return the part of a vector that is not along the rows of G."""
    return np.asarray(vector - G.T @ multiples(G, vector))


@dataclass(frozen=True, eq=False)
class Mechanics:
    """The functions of p and q that a step is made of; all take and return arrays."""

    ivp: ConstrainedIvp
    """The problem with its numbers."""
    force: float | Array = 1.0
    """Factor of H_q: one for the problem, another for a code that has another force; shape (d,)."""
    rows: slice | NDArray[np.int64] = field(default_factory=lambda: slice(None))
    """The constraints that are imposed."""
    target: float | Array = 0.0
    """Value at which g is held; shape (m,)."""

    def __post_init__(self) -> None:
        names = ("H_p", "H_q", "H_pp", "mass", "G", "g", "lam")
        object.__setattr__(self, "_module", self.ivp.functions(*names))
        object.__setattr__(self, "_par", tuple(map(np.float64, self.ivp.par)))

    def _value(self, name: str, *vectors: Array) -> Array:
        with np.errstate(all="ignore"):  # states of faulty steps may leave the domain of H
            value = getattr(self._module, name)(*(tuple(vector) for vector in vectors), self._par)  # type: ignore[attr-defined]
        return np.array(value, dtype=float)

    @property
    def separable(self) -> bool:
        """Whether H = 1/2 p^T M^-1 p + U(q) with constant M."""
        return bool(self.ivp.facts.SEPARABLE)

    def velocity(self, p: Array, q: Array) -> Array:
        """Return H_p, shape(d,)."""
        return self._value("H_p", p, q)

    def slope(self, p: Array, q: Array) -> Array:
        """Return H_q, minus the force, shape(d,)."""
        return self.force * self._value("H_q", p, q)

    def gradient(self, q: Array) -> Array:
        """Return G, the gradients of the constraints, shape(m, d)."""
        return self._value("G", q)[self.rows]

    def constraint(self, q: Array) -> Array:
        """Return g, shape(m,)."""
        return (self._value("g", q) - self.target)[self.rows]

    def inverse_mass(self, q: Array) -> Array:
        """Return M^-1, shape(d, d)."""
        return self._value("H_pp", np.zeros_like(q), q)

    def mass(self, q: Array) -> Array:
        """Return M, shape(d, d)."""
        return self._value("mass", np.zeros_like(q), q)

    def reduced_slope(self, p: Array, q: Array, damping: float = 0.0, stiffness: float = 0.0) -> Array:
        """Return -p' of the index-reduced equations, H_q + G^T lam, lam as in (1.12); damped after Baumgarte by 2 alpha and beta^2."""
        G = self.gradient(q)
        lam = self.multipliers(p, q)
        if damping or stiffness:
            fed_back = damping * G @ self.velocity(p, q) + stiffness * self.constraint(q)
            lam = lam + np.linalg.solve(G @ self.inverse_mass(q) @ G.T, fed_back)
        return self.slope(p, q) + G.T @ lam

    def multipliers(self, p: Array, q: Array) -> Array:
        """Return lam(p, q), (1.12), shape(m,)."""
        lam = self._value("lam", p, q)
        if np.all(self.force == 1.0):
            return lam
        G, W = self.gradient(q), self.inverse_mass(q)
        return np.asarray(lam + np.linalg.solve(G @ W @ G.T, G @ W @ ((1 - self.force) * self._value("H_q", p, q))))

    def distance(self, q: Array) -> float:
        """Return how far a position is from the manifold, the largest component of a Newton step onto it."""
        G, W = self.gradient(q), self.inverse_mass(q)
        return largest(W @ G.T @ np.linalg.solve(G @ W @ G.T, self.constraint(q)))


def settled(change: float, previous: float, x: Array) -> bool:
    """Return whether an iteration has come to round-off: its increment is below it, or is small and no longer shrinks."""
    return change <= SETTLED * largest(x) or (change >= previous and change <= STAGNANT * largest(x))


def iterated(update: Callable[[Array], Array], x: Array, most: int = ITERATIONS) -> Array:
    """Return the limit of an iteration; NaN where there is none."""
    previous = np.inf
    for _ in range(most):
        before, x = x, update(x)
        change = largest(x - before)
        if not np.isfinite(change):
            break
        if settled(change, previous, x):
            return x
        previous = change
    return np.full_like(x, np.nan)


def drift(mechanics: Mechanics, p: Array, q: Array, h: float) -> Array:
    """Return q1 = q + h/2 (H_p(p, q) + H_p(p, q1)), which is q + h M^-1 p where M is constant."""
    v = mechanics.velocity(p, q)
    if mechanics.separable:
        return q + h * v
    return iterated(lambda q1: q + h / 2 * (v + mechanics.velocity(p, q1)), q + h * v)
