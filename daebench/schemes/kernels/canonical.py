"""The right side in the coordinates Q = xi of a chart and their momenta P = (dq/dxi)^T p; P stands for p here, and Q for q."""

from daebench.schemes.kernels.language import L_q, M, impulse, placed, solve
from daebench.schemes.kernels.spaces import Number, Vector


def f(p: Vector, q: Vector) -> tuple[Vector, Vector, Number]:
    """Return P', Q' and the smallest relative pivot of X^T M X, which is singular if the chart is.

    ::

        L(Q, w) = 1/2 w^T X^T M X w - U        X = dq/dQ        dL/dw(Q, Q') = P        P' = dL/dQ + X^T F
    """
    velocity, pivot = rates(p, q)
    return L_q(q, velocity), velocity, pivot


def rates(p: Vector, q: Vector) -> tuple[Vector, Number]:
    """Return Q' and the smallest relative pivot of X^T M X."""
    return solve(M(q), impulse(p, q))


def chart(p: Vector, q: Vector) -> tuple[Vector, Vector]:
    """Return the state of the problem at P and Q, as momenta and positions."""
    velocity, _ = rates(p, q)
    return placed(q, velocity, p)
