"""Constraints that depend on others at a start: whether they depart from these nearby, and the rank of G at points of the set there."""

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from daebench.diagnostics.second_order import Dependence
from daebench.runs.ivp import Array, ConstrainedIvp

POINTS = 4
"""Number of directions from the start."""

FIRST = 4e-2
"""Distance of the first points nearby, as a part of the largest coordinate."""

FLAT = 0.05
"""Part of the distance that a projection may move a point: the set of independent constraints is then nearly flat over the distance."""

NEARER, SHORTER = 12, 4.0
"""Number of shorter distances that are tried, and their ratio, which is also that of the two distances that an order is taken from."""

SWEEPS = 80
"""Number of iterations of a projection; they gain about one bit each where constraints are tangential."""

DAMPED = 1e-2
"""Damping by the size of the residual. Without it, iterations run back to the start where branches cross."""

ROUNDED = 1e-11
"""Part of the terms of a constraint below which its change is rounding."""

SINGULAR = 1e-6
"""Singular value of rows of G at points nearby below which it is zero: 1e-4 and more where branches cross, else the root of rounding."""

HIGHEST = 8
"""Order from which on a departure is none."""

STAYS = 0.3
"""Part of its distance by which the projection of a point may move, if the set goes on in its direction."""


class Surroundings:
    """The constraints of a problem around its start, as functions of displacements x of unit mass, q = q0 + R x.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem with its numbers.
    dependent : Dependence
        The dependence of its constraints at the start.
    """

    def __init__(self, ivp: ConstrainedIvp, dependent: Dependence) -> None:
        self.ivp, self.dependent, R = ivp, dependent, dependent.root
        self.g0, G = ivp.value("g", ivp.q0), ivp.value("G", ivp.q0)
        size = np.abs(ivp.q0)
        # Rounding of g follows its terms, which are larger than g itself.
        self.terms = np.abs(G) @ size + np.einsum("kij,i,j->k", np.abs(dependent.curvatures), size, size)
        self.lengths = np.linalg.norm(G @ R, axis=1)
        self.bent = np.linalg.norm(R.T @ dependent.curvatures @ R, axis=(1, 2))

    def scale(self, distance: float) -> Array:
        """Return the slopes of the constraints at the start or, where there is none, farther than a distance; 1 of one that has none."""
        scale = np.maximum(self.lengths, self.bent * distance / FIRST)
        return np.where(scale > 0, scale, 1.0)

    def change(self, x: Array) -> Array:
        """Return the change of the constraints from the start, shape(m,): their values at the start may be roundings."""
        return np.asarray(self.ivp.value("g", self.ivp.q0 + self.dependent.root @ x) - self.g0, dtype=float)

    def rows(self, x: Array, distance: float) -> Array:
        """Return the rows of G at a displacement, in parts of their size within the distance."""
        R = self.dependent.root
        return np.asarray(self.ivp.value("G", self.ivp.q0 + R @ x) @ R / self.scale(distance)[:, None], dtype=float)

    def projected(self, x: Array, rows: Sequence[int]) -> Array | None:
        """Return the point near x at which some constraints are as at the start; None where it is not reached."""
        distance, chosen = float(np.linalg.norm(x)), list(rows)
        scale = self.scale(distance)[chosen]
        small = np.maximum(ROUNDED * self.terms[chosen] / scale, ROUNDED * distance)
        return damped(lambda x: self.change(x)[chosen] / scale, lambda x: self.rows(x, distance)[chosen], x, DAMPED / distance, small)


def damped(residual: Callable[[Array], Array], jacobian: Callable[[Array], Array], x: Array, damping: float, small: Array) -> Array | None:
    """Return a zero near x, up to small residuals, by Levenberg's iteration; None where none is reached."""
    least = np.inf
    for _ in range(SWEEPS):
        r = residual(x)
        size = float(np.max(np.abs(r) / small, initial=0.0))
        # On to what rounding allows: until the residual is far below the bound, or grows again.
        if not np.isfinite(size) or size <= 1e-4 or (size <= 1 and size >= least):
            break
        least = min(size, least)
        # The damping goes to zero with the residual, which leaves regular problems their fast convergence.
        rows = np.vstack([jacobian(x), math.sqrt(damping * float(np.linalg.norm(r))) * np.eye(len(x))])
        x = x - np.linalg.lstsq(rows, np.append(r, 0 * x), rcond=1e-13)[0]
    return x if size <= 1 else None


def orders(around: Surroundings) -> Array:
    """Return the order in the distance at which each dependent constraint departs from the independent ones; infinite where none."""
    dependent = list(around.dependent.others)
    far, near = np.zeros(len(dependent)), np.zeros(len(dependent))
    for along in _directions(around.dependent.free):
        distance = _flat_within(around, along)
        size = np.maximum(around.terms, around.scale(distance) * distance)[dependent]
        for values, part in ((far, 1.0), (near, 1 / SHORTER)):
            x = around.projected(part * distance * along, around.dependent.independent)
            if x is not None:
                np.maximum(values, np.abs(around.change(x)[dependent]) / size, out=values)
    rates = np.log(np.maximum(far, ROUNDED) / np.maximum(near, ROUNDED * 1e-3)) / math.log(SHORTER)
    # A larger order is that of a point on another branch of the independent constraints, from which the nearer point is away.
    return np.where((far > ROUNDED) & (rates < HIGHEST), np.maximum(np.round(rates), 2), np.inf)


def goes_on(around: Surroundings) -> tuple[bool, int]:
    """Return whether the set goes on in directions that second derivatives allow, and the largest rank of G at points of it there."""
    left, forms = around.dependent.kernel
    rank, stays = len(around.dependent.independent), True
    for along in _directions(left):
        v = left @ _on_cone(forms, left.T @ along)
        distance = _flat_within(around, v)
        x = around.projected(distance * v, range(around.ivp.m))
        if x is None or np.linalg.norm(x - distance * v) > STAYS * distance:
            stays = False
        else:
            rank = max(rank, int(np.sum(np.linalg.svd(around.rows(x, distance), compute_uv=False) > SINGULAR)))
    return stays, rank


def _on_cone(forms: Array, v: Array) -> Array:
    """Return a unit vector near v on which forms, shape(c, k, k), are zero; v itself where none is found."""
    small = np.full(len(forms) + 1, 1e-12)
    zero = damped(lambda u: np.append(forms @ u @ u, u @ u - 1), lambda u: np.vstack([2 * forms @ u, 2 * u]), v, DAMPED, small)
    return v if zero is None else zero


def _directions(free: Array) -> Iterator[Array]:
    """Yield unit combinations of directions, shape(n, k)."""
    for k in range(POINTS if free.shape[1] else 0):
        # Irregular weights, so that no symmetry keeps the rank low; both signs, as ranks may differ on the two sides.
        along = (-1) ** k * free @ np.cos(1.0 + k + np.arange(free.shape[1]))
        yield along / np.linalg.norm(along)


def _flat_within(around: Surroundings, along: Array) -> float:
    """Return a distance over which the set of the independent constraints is nearly flat."""
    ivp = around.ivp
    distance = FIRST * (float(np.max(np.abs(ivp.q0[: ivp.moving]))) or 1.0) / float(np.max(np.abs(around.dependent.root @ along)))
    for _ in range(NEARER):
        x = around.projected(distance * along, around.dependent.independent)
        if x is not None and np.linalg.norm(x - distance * along) <= FLAT * distance:
            break
        distance /= SHORTER
    return distance
