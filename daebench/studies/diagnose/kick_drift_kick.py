"""A step of kick, drift and kick with its constraints, and each of its parts: RATTLE's, and those that codes have in its place."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from daebench.runs.ivp import Array
from daebench.studies.diagnose.mechanics import ITERATIONS, Mechanics, State, drift, iterated, largest, multiples, settled

Positions = Callable[[Mechanics, Array, Array, float], tuple[Array, Array]]
"""Maps the momentum after the kick, q0 and h to q1 and the impulse that is taken from the momentum."""

Momenta = Callable[[Mechanics, Array, Array], Array]
"""Maps the momentum after the second kick, and q1, to p1."""

Matrix = Callable[[Array, Array, Array], Array]
"""Maps the gradients at q0 and at the iterate, and M^-1, to the matrix of a sweep."""


def newton_matrix(G0: Array, G: Array, W: Array) -> Array:
    """Return the derivative of g along the gradients at q0."""
    return np.asarray(G @ W @ G0.T)


MATRICES: dict[str, Matrix | None] = {
    "with G(q) M^-1 G(q0)^T": newton_matrix,
    "with G(q0) M^-1 G(q0)^T": lambda G0, G, W: G0 @ W @ G0.T,
    "with G(q) M^-1 G(q)^T": lambda G0, G, W: G @ W @ G.T,
    "one constraint after the other": None,
}
"""How a sweep solves for the multipliers: all at once with a matrix, or one after the other."""

MEETING = 8
"""Newton iterations in which one constraint is met along a fixed direction."""


def changed(function: Callable[..., Any], mechanics: Mechanics, *state: Any, **changes: Any) -> Any:
    """Return a step, or a part of it, of a problem with another force, fewer constraints, or another value of them: :class:`Mechanics`."""
    return function(replace(mechanics, **changes), *state)


# ---- momenta


def tangent(
    mechanics: Mechanics,
    p: Array,
    q: Array,
    *,
    factor: float = 1.0,
    matrix: bool = True,
    side: bool = True,
    momentum: bool = True,
    body: Callable[[Array], Array] | None = None,
) -> Array:
    """Return p - G^T mu with (G M^-1 G^T) mu = G H_p: RATTLE's.

    A factor multiplies mu, and M^-1 is left out in the matrix, in the right-hand side (G p), or where the momentum is corrected (M G^T mu)
    if these are not. G^T may be that of one body of each constraint.
    """
    G, W = mechanics.gradient(q), mechanics.inverse_mass(q)
    D = (body(G) if body else G).T
    mu = np.linalg.solve(G @ W @ D if matrix else G @ D, G @ (mechanics.velocity(p, q) if side else p))
    return np.asarray(p - factor * (D if momentum else mechanics.mass(q) @ D) @ mu)


def as_it_is(mechanics: Mechanics, p: Array, q: Array) -> Array:
    """Return p."""
    return p


EUCLIDEAN = partial(tangent, matrix=False, side=False)
"""p - G^T mu with G p1 = 0: M^-1 is left out of the constraint."""


def one_body(G: Array, size: int, *, last: bool) -> Array:
    """Return gradients of which the entries of all bodies but the last, or the first, are left out; NaN where there are no such bodies."""
    if G.shape[1] % size:
        return np.full_like(G, np.nan)
    rows_of_body = np.zeros_like(G)
    for row, full in zip(rows_of_body, G, strict=True):
        bodies = [k for k in range(0, G.shape[1], size) if np.any(full[k : k + size])] or [0]
        k = bodies[-1 if last else 0]
        row[k : k + size] = full[k : k + size]
    return rows_of_body


# ---- positions


def displaced(
    mechanics: Mechanics,
    p: Array,
    q0: Array,
    h: float,
    directions: Array,
    W: Array | None = None,
    end: Callable[[Array], Array] | None = None,
) -> tuple[Array, Array]:
    """Return q1 on the manifold and the impulse with which it is reached, a combination of given columns.

    ``end(impulse)`` is the position after the drift, by default that of p - impulse.
    """
    W, impulse = mechanics.inverse_mass(q0) if W is None else W, np.zeros_like(p)
    end = end or (lambda impulse: drift(mechanics, p - impulse, q0, h))

    def sweep(q: Array) -> Array:
        nonlocal impulse
        impulse = impulse + directions @ np.linalg.solve(h * mechanics.gradient(q) @ W @ directions, mechanics.constraint(q))
        return end(impulse)

    return iterated(sweep, end(impulse)), impulse


def along_first_gradient(
    mechanics: Mechanics, p: Array, q0: Array, h: float, *, body: Callable[[Array], Array] | None = None
) -> tuple[Array, Array]:
    """Return q1 and the impulse h/2 G(q0)^T lam with which g(q1) = 0: RATTLE's, or one that acts on one body of each constraint."""
    G = mechanics.gradient(q0)
    return displaced(mechanics, p, q0, h, (body(G) if body else G).T)


def along_gradient_between(
    mechanics: Mechanics, p: Array, q0: Array, h: float, *, part: float, impulse_at_start: bool = False
) -> tuple[Array, Array]:
    """Return q1 reached along the gradients at a part of the way from q0 to q1; with 1 that is the nearest point in the metric M."""

    def where(q: Array) -> Array:
        return q if part == 1 else q0 + part * (q - q0)

    first = along_first_gradient(mechanics, p, q0, h)[0]
    q1 = iterated(lambda q: displaced(mechanics, p, q0, h, mechanics.gradient(where(q)).T)[0], first)
    return _reached_along(mechanics, p, q0, h, where(q1), impulse_at_start)


