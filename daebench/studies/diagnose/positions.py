"""Ways to meet the position constraint at the end of a drift: RATTLE's, and those that codes have in its place."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from daebench.runs.ivp import Array
from daebench.studies.diagnose.mechanics import ITERATIONS, Mechanics, drift, iterated, settled

Positions = Callable[[Mechanics, Array, Array, float], tuple[Array, Array]]
"""Maps the momentum after the kick, q0 and h to q1 and the impulse that is taken from the momentum."""

Matrix = Callable[[Array, Array, Array], Array]
"""Maps the gradients at q0 and at the iterate, and M^-1, to the matrix of a sweep."""


def newton_matrix(G0: Array, G: Array, W: Array) -> Array:
    """Return the derivative of g along the gradients at q0."""
    return np.asarray(G @ W @ G0.T)


def first_matrix(G0: Array, G: Array, W: Array) -> Array:
    """Return the matrix at q0."""
    return np.asarray(G0 @ W @ G0.T)


def current_matrix(G0: Array, G: Array, W: Array) -> Array:
    """Return the matrix at the iterate."""
    return np.asarray(G @ W @ G.T)


MATRICES: dict[str, Matrix | None] = {
    "with G(q) M^-1 G(q0)^T": newton_matrix,
    "with G(q0) M^-1 G(q0)^T": first_matrix,
    "with G(q) M^-1 G(q)^T": current_matrix,
    "one constraint after the other": None,
}
"""How a sweep solves for the multipliers: all at once with a matrix, or one after the other."""


MEETING = 8
"""Newton iterations in which one constraint is met along a fixed direction."""


def displaced(mechanics: Mechanics, p: Array, q0: Array, h: float, directions: Array) -> tuple[Array, Array]:
    """Return q1 on the manifold and the impulse with which it is reached, a combination of given columns."""
    W, impulse = mechanics.inverse_mass(q0), np.zeros_like(p)

    def sweep(q: Array) -> Array:
        nonlocal impulse
        nu = np.linalg.solve(h * mechanics.gradient(q) @ W @ directions, mechanics.constraint(q))
        impulse = impulse + directions @ nu
        return drift(mechanics, p - impulse, q0, h)

    q1 = iterated(sweep, drift(mechanics, p, q0, h))
    return q1, impulse


def along_first_gradient(mechanics: Mechanics, p: Array, q0: Array, h: float) -> tuple[Array, Array]:
    """Return q1 and the impulse h/2 G(q0)^T lam with which g(q1) = 0: RATTLE's."""
    return displaced(mechanics, p, q0, h, mechanics.gradient(q0).T)


def along_last_gradient(mechanics: Mechanics, p: Array, q0: Array, h: float, *, impulse_at_start: bool = False) -> tuple[Array, Array]:
    """Return q1 reached along G(q1), the nearest point of the manifold in the metric M; the impulse may be along G(q0) all the same."""
    q1 = iterated(lambda q: displaced(mechanics, p, q0, h, mechanics.gradient(q).T)[0], along_first_gradient(mechanics, p, q0, h)[0])
    G1 = mechanics.gradient(q1)
    _, impulse = displaced(mechanics, p, q0, h, G1.T)
    return q1, _along(mechanics.gradient(q0), G1, impulse) if impulse_at_start else impulse


def along_gradient_between(
    mechanics: Mechanics, p: Array, q0: Array, h: float, *, part: float, impulse_at_start: bool = False
) -> tuple[Array, Array]:
    """Return q1 reached along the gradients at a part of the way from q0 to q1; the impulse may be along G(q0) all the same."""
    first = along_first_gradient(mechanics, p, q0, h)[0]
    q1 = iterated(lambda q: displaced(mechanics, p, q0, h, mechanics.gradient(q0 + part * (q - q0)).T)[0], first)
    return _reached_along(mechanics, p, q0, h, q0 + part * (q1 - q0), impulse_at_start)


def along_drifted_gradient(
    mechanics: Mechanics, p: Array, q0: Array, h: float, *, kick: float = 0.0, part: float = 1.0, impulse_at_start: bool = False
) -> tuple[Array, Array]:
    """Return q1 reached along the gradients where the positions are once they have drifted, before they are corrected."""
    drifted = drift(mechanics, p + kick * h * mechanics.slope(p, q0), q0, part * h)
    return _reached_along(mechanics, p, q0, h, drifted, impulse_at_start)


def _reached_along(mechanics: Mechanics, p: Array, q0: Array, h: float, where: Array, impulse_at_start: bool) -> tuple[Array, Array]:
    G = mechanics.gradient(where)
    q1, impulse = displaced(mechanics, p, q0, h, G.T)
    return q1, _along(mechanics.gradient(q0), G, impulse) if impulse_at_start else impulse


