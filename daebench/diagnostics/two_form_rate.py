"""How fast the flow of the index-reduced equation changes the two-form, HLW (1.17)."""

import numpy as np
from numpy.typing import ArrayLike

from daebench.diagnostics.derivative import STEP
from daebench.runs.ivp import Array, ConstrainedIvp


def two_form_rate(ivp: ConstrainedIvp, p: ArrayLike, q: ArrayLike, X: ArrayLike) -> Array:
    """Return the rate at which the flow of (1.18) changes dq ^ dp on every two of some vectors, shape(k, k).

    ::

        d/dt (dq ^ dp) = - sum_i dg_i ^ dlam_i

        rate_ab = - sum_i ( dg_i(X_a) dlam_i(X_b) - dlam_i(X_a) dg_i(X_b) )

    The terms of H and those with g_qq cancel, because they are symmetric. It is zero on vectors along which g does not change, the tangents
    of g = const. Along the flow it stays zero if G H_p does not change along them either. On other vectors it is in general not zero.
    HLW (1.17) has the two-form dp ^ dq, and so the other sign.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem with its numbers.
    p, q : array_like, shape(d,)
        A state, on the manifold or off it; lam(p, q) is that of (1.12).
    X : array_like, shape(2d, k)
        Vectors at the state, momenta first.

    Returns
    -------
    ndarray, shape(k, k)
        Skew-symmetric. Derivatives of lam are taken by complex step, exact to rounding.

    Examples
    --------
    >>> import numpy as np
    >>> import daebench
    >>> from daebench.diagnostics.symplecticity import tangent_basis
    >>> ivp = daebench.initial_value_problem("spherical_pendulum", "fig1.1")
    >>> along = tangent_basis(ivp, ivp.p0, ivp.q0)
    >>> across = np.concatenate([np.zeros(3), ivp.q0])
    >>> bool(np.abs(two_form_rate(ivp, ivp.p0, ivp.q0, along)).max() < 1e-15)
    True
    >>> bool(np.abs(two_form_rate(ivp, ivp.p0, ivp.q0, np.column_stack([along, across]))).max() > 0.1)
    True
    """
    p, q, X = np.asarray(p, dtype=float), np.asarray(q, dtype=float), np.asarray(X, dtype=float)
    d = len(q)
    dg = ivp.value("G", tuple(q)) @ X[d:]
    dlam = np.stack([_directional(ivp, p, q, x[:d], x[d:]) for x in X.T], axis=1)
    product = dg.T @ dlam
    return np.asarray(product.T - product)


def _directional(ivp: ConstrainedIvp, p: Array, q: Array, dp: Array, dq: Array) -> Array:
    """Return the derivative of lam(p, q) in a direction, shape(m,)."""
    return np.asarray(np.imag(ivp.value("lam", tuple(p + 1j * STEP * dp), tuple(q + 1j * STEP * dq))) / STEP)
