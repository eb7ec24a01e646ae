"""Radau IIA on the formulation of Gear, Gupta and Leimkuhler, which enforces both g = 0 and G H_p = 0, each by a separate multiplier."""

from functools import partial

from daebench.schemes.kernels.claims import Claims, Member
from daebench.schemes.kernels.in_time import but_for_time
from daebench.schemes.kernels.language import EXTENDED, STAGES, g, mass, norm, solve_2s, zero
from daebench.schemes.kernels.newton import newton
from daebench.schemes.kernels.radau import Blocks, Multipliers, Points, first_guess, held, moved, nodes, numbers, size_of, velocity_matrix
from daebench.schemes.kernels.spaces import DATA, LENGTH, Gram, Jacobian, Number, Rows, Step, Update, Vector
from daebench.schemes.kernels.stages import places, weighted


def _member(s: int) -> Member:
    source = "Gear, Gupta, Leimkuhler (1985); Hairer, Wanner, Solving ODEs II, VII.4"
    claims = Claims(order=2 * s - 1, symmetric=False, symplectic=False, keeps_g=True, keeps_Gv=True, system="ggl", source=source)
    return Member(
        claims=claims,
        stages=s,
        numbers=partial(numbers, s),
        multipliers=partial(nodes, s, "Lam", "mu"),
        vanishing=tuple(f"mu_{i + 1}" for i in range(s)),
        simplified=True,
    )


MEMBERS = {f"radau{s}_ggl": _member(s) for s in (2, 3)}


if EXTENDED:

    def velocity_by_mu(C: Rows, J: Jacobian, R: Rows, p: Vector, q: Vector) -> Gram:
        """Return C G^T without the time, on which mu does not act: R = G M^-1 has 0 there."""
        return C @ (R @ mass(p, q).T).T

    def position_by_mu(G1: Jacobian, J: Jacobian, R: Rows, p: Vector, q: Vector) -> Gram:
        """Return G1 G^T without the time."""
        return G1 @ (R @ mass(p, q).T).T

else:

    def velocity_by_mu(C: Rows, J: Jacobian, R: Rows, p: Vector, q: Vector) -> Gram:
        """Return C G^T."""
        return C @ J.T

    def position_by_mu(G1: Jacobian, J: Jacobian, R: Rows, p: Vector, q: Vector) -> Gram:
        """Return G1 G^T."""
        return G1 @ J.T


def matrix(h: Number, J: tuple[Jacobian, ...], R: tuple[Rows, ...], C: tuple[Rows, ...], P: Points, Q: Points) -> Blocks:
    """Return minus the derivative of (G H_p, g) at the stages with respect to (Lam, mu), as 2 s rows of blocks of shape(m, m)."""
    A, square = DATA[0], DATA[1]
    by_Lam = velocity_matrix(h, J, R, C)
    upper = tuple(
        by_Lam[i] + tuple(h * A[i][j] * velocity_by_mu(C[i], J[j], R[j], P[j], Q[j]) for j in range(STAGES)) for i in range(STAGES)
    )
    lower = tuple(
        tuple(h * h * square[i][j] * J[i] @ R[j].T for j in range(STAGES))
        + tuple(h * A[i][j] * position_by_mu(J[i], J[j], R[j], P[j], Q[j]) for j in range(STAGES))
        for i in range(STAGES)
    )
    return upper + lower


def shifted(h: Number, free: Points, J: tuple[Jacobian, ...], mu: Multipliers, Q: Points) -> Points:
    """Return positions moved by -h sum_j a_ij G_j^T mu_j, except for the time."""
    back = tuple(but_for_time(J[j].T @ mu[j], Q[j]) for j in range(STAGES))
    return tuple(free[i] + weighted(-h, DATA[0][i], back) for i in range(STAGES))


def update(x: tuple[Points, Points, Multipliers, Multipliers], data: tuple[Vector, Vector, Number]) -> Update:
    """One update of P_i - p0, Q_i - q0, Lam_i and mu_i: Newton's without second derivatives and that of H_p with respect to q."""
    dP, dQ, Lam, mu = x
    p0, q0, h = data
    Q, free_P, V, S, J, R, C, scale_v = held(p0, q0, dP, dQ, Lam, h)
    free_Q = shifted(h, tuple(weighted(h, DATA[0][i], V) for i in range(STAGES)), J, mu, Q)
    drift = tuple(free_Q[i] - dQ[i] for i in range(STAGES))
    value_v = tuple(C[i] @ drift[i] + J[i] @ V[i] for i in range(STAGES))
    value_g = tuple(J[i] @ drift[i] + g(Q[i]) for i in range(STAGES))
    change, pivot = solve_2s(matrix(h, J, R, C, places(p0, free_P), Q), value_v + value_g)
    P1, Q1 = moved(h, free_P, free_Q, J, R, change)
    Q1 = shifted(h, Q1, J, tuple(change[STAGES + i] for i in range(STAGES)), Q)
    scale_q = max(LENGTH, norm(Q[STAGES - 1]))
    size = size_of(S, dP, dQ, P1, Q1, scale_v, scale_q)
    residual = sum(norm(value_v[i]) + norm(value_g[i]) for i in range(STAGES))
    Lam = tuple(Lam[i] + change[i] for i in range(STAGES))
    mu = tuple(mu[i] + change[STAGES + i] for i in range(STAGES))
    return (P1, Q1, Lam, mu), size, scale_v * scale_q, residual, pivot


def increment(p0: Vector, q0: Vector, h: Number) -> Step:
    """Return p1 - p0, q1 - q0, the multipliers Lam_1 ... Lam_s and mu_1 ... mu_s, and a report.

    ::

        Q_i = q0 + h sum_j a_ij (H_p(P_j, Q_j) - G(Q_j)^T mu_j),                   0 = g(Q_i)
        P_i = p0 - h sum_j a_ij (H_q(P_j, Q_j) + G(Q_j)^T Lam_j),                  0 = G(Q_i) H_p(P_i, Q_i)
        p1  = P_s,     q1 = Q_s
    """
    dP, dQ = first_guess(p0, q0, h)
    none = tuple(zero(q0) for i in range(STAGES))
    (dP, dQ, Lam, mu), report = newton(update, (dP, dQ, none, none), (p0, q0, h))
    return dP[STAGES - 1], dQ[STAGES - 1], Lam + mu, report
