"""Geometric nonholonomic integrator: a step of Störmer and Verlet, and at its end a reflection of the velocities that are not allowed."""

from typing import Any

from daebench.schemes.kernels.claims import Claims, Member
from daebench.schemes.kernels.constrain import momentum_correction
from daebench.schemes.kernels.language import CONSTRAINTS, ON_VELOCITIES, A, G, H_p, H_q, f, g, norm, rows, solve, zero
from daebench.schemes.kernels.newton import both, linear, newton
from daebench.schemes.kernels.spaces import LENGTH, Gram, Jacobian, Multiplier, Number, Report, Rows, Update, Vector

CLAIMS = Claims(
    order=2,
    symmetric=False,
    symplectic=False,
    keeps_g=True,
    keeps_Gv=True,
    system="constrained",
    source="Ferraro, Iglesias and Martín de Diego, Nonlinearity 21 (2008) 1911-1928",
    separable_only=True,
    nonholonomic=True,
)
MEMBERS = {"gni": Member(claims=CLAIMS, multipliers=lambda: {"lam_n": 1.0})}


def update(x: tuple[Vector, Multiplier], data: tuple[Vector, Rows, Gram]) -> Update:
    """One Newton update for g(q0 + dq - V^T nu) = 0; nu stays 0 for constraints on velocities, whose block of the matrix is apart."""
    dq, nu = x
    q0, V, apart = data
    q = q0 + dq
    value = g(q)
    change, pivot = solve((G(q) - A(q)) @ V.T + apart, value)
    back = V.T @ change
    return (dq - back, nu + change), norm(back), max(LENGTH, norm(q)), norm(value), pivot


if ON_VELOCITIES == CONSTRAINTS:

    def place(p: Vector, q0: Vector, dq: Vector, G0: Jacobian) -> tuple[Vector, Vector, Report]:
        """Return dq, no impulse, and a report: no position is forbidden."""
        return dq, 0 * p, linear(1.0, norm(dq))

else:

    def place(p: Vector, q0: Vector, dq: Vector, G0: Jacobian) -> tuple[Vector, Vector, Report]:
        """Return dq such that g(q0 + dq) = 0, h times the impulse that moves it there, and a report."""
        A0 = A(q0)
        on_positions = G0 - A0
        V = rows(on_positions, p, q0)
        (dq, nu), report = newton(update, (dq, zero(q0)), (q0, V, A0 @ rows(A0, p, q0).T))
        return dq, on_positions.T @ nu, report


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

        p_half = p0 - h/2 (U_q(q0) + A(q0)^T lam0) - G(q0)^T nu       q1 = q0 + h M^-1 p_half,      0 = g(q1)
        p1     = p_half - h/2 (U_q(q1) + A(q1)^T lam1) - G(q1)^T mu    0 = A(q1) M^-1 p1,            0 = G(q1) M^-1 p1

    with G of g alone, and nu and mu as in RATTLE. Without g, and in half steps, q1 - q0 = h v1 and A(q1) (v1 + v2) = 0: the constraint
    holds for the mean of the velocities before and after a position, which is p1. The map of (p, q, lam) is symmetric; that of (p, q),
    which begins with lam of (1.18), is not.
    """
    G0 = G(q0)
    kick = -h / 2 * H_q(p0, q0) - n0
    dq, pull, moved = place(p0, q0, h * H_p(p0 + kick, q0), G0)
    q1 = q0 + dq
    dp = kick - pull / h - h / 2 * H_q(p0, q1)
    n, mu, settled = momentum_correction(p0 + dp, q1)
    return p0 + (dp - n), q1, A(q1).T @ mu, (2 / h * mu,), both(moved, settled)
