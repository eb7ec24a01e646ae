"""Radau IIA on the formulation of index 2, with G H_p = 0 in place of g = 0, as in stiff solvers of order 3 and 5."""

from functools import partial

from daebench.schemes.kernels.claims import Claims, Member
from daebench.schemes.kernels.language import STAGES, norm, solve_stages, zero
from daebench.schemes.kernels.newton import newton
from daebench.schemes.kernels.radau import Multipliers, Points, first_guess, held, moved, nodes, numbers, size_of, velocity_matrix
from daebench.schemes.kernels.spaces import DATA, LENGTH, Number, Step, Update, Vector
from daebench.schemes.kernels.stages import weighted


def _member(s: int) -> Member:
    source = "HLW (1.9) with (1.11); Hairer, Wanner, Solving ODEs II, VII.4"
    claims = Claims(order=2 * s - 1, symmetric=False, symplectic=False, keeps_g=False, keeps_Gv=True, system="index2", source=source)
    return Member(claims=claims, stages=s, numbers=partial(numbers, s), multipliers=partial(nodes, s, "Lam"), simplified=True)


MEMBERS = {f"radau{s}_index2": _member(s) for s in (2, 3)}


def update(x: tuple[Points, Points, Multipliers], data: tuple[Vector, Vector, Number]) -> Update:
    """One update of P_i - p0, Q_i - q0 and Lam_i: Newton's without the derivatives of the forces, and of H_p with respect to q."""
    dP, dQ, Lam = x
    p0, q0, h = data
    Q, free_P, V, S, J, R, C, scale_v = held(p0, q0, dP, dQ, Lam, h)
    free_Q = tuple(weighted(h, DATA[0][i], V) for i in range(STAGES))
    value = tuple(C[i] @ (free_Q[i] - dQ[i]) + J[i] @ V[i] for i in range(STAGES))
    change, pivot = solve_stages(velocity_matrix(h, J, R, C), value)
    P1, Q1 = moved(h, free_P, free_Q, J, R, change)
    scale_q = max(LENGTH, norm(Q[STAGES - 1]))
    size = size_of(S, dP, dQ, P1, Q1, scale_v, scale_q)
    residual = sum(norm(value[i]) for i in range(STAGES))
    return (P1, Q1, tuple(Lam[i] + change[i] for i in range(STAGES))), size, scale_v * scale_q, residual, pivot


def increment(p0: Vector, q0: Vector, h: Number) -> Step:
    """Return p1 - p0, q1 - q0, the multipliers Lam_1 ... Lam_s, and a report.

    ::

        Q_i = q0 + h sum_j a_ij H_p(P_j, Q_j)
        P_i = p0 - h sum_j a_ij (H_q(P_j, Q_j) + G(Q_j)^T Lam_j),     0 = G(Q_i) H_p(P_i, Q_i)
        p1  = P_s,     q1 = Q_s
    """
    dP, dQ = first_guess(p0, q0, h)
    (dP, dQ, Lam), report = newton(update, (dP, dQ, tuple(zero(q0) for i in range(STAGES))), (p0, q0, h))
    return dP[STAGES - 1], dQ[STAGES - 1], Lam, report
