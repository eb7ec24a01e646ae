"""The modified Hamiltonian along a discrete orbit, from differences of positions and of the action of each step."""

from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from daebench.errors import BadInput
from daebench.runs.ivp import Array

HIGHEST = 24
"""Highest order: weights of differences are sums of ever larger numbers beyond."""


@cache
def central_weights(order: int) -> tuple[float, ...]:
    """Return w_1, ..., w_k of the central difference of an even order 2k: x' = sum_j w_j (x(jh) - x(-jh)) / h, up to h^order.

    ::

        w_j = (-1)^(j+1) (k!)^2 / (j (k - j)! (k + j)!)

    It is the derivative of the polynomial through 2k + 1 equidistant points at the middle one.
    """
    if order < 2 or order % 2 or order > HIGHEST:
        raise BadInput(f"the order of a shadow Hamiltonian is an even number from 2 to {HIGHEST}, not {order}.", "shadow-order-not-even")
    k, weights, ratio = order // 2, [], 1.0
    for j in range(1, k + 1):
        ratio *= (k - j + 1) / (k + j)
        weights.append((-1) ** (j + 1) * ratio / j)
    return tuple(weights)


def shadow_hamiltonian(p: ArrayLike, q: ArrayLike, actions: ArrayLike, h: float, order: int) -> Array:
    """Return the modified Hamiltonian of a symplectic scheme along its orbit, up to an error of O(h^order).

    ::

        H~_n = p_n^T D q_n - D W_n,          W_(n+1) - W_n = S_n

    D is the central difference of the order, and S_n the action of a step, the function with p1 dq1 - p0 dq0 = dS on the tangents of the
    manifold. The orbit lies on solutions of a system with the Hamiltonian H~, along which W' = p^T q' - H~: what is left is the error of D.

    Parameters
    ----------
    p, q : array_like, shape(n + 1, d)
        States after 0, 1, ..., n steps.
    actions : array_like, shape(n,)
        Actions of the steps, J s.
    h : float
        Step size, s.
    order : int
        Even; 2 to 24.

    Returns
    -------
    ndarray, shape(n + 1 - order,)
        J; at the states order/2, ..., n - order/2, because only these have differences on both sides.

    Raises
    ------
    BadInput
        If the order is not valid, or there are too few states.

    Notes
    -----
    Differences are formed of the steps and not of the positions, so that rounding is relative to eps |q| |p| / h and does not grow with n.
    Constraints need nothing of their own: on the manifold the scheme is the flow of a constrained system with the Hamiltonian H~, HLW
    IX.5, and p^T dq is the one-form there. Skeel and Hardy (2001) have the same number by a variable that is carried along, whose
    increments are 2 S_n less the change of p^T q.

    Examples
    --------
    A circle of period 2 pi is the flow of (p^2 + q^2) / 2, here 1/2:

    >>> import numpy as np
    >>> h = 0.1
    >>> t = h * np.arange(11)
    >>> p, q = -np.sin(t)[:, None], np.cos(t)[:, None]
    >>> actions = np.diff(p[:, 0] * q[:, 0]) / 2
    >>> float(abs(shadow_hamiltonian(p, q, actions, h, 8) - 0.5).max()) < 1e-8
    True
    """
    p, steps, actions = np.asarray(p, dtype=float), np.diff(np.asarray(q, dtype=float), axis=0), np.asarray(actions, dtype=float)
    weights = central_weights(order)
    half, n = order // 2, len(steps)
    if n < order:
        raise BadInput(
            f"a shadow Hamiltonian of order {order} takes at least {order} steps, and there are {n}.", "too-few-steps-for-shadow"
        )
    middle = p[half : n + 1 - half]
    total = np.zeros(len(middle))
    for m in range(-half, half):
        # A difference over 2 j steps is the sum of these steps, so that step m has the weights of all differences that contain it.
        weight = sum(weights[max(-m, m + 1) - 1 :])
        window = slice(half + m, half + m + len(middle))
        total += weight * (np.sum(middle * steps[window], axis=1) - actions[window])
    return total / h
