"""The algebra of schemes in NumPy, and Newton's iteration, as functions whose text stands in readable generated code."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

REAL = np.float64
EPS, INF = np.finfo(REAL).eps, np.inf
CONSTRAINTS = 0
OK, NOT_CONVERGED, SINGULAR, NOT_FINITE = 0, 1, 2, 3

Report = tuple[int, float, float]
"""Status, residual, and the smallest relative pivot."""


def newton(update: Callable[..., Any], x: Any, data: Any) -> tuple[Any, Report]:
    """Repeat x, size, scale, residual, pivot = update(x, data) until the increment is at round-off; return x and a report.

    The increment, not the residual, ends the iteration: a small residual would leave a bias, and cause a drift of the energy. It is at
    round-off if its size is at most 4 EPS scale, or if it no longer shrinks and is at most 1e4 EPS scale.
    """
    last = INF
    for _ in range(100):
        x, size, scale, residual, pivot = update(x, data)
        status = judge(residual, pivot, size)
        if status != OK or size <= 4 * EPS * scale or (size >= last and size <= 1e4 * EPS * scale):
            return x, (status, residual, pivot)
        last = size
    return x, (NOT_CONVERGED, residual, pivot)


def once(update: Callable[..., Any], x: Any, data: Any) -> tuple[Any, Report]:
    """Return x after one update, and a report."""
    x, size, _, residual, pivot = update(x, data)
    return x, (judge(residual, pivot, size), residual, pivot)


def judge(residual: float, pivot: float, size: float) -> int:
    """Return the status of a linear solve: whether its input was finite, the matrix regular, and the result finite."""
    if residual < INF and not pivot > 4 * EPS:
        return SINGULAR
    return OK if residual < INF and size < INF else NOT_FINITE


def linear(pivot: float, residual: float) -> Report:
    """Return the report of a single linear solve."""
    return judge(residual, pivot, residual), residual, pivot


def both(first: Report, second: Report) -> Report:
    """Return the report of two solutions in a row: the first that failed, and the smaller pivot."""
    return first if first[0] != OK else (second[0], second[1], min(first[2], second[2]))


def solve(A: Any, b: Any, X: Any = None) -> Any:
    """Return A^-1 b, for rows X also the rows A^-1 X_k, and the smallest pivot relative to its row, by Gauss's elimination."""
    n, pivot = len(b), INF
    columns = [b] if X is None else [b, *X]
    A = np.column_stack([A, *columns])
    scale = np.abs(A[:, :n]).max(axis=1, initial=0.0)
    for k in range(n):
        largest = k + np.argmax(np.abs(A[k:, k]) / np.where(scale[k:] > 0, scale[k:], 1))
        A[[k, largest]], scale[[k, largest]] = A[[largest, k]], scale[[largest, k]]
        pivot = min(pivot, abs(A[k, k]) / scale[k] if scale[k] > 0 else 0.0)
        for i in range(k + 1, n):
            A[i] -= A[i, k] / A[k, k] * A[k]
    for k in reversed(range(n)):
        A[k, n:] = (A[k, n:] - A[k, k + 1 : n] @ A[k + 1 :, n:]) / A[k, k]
    return (A[:, n], pivot) if X is None else (A[:, n], A[:, n + 1 :].T, pivot)


def solve_mass(A: Any, b: Any, X: Any = None) -> Any:
    """Return A^-1 b, and for rows X the rows A^-1 X_k, of a mass matrix A = M(q)."""
    return solve(A, b, X)


def solve_blocks(B: Sequence[Sequence[Any]], b: Sequence[Any]) -> tuple[tuple[Any, ...], float]:
    """Return x with sum_j B_ij x_j = b_i for blocks B_ij, and the smallest relative pivot."""
    x, pivot = solve(np.block([list(row) for row in B]), np.concatenate(b))
    return tuple(np.split(x, len(b))), pivot


def solve_2m(A: Any, B: Any, C: Any, D: Any, b: Any, c: Any) -> tuple[Any, Any, float]:
    """Return x and y with A x + B y = b and C x + D y = c, and the smallest relative pivot."""
    (x, y), pivot = solve_blocks([[A, B], [C, D]], [b, c])
    return x, y, pivot


def norm(x: Any) -> Any:
    """Return the sum of moduli."""
    return np.abs(x).sum()


def dot(x: Any, y: Any) -> Any:
    """Return x^T y."""
    return x @ y


def dot_moduli(x: Any, y: Any) -> Any:
    """Return the sum of the moduli |x_i y_i|."""
    return np.abs(x) @ np.abs(y)


def mul_moduli(X: Any, x: Any, least: float) -> Any:
    """Return the sums of moduli sum_i |X_ki| (|x_i| + least)."""
    return np.abs(X) @ (np.abs(x) + least)


def exceeding(y: Any, bound: Any) -> int:
    """Return the number of constraints k with |y_k| > bound_k."""
    return int((np.abs(y) > bound).sum())


def multiplier(entries: Iterable[float]) -> Any:
    """Return the vector of these entries, one for each constraint."""
    return np.array(list(entries), REAL)


def sqrt(x: float) -> Any:
    """Return the square root; NaN of a negative number."""
    return np.sqrt(REAL(x))


def identity_d(q: Any) -> Any:
    """Return the identity of the size of q."""
    return np.eye(len(q), dtype=REAL)


def zero(q: Any) -> Any:
    """Return a multiplier of zeros, one for each constraint."""
    return np.zeros(CONSTRAINTS, REAL)
