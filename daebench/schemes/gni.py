"""Geometric nonholonomic integrator: a step of Störmer and Verlet, and at its end a reflection of the velocities that are not allowed."""

from typing import Any

from daebench.schemes.kernels.claims import Claims, Member
from daebench.schemes.kernels.constrain import momentum_correction
from daebench.schemes.kernels.language import (
    CONSTRAINTS,
    ON_VELOCITIES,
    SEPARABLE,
    A,
    G,
    H_p,
    H_pp,
    H_pq,
    H_q,
    H_qp,
    f,
    g,
    norm,
    rows,
    solve,
    zero,
)
from daebench.schemes.kernels.newton import both, linear, newton
from daebench.schemes.kernels.spaces import LENGTH, Gram, I, Multiplier, Number, Report, Rows, Update, Vector

CLAIMS = Claims(
    order=2,
    symmetric=False,
    symplectic=False,
    keeps_g=True,
    keeps_Gv=True,
    system="constrained",
    source="Ferraro, Iglesias and Martín de Diego, Nonlinearity 21 (2008) 1911-1928",
    nonholonomic=True,
)
MEMBERS = {"gni": Member(claims=CLAIMS, multipliers=lambda: {"lam_n": 1.0})}


def split(p: Vector, q: Vector) -> tuple[Rows, Gram]:
    """Return G with rows of 0 for constraints on velocities, and A M^-1 A^T, which lets a multiplier of theirs stay as it is."""
    A0 = A(q)
    return G(q) - A0, A0 @ rows(A0, p, q).T


if SEPARABLE and ON_VELOCITIES == CONSTRAINTS:

    def half_step(p0: Vector, q0: Vector, n0: Vector, h: Number) -> tuple[Vector, Vector, Report]:
        """Return p_half - p0, q1 - q0, and a report: no position is forbidden."""
        kick = -h / 2 * H_q(p0, q0) - n0
        return kick, h * H_p(p0 + kick, q0), linear(1.0, norm(kick))

elif SEPARABLE:

    def update(x: tuple[Vector, Multiplier], data: tuple[Vector, Rows, Gram]) -> Update:
        """One Newton update for g(q0 + dq - V^T nu) = 0."""
        dq, nu = x
        q0, V, apart = data
        q = q0 + dq
        value = g(q)
        change, pivot = solve((G(q) - A(q)) @ V.T + apart, value)
        back = V.T @ change
        return (dq - back, nu + change), norm(back), max(LENGTH, norm(q)), norm(value), pivot

    def half_step(p0: Vector, q0: Vector, n0: Vector, h: Number) -> tuple[Vector, Vector, Report]:
        """Return p_half - p0, q1 - q0, and a report."""
        on_positions, apart = split(p0, q0)
        kick = -h / 2 * H_q(p0, q0) - n0
        begin = (h * H_p(p0 + kick, q0), zero(q0))
        (dq, nu), report = newton(update, begin, (q0, rows(on_positions, p0, q0), apart))
        return kick - on_positions.T @ nu / h, dq, report

else:

    def update(x: tuple[Vector, Vector, Multiplier], data: tuple[Vector, Vector, Vector, Rows, Gram, Number]) -> Update:  # type: ignore[misc]
        """One Newton update of p_half - p0, q1 - q0 and nu, as that of RATTLE."""
        dp, dq, nu = x
        p0, q0, n0, on_positions, apart, half = data
        p, q = p0 + dp, q0 + dq
        r_p = dp + half * H_q(p, q0) + n0 + on_positions.T @ nu
        r_q = dq - half * (H_p(p, q) + H_p(p, q0))
        value, J = g(q), G(q) - A(q)
        by_p, P, pivot_p = solve(I + half * H_qp(p, q0), r_p, on_positions)
        S = H_pp(p, q) + H_pp(p, q0)
        by_q, Q, pivot_q = solve(I - half * H_pq(p, q), r_q + half * S @ by_p, half * P @ S.T)
        change, pivot = solve(J @ Q.T + apart, J @ by_q - value)
        back_p, back_q = by_p - P.T @ change, by_q - Q.T @ change
        size, residual = norm(back_q) + abs(half) * norm(S @ back_p), norm(r_p) + norm(r_q) + norm(value)
        return (dp - back_p, dq - back_q, nu - change), size, max(LENGTH, norm(q)), residual, min(pivot, min(pivot_p, pivot_q))

    def half_step(p0: Vector, q0: Vector, n0: Vector, h: Number) -> tuple[Vector, Vector, Report]:
        """Return p_half - p0, q1 - q0, and a report."""
        begin = (0 * p0, h * H_p(p0, q0), zero(q0))
        (dp, dq, _), report = newton(update, begin, (p0, q0, n0, *split(p0, q0), h / 2))
        return dp, dq, report


def start(p0: Vector, q0: Vector, h: Number) -> tuple[Vector, Report]:
    """Return h/2 A^T lam at the start, with the multiplier of (1.18), and a report."""
    G0 = G(q0)
    V = rows(G0, p0, q0)
    force = -f(p0, q0)[0] - H_q(p0, q0)
    lam, pivot = solve(G0 @ V.T, V @ force)
    return h / 2 * A(q0).T @ lam, linear(pivot, norm(force))


def step(p0: Vector, q0: Vector, n0: Vector, h: Number) -> Any:
    """Return p1, q1, h/2 A(q1)^T lam1, lam1 and a report; the memory is the force at q0, which acts in the steps before and after it.

    ::

        p_half = p0 - h/2 (H_q(p_half, q0) + A(q0)^T lam0) - G(q0)^T nu
        q1     = q0 + h/2 (H_p(p_half, q0) + H_p(p_half, q1)),               0 = g(q1)
        p1     = p_half - h/2 (H_q(p_half, q1) + A(q1)^T lam1) - G(q1)^T mu,    0 = A(q1) H_p(p1, q1),    0 = G(q1) H_p(p1, q1)

    with G of g alone, and nu and mu as in RATTLE. Without g, for constant M, q1 - q0 = h v1 and A(q1) (v1 + v2) = 0: the constraint holds
    for the mean of the velocities before and after a position, whose momentum is p1. The map of (p, q, lam) is symmetric; that of (p, q),
    which begins with lam of (1.18), is not.
    """
    dp, dq, moved = half_step(p0, q0, n0, h)
    q1 = q0 + dq
    end = dp - h / 2 * H_q(p0 + dp, q1)
    n, mu, settled = momentum_correction(p0 + end, q1)
    return p0 + (end - n), q1, A(q1).T @ mu, (2 / h * mu,), both(moved, settled)
