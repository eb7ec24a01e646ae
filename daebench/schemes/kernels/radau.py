"""Common parts of Radau IIA on the formulations of index 2: the stages with fixed multipliers, and the matrices of the iteration."""

from typing import Any

from daebench.schemes.kernels.language import STAGES, G, Gv_q, H_p, H_pp, H_q, norm
from daebench.schemes.kernels.spaces import DATA, Gram, InverseMass, Jacobian, Multiplier, Number, Rows, Vector
from daebench.schemes.kernels.stages import places, weighted

Points = tuple[Vector, ...]
Multipliers = tuple[Multiplier, ...]
Blocks = tuple[tuple[Gram, ...], ...]
Held = tuple[Points, Points, Points, tuple[InverseMass, ...], tuple[Jacobian, ...], tuple[Rows, ...], tuple[Rows, ...], Number]


def numbers(s: int) -> tuple[Any, ...]:
    """Return A, A A and c of Radau IIA with s stages; the product is rounded once."""
    # Not at the top of the file: what is imported there belongs to the step, and is read by the compiler.
    from daebench.schemes.kernels.tableaux import radau_iia

    A, exact = radau_iia(s).A, radau_iia(s, 40).A
    square = tuple(tuple(float(sum(exact[i][j] * exact[j][k] for j in range(s))) for k in range(s)) for i in range(s))
    return A, square, radau_iia(s).c


def nodes(s: int, *kinds: str) -> dict[str, float]:
    """Return the names and nodes of the stage values of these kinds of multipliers."""
    from daebench.schemes.kernels.tableaux import radau_iia

    return {f"{kind}_{i + 1}": c for kind in kinds for i, c in enumerate(radau_iia(s).c)}


def first_guess(p0: Vector, q0: Vector, h: Number) -> tuple[Points, Points]:
    """Return the start of the iteration: P_i - p0 = 0 and Q_i - q0 on the tangent."""
    v0, still = H_p(p0, q0), 0 * p0
    return tuple(still for i in range(STAGES)), tuple(h * DATA[2][i] * v0 for i in range(STAGES))


def held(p0: Vector, q0: Vector, dP: Points, dQ: Points, Lam: Multipliers, h: Number) -> Held:
    """Return the quantities that follow from the forces at the stages with fixed multipliers.

    These are Q_i and the new P_i - p0; there the velocities, H_pp, G, G H_pp and d/dq[G H_p]; and the scale of velocities.
    """
    Q = places(q0, dQ)
    P = places(p0, dP)
    J = tuple(G(Q[i]) for i in range(STAGES))
    kick = tuple(H_q(P[i], Q[i]) + J[i].T @ Lam[i] for i in range(STAGES))
    free = tuple(weighted(-h, DATA[0][i], kick) for i in range(STAGES))
    P = places(p0, free)
    V = tuple(H_p(P[i], Q[i]) for i in range(STAGES))
    S = tuple(H_pp(P[i], Q[i]) for i in range(STAGES))
    R = tuple(J[i] @ S[i] for i in range(STAGES))
    C = tuple(Gv_q(P[i], Q[i]) for i in range(STAGES))
    # The forces' part of a step is added, because a motion that begins at rest has no velocity to compare with.
    scale_v = norm(V[STAGES - 1]) + abs(h) * norm(S[STAGES - 1] @ kick[STAGES - 1])
    return Q, free, V, S, J, R, C, scale_v


def velocity_matrix(h: Number, J: tuple[Jacobian, ...], R: tuple[Rows, ...], C: tuple[Rows, ...]) -> Blocks:
    """Return the derivative of G H_p at stage i with respect to minus Lam_j, by way of P_i and of Q_i, as blocks of shape(m, m)."""
    A, square = DATA[0], DATA[1]
    return tuple(tuple(h * A[i][j] * R[i] @ J[j].T + h * h * square[i][j] * C[i] @ R[j].T for j in range(STAGES)) for i in range(STAGES))


def moved(
    h: Number, free_P: Points, free_Q: Points, J: tuple[Jacobian, ...], R: tuple[Rows, ...], change: Multipliers
) -> tuple[Points, Points]:
    """Return P_i - p0 and Q_i - q0 after a change of the multipliers."""
    pull = tuple(J[j].T @ change[j] for j in range(STAGES))
    push = tuple(R[j].T @ change[j] for j in range(STAGES))
    dP = tuple(free_P[i] + weighted(-h, DATA[0][i], pull) for i in range(STAGES))
    return dP, tuple(free_Q[i] + weighted(-h * h, DATA[1][i], push) for i in range(STAGES))


def size_of(S: tuple[InverseMass, ...], dP: Points, dQ: Points, P: Points, Q: Points, scale_v: Number, scale_q: Number) -> Number:
    """Return the change of the stages, momenta as velocities over ``scale_v`` plus positions over ``scale_q``, times both scales."""
    by_v = sum(norm(S[i] @ (P[i] - dP[i])) for i in range(STAGES))
    return by_v * scale_q + sum(norm(Q[i] - dQ[i]) for i in range(STAGES)) * scale_v