def acting_on_one(mechanics: Mechanics, p: Array, q0: Array, h: float, *, size: int, last: bool) -> tuple[Array, Array]:
    """Return q1 reached by impulses that act on one body of each constraint alone, the last or the first, of so many positions each."""
    return displaced(mechanics, p, q0, h, one_body(mechanics.gradient(q0), size, last=last).T)


def one_body(G: Array, size: int, *, last: bool) -> Array:
    """Return gradients of which the entries of all bodies but the last, or the first, are left out; NaN where there are no such bodies."""
    if G.shape[1] % size:
        return np.full_like(G, np.nan)
    rows_of_body = np.zeros_like(G)
    for row, full in zip(rows_of_body, G, strict=True):
        bodies = [k for k in range(0, G.shape[1], size) if np.any(full[k : k + size])]
        k = bodies[-1 if last else 0] if bodies else 0
        row[k : k + size] = full[k : k + size]
    return rows_of_body


def unconstrained(mechanics: Mechanics, p: Array, q0: Array, h: float) -> tuple[Array, Array]:
    """Return q1 after the drift alone, and no impulse."""
    return drift(mechanics, p, q0, h), np.zeros_like(p)


def fewer_met(mechanics: Mechanics, p: Array, q0: Array, h: float, *, rows: slice) -> tuple[Array, Array]:
    """Return q1 and the impulse with which some of the constraints are met."""
    return along_first_gradient(replace(mechanics, rows=rows), p, q0, h)


def timed(mechanics: Mechanics, p: Array, q0: Array, h: float, *, power: int) -> tuple[Array, Array]:
    """Return RATTLE's q1, and its impulse multiplied by a power of h."""
    q1, impulse = along_first_gradient(mechanics, p, q0, h)
    return q1, h**power * impulse


def _along(G: Array, of: Array, impulse: Array) -> Array:
    """Return an impulse with the multipliers that it has in the gradients ``of``, along G."""
    return np.asarray(G.T @ np.linalg.lstsq(of.T, impulse, rcond=None)[0])


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
    for _ in range(sweeps):
        if float(np.max(np.abs(mechanics.constraint(q)))) <= tolerance:
            break
        before = q
        for rows in _groups(len(G0), together=matrix is not None):
            along = (mechanics.gradient(q) if current else G0)[rows]
            for _ in range(MEETING if each_met else 1):
                G = mechanics.gradient(q)[rows]
                A = (matrix or newton_matrix)(along if matrix is None else G0[rows], G, W)
                nu = np.linalg.solve(A, mechanics.constraint(q)[rows])
                q, impulse = q - W @ along.T @ nu, impulse + along.T @ nu / h
                total[rows] += nu / h
        change = float(np.max(np.abs(q - before)))
        if not np.isfinite(change) or settled(change, previous, q):
            break
        previous = change
    return q, G0.T @ total if impulse_at == "q0" else impulse


def _groups(m: int, *, together: bool) -> Sequence[slice]:
    return [slice(0, m)] if together else [slice(k, k + 1) for k in range(m)]


def without_mass(
    mechanics: Mechanics, p: Array, q0: Array, h: float, *, drifting: bool = True, displacing: bool = False, consistent: bool = False
) -> tuple[Array, Array]:
    """Return q1 with M^-1 left out in its drift, its displacement, or both, and the impulse along G(q0)^T."""
    directions = mechanics.gradient(q0).T
    W = mechanics.inverse_mass(q0) if displacing else np.eye(len(q0))
    start = drift(mechanics, p, q0, h) if drifting else q0 + h * p
    impulse = np.zeros_like(p)

    def sweep(q: Array) -> Array:
        nonlocal impulse
        impulse = impulse + directions @ np.linalg.solve(h * mechanics.gradient(q) @ W @ directions, mechanics.constraint(q))
        return start - h * W @ impulse

    q1 = iterated(sweep, start)
    return q1, mechanics.mass(q0) @ impulse if consistent else impulse


def scaled(mechanics: Mechanics, p: Array, q0: Array, h: float, *, position: float = 1.0, momentum: float = 1.0) -> tuple[Array, Array]:
    """Return RATTLE's q1 and impulse, the multipliers multiplied by a factor each."""
    q1, impulse = along_first_gradient(mechanics, p, q0, h)
    if position != 1.0:
        q1 = drift(mechanics, p - position * impulse, q0, h)
    return q1, momentum * impulse


IMPULSES = (("corrections", ""), ("q0", ", impulse along G(q0)"))
"""Where the gradients of an impulse are taken, and words for it."""

ANEW: dict[str, Positions] = {
    **{
        f"{name}{where}": partial(swept, matrix=matrix, current=True, impulse_at=impulse_at)
        for name, matrix in MATRICES.items()
        for impulse_at, where in IMPULSES
    },
    **{
        f"one constraint after the other, each met before the next{where}": partial(
            swept, matrix=None, current=True, impulse_at=impulse_at, each_met=True
        )
        for impulse_at, where in IMPULSES
    },
}
"""Iterations whose gradients are taken anew in each sweep."""
