"""The symplecticity defect of a map on the constraint manifold, exact to round-off where the map computes in complex numbers."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from daebench.diagnostics.derivative import STEP, Derivative, derivative
from daebench.diagnostics.manifold import constraint_jacobian
from daebench.runs.ivp import Array, ConstrainedIvp

Flow = Callable[[Any, Any], tuple[Sequence[Any], Sequence[Any]]]
"""A map (p, q) -> (p, q) of vectors of shape(d,), real or complex, that leaves its arguments unchanged."""

Path = Callable[[Any, Any], tuple[Any, str | None]]
"""A map from (p, q) to the rows (p, q) after 0, 1, 2, ... steps, and to the reason for an early end, or None."""


def tangent_basis(ivp: ConstrainedIvp, p: ArrayLike, q: ArrayLike) -> Array:
    """Return an orthonormal basis X of the tangent space of the manifold at (p, q), shape(2d, 2(d - m)).

    X spans the null space of the derivative of the constraints (g, G H_p) with respect to x = (p, q), momenta first::

        [ 0     G    ]
        [ Gv_p  Gv_q ] X = 0        X^T X = I

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem with its numbers.
    p, q : array_like, shape(d,)
        A point of the manifold.

    Returns
    -------
    ndarray, shape(2d, 2(d - m))
        With more columns where constraints are redundant, two for each that is.

    Examples
    --------
    >>> import daebench
    >>> ivp = daebench.initial_value_problem("spherical_pendulum", "fig1.2")
    >>> tangent_basis(ivp, ivp.p0, ivp.q0).shape
    (6, 4)
    """
    C = constraint_jacobian(ivp, np.array(p, dtype=float)[None], np.array(q, dtype=float)[None])[0]
    # Rows of length one, because g and G H_p have different units, and the rank must not depend on them.
    size = np.linalg.norm(C, axis=1, keepdims=True)
    _, singular, rows = np.linalg.svd(C / np.where(size > 0, size, 1.0))
    rank = int(np.sum(singular > 1e-12 * np.max(singular, initial=0.0)))
    return np.ascontiguousarray(rows[rank:].T)


def tangent_basis_at_one_time(ivp: ConstrainedIvp, p: ArrayLike, q: ArrayLike) -> Array:
    """Return an orthonormal basis of the tangent vectors of a system in time that leave the time, and p_t, as they are.

    A damping contracts the two-form dq ^ dp of the positions only. It does not contract dt ^ dp_t, which the vectors of
    :func:`tangent_basis` have as well.
    """
    C = constraint_jacobian(ivp, np.array(p, dtype=float)[None], np.array(q, dtype=float)[None])[0]
    d = ivp.d
    free = np.array([i for i in range(2 * d) if i not in (d - 1, 2 * d - 1)])
    X = np.zeros((2 * d, 2 * (d - 1) - np.linalg.matrix_rank(C[:, free])))
    _, _, rows = np.linalg.svd(C[:, free])
    X[free] = rows[len(rows) - X.shape[1] :].T
    return X


def tangent_map(flow: Flow, p: ArrayLike, q: ArrayLike, X: ArrayLike) -> Array:
    """Return Phi'(x) X, shape(2d, k): the value of :func:`linearisation`, which has the parameters."""
    return linearisation(flow, p, q, X).value


def linearisation(flow: Flow, p: ArrayLike, q: ArrayLike, X: ArrayLike) -> Derivative:
    """Return Phi'(x) X, the derivative of a map along the columns of X, by complex step or by differences, and its floor.

    ::

        Phi'(x) X_k = Im Phi(x + i s X_k) / s        s = 1e-30

    A complex step is believed where differences agree with it, see :func:`daebench.diagnostics.derivative.derivative`; where they do
    not, because the map drops imaginary parts, say, it is they that are returned, and a warning says how good they are.

    Parameters
    ----------
    flow : callable
        The map Phi, best analytic in its arguments and computed in complex numbers, with iterations inside it that converge in the
        imaginary part too: then the result is exact to round-off.
    p, q : array_like, shape(d,)
        The point x = (p, q).
    X : array_like, shape(2d, k)
        Directions, momenta first.

    Raises
    ------
    BadInput
        If neither gives a derivative.
    """
    p, q = np.asarray(p, dtype=float), np.asarray(q, dtype=float)
    d = len(p)

    def phi(x: NDArray[Any]) -> NDArray[Any]:
        return np.concatenate([np.asarray(part) for part in flow(x[:d], x[d:])])

    return derivative(phi, np.concatenate([p, q]), X, parts=2)