def along_drifted_gradient(
    mechanics: Mechanics, p: Array, q0: Array, h: float, *, kick: float, part: float, impulse_at_start: bool
) -> tuple[Array, Array]:
    """Return q1 reached along the gradients where the positions are once they have drifted, before they are corrected."""
    drifted = drift(mechanics, p + kick * h * mechanics.slope(p, q0), q0, part * h)
    return _reached_along(mechanics, p, q0, h, drifted, impulse_at_start)


def _reached_along(mechanics: Mechanics, p: Array, q0: Array, h: float, where: Array, impulse_at_start: bool) -> tuple[Array, Array]:
    """Return q1 reached along the gradients of a position; the impulse may be along G(q0) with the same multipliers."""
    G = mechanics.gradient(where)
    q1, impulse = displaced(mechanics, p, q0, h, G.T)
    return q1, mechanics.gradient(q0).T @ multiples(G, impulse) if impulse_at_start else impulse


def unconstrained(mechanics: Mechanics, p: Array, q0: Array, h: float) -> tuple[Array, Array]:
    """Return q1 after the drift alone, and no impulse."""
    return drift(mechanics, p, q0, h), np.zeros_like(p)


def scaled(
    mechanics: Mechanics, p: Array, q0: Array, h: float, *, position: float = 1.0, momentum: float = 1.0, power: int = 0
) -> tuple[Array, Array]:
    """Return RATTLE's q1 and impulse, the multipliers multiplied by a factor each, and those of the momentum by a power of h."""
    q1, impulse = along_first_gradient(mechanics, p, q0, h)
    if position != 1.0:
        q1 = drift(mechanics, p - position * impulse, q0, h)
    return q1, momentum * h**power * impulse


def without_mass(
    mechanics: Mechanics, p: Array, q0: Array, h: float, *, drifting: bool = True, displacing: bool = False, consistent: bool = False
) -> tuple[Array, Array]:
    """Return q1 with M^-1 left out in its drift, its displacement, or both, and the impulse along G(q0)^T."""
    W = mechanics.inverse_mass(q0) if displacing else np.eye(len(q0))
    start = drift(mechanics, p, q0, h) if drifting else q0 + h * p
    q1, impulse = displaced(mechanics, p, q0, h, mechanics.gradient(q0).T, W, lambda impulse: start - h * W @ impulse)
    return q1, mechanics.mass(q0) @ impulse if consistent else impulse


def swept(
    mechanics: Mechanics,
    p: Array,
    q0: Array,
    h: float,
    *,
    matrix: Matrix | None = newton_matrix,
    current: bool = False,
    impulse_at: str = "corrections",
    sweeps: int = ITERATIONS,
    tolerance: float = 0.0,
    each_met: bool = False,
) -> tuple[Array, Array]:
    """Return q1 and the impulse after some sweeps."""
    G0, W = mechanics.gradient(q0), mechanics.inverse_mass(q0)
    q, impulse, total, previous = drift(mechanics, p, q0, h), np.zeros_like(p), np.zeros(len(G0)), np.inf
    groups = [slice(0, len(G0))] if matrix else [slice(k, k + 1) for k in range(len(G0))]
    for _ in range(sweeps):
        if float(np.max(np.abs(mechanics.constraint(q)))) <= tolerance:
            break
        before = q
        for rows in groups:
            along = (mechanics.gradient(q) if current else G0)[rows]
            for _ in range(MEETING if each_met else 1):
                A = (matrix or newton_matrix)(G0[rows] if matrix else along, mechanics.gradient(q)[rows], W)
                nu = np.linalg.solve(A, mechanics.constraint(q)[rows])
                q, impulse = q - W @ along.T @ nu, impulse + along.T @ nu / h
                total[rows] += nu / h
        change = largest(q - before)
        if not np.isfinite(change) or settled(change, previous, q):
            break
        previous = change
    return q, G0.T @ total if impulse_at == "q0" else impulse


ANEW: dict[str, Positions] = {
    f"{name}{where}": partial(swept, matrix=matrix, current=True, impulse_at=impulse_at, each_met=each_met)
    for name, matrix, each_met in (
        *((name, matrix, False) for name, matrix in MATRICES.items()),
        ("one constraint after the other, each met before the next", None, True),
    )
    for impulse_at, where in (("corrections", ""), ("q0", ", impulse along G(q0)"))
}
"""Iterations whose gradients are taken anew in each sweep."""


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
    """See :data:`Positions`."""
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
        kicked = p0 - self.first * h * mechanics.slope(p, q0)
        places = {"q0": q0, "q1": q1}
        if "free" in (self.second_at, self.projected_at):
            places["free"] = drift(mechanics, kicked, q0, h)
        kick = self.second * h * mechanics.slope(p, places[self.second_at])
        if self.impulse_at_end:
            kick = kick + self.impulse_at_end * mechanics.gradient(q1).T @ multiples(mechanics.gradient(q0), kicked - p)
        at = places[self.projected_at]
        return (self.momenta(mechanics, p, at) - kick if self.projected_first else self.momenta(mechanics, p - kick, at)), q1


RATTLE = KickDriftKick()
"""The right step."""