def tangent_path(path: Path, p: ArrayLike, q: ArrayLike, X: ArrayLike) -> tuple[Array, Array, str | None]:
    """Return the states of a run and the images of tangent vectors under its linearised steps, by complex step.

    Parameters
    ----------
    path : callable
        The map of a complex state to the states after 0, 1, 2, ... steps, and to the reason for an early end, or None.
    p, q, X
        As for :func:`tangent_map`.

    Returns
    -------
    x : ndarray, shape(n, 2d)
        The states (p, q), momenta first.
    X : ndarray, shape(n, 2d, k)
        The vectors carried along: X[0] is the X that was given.
    failure : str or None
        Why the run ended early; x and X go up to there.
    """
    p, q, X = np.asarray(p, dtype=float), np.asarray(q, dtype=float), np.asarray(X, dtype=float)
    d = len(p)
    runs = [path(p + 1j * STEP * tangent[:d], q + 1j * STEP * tangent[d:]) for tangent in X.T]
    shown = min(len(rows) for rows, _ in runs)
    carried = np.stack([np.imag(rows[:shown]) / STEP for rows, _ in runs], axis=-1)
    return np.real(runs[0][0][:shown]), carried, runs[0][1]


def areas(X: ArrayLike) -> Array:
    """Return the oriented areas of the projections of parallelograms onto the planes (q_i, p_i), shape(..., d).

    Their sum over i is the symplectic area dq ^ dp of a parallelogram, HLW VI.2, which a symplectic map keeps.

    Parameters
    ----------
    X : array_like, shape(..., 2d, 2)
        Its two sides as columns, momenta first.

    Examples
    --------
    >>> areas([[0.0, 0.0], [0.0, 2.0], [1.0, 0.0], [3.0, 0.0]]).tolist()
    [0.0, 6.0]
    """
    X = np.asarray(X, dtype=float)
    d = X.shape[-2] // 2
    p, q = X[..., :d, :], X[..., d:, :]
    return np.asarray(q[..., 0] * p[..., 1] - p[..., 0] * q[..., 1])


def symplecticity_defect(flow: Flow, p: ArrayLike, q: ArrayLike, X: ArrayLike) -> float:
    """Return the spectral norm of the change of the symplectic two-form under a map, on the span of X.

    ::

        | X^T ( Phi'^T J Phi' - J ) X |_2        J = [[0, I], [-I, 0]]

    Zero to round-off for a symplectic map of the manifold, HLW (1.16), when X is :func:`tangent_basis`. Take the map of several
    steps (10, say): a single step of a scheme that is not symplectic on the manifold may be exact there.

    Parameters
    ----------
    flow, p, q, X
        As for :func:`tangent_map`.

    Examples
    --------
    >>> def drift(p, q):
    ...     return p, q + 0.1 * p
    >>> def friction(p, q):
    ...     return 0.9 * p, q
    >>> symplecticity_defect(drift, [1.0], [0.0], [[1, 0], [0, 1]]) < 1e-15
    True
    >>> round(symplecticity_defect(friction, [1.0], [0.0], [[1, 0], [0, 1]]), 12)
    0.1
    """
    return two_form_change(tangent_map(flow, p, q, X), np.asarray(X, dtype=float))


def two_form_change(carried: Array, X: Array, left: float = 1.0) -> float:
    """Return the change of the two-form from vectors X to their images under a map, or the difference from the share of it that is left.

    The vectors have momenta first; the number is the spectral norm of the difference.
    """
    # The spectral norm does not depend on the orthonormal basis of the tangent space.
    return float(np.linalg.norm(_two_form(carried) - left * _two_form(X), 2))


def _two_form(X: Array) -> Array:
    """Return X^T J X, momenta first."""
    d = len(X) // 2
    half = X[:d].T @ X[d:]
    return half - half.T
