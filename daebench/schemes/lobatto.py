"""Lobatto IIIA-IIIB, the partitioned Runge-Kutta form of the collocation HLW (1.27)-(1.30): symmetric, symplectic, of order 2s-2."""

from functools import partial
from typing import Any

from daebench.schemes.kernels.claims import Claims, Member
from daebench.schemes.kernels.constrain import momentum_correction
from daebench.schemes.kernels.language import STAGES, G, H_q
from daebench.schemes.kernels.lobatto_stages import forces, jacobians, positions, stages
from daebench.schemes.kernels.newton import both
from daebench.schemes.kernels.spaces import DATA, Number, Step, Vector
from daebench.schemes.kernels.stages import weighted_but_last


def numbers(s: int) -> tuple[Any, ...]:
    """Return A of IIIA, A^ of IIIB, A A^ with row i divided by c_i, b and c; the product is rounded once."""
    # Not at the top of the file: what is imported there belongs to the step, and is read by the compiler.
    from daebench.schemes.kernels.tableaux import lobatto_iiia, lobatto_iiib

    A, A_hat, c = lobatto_iiia(s, 40).A, lobatto_iiib(s, 40).A, lobatto_iiia(s, 40).c
    mean = [tuple(float(sum(A[i][j] * A_hat[j][k] for j in range(s)) / c[i]) for k in range(s)) for i in range(1, s)]
    iiia = lobatto_iiia(s)
    # Row 1 of A is zero, and so is c_1, by which it would be divided.
    return iiia.A, lobatto_iiib(s).A, ((0.0,) * s, *mean), iiia.b, iiia.c


def multipliers(s: int) -> dict[str, float]:
    """Return the names and nodes of the stages' multipliers; those of two stages are RATTLE's."""
    from daebench.schemes.kernels.tableaux import lobatto_iiia

    names = ("lam_n", "mu_n") if s == 2 else tuple(f"Lam_{i + 1}" for i in range(s))
    return dict(zip(names, lobatto_iiia(s).c, strict=True))


def _member(s: int) -> Member:
    claims = Claims(
        order=2 * s - 2,
        symmetric=True,
        symplectic=True,
        keeps_g=True,
        keeps_Gv=True,
        system="constrained",
        source="HLW VII.1.5, the Runge-Kutta form of (1.27)-(1.30); Jay (1996)",
    )
    return Member(claims=claims, stages=s, numbers=partial(numbers, s), multipliers=partial(multipliers, s), simplified=s > 2)


MEMBERS = {f"lobatto{s}": _member(s) for s in range(2, 7)}


def increment(p0: Vector, q0: Vector, h: Number) -> Step:
    """Return p1 - p0, q1 - q0, the multipliers Lam_1 ... Lam_s, and a report.

    ::

        Q_i = q0 + h sum_j a_ij H_p(P_j, Q_j)                                    A of IIIA
        P_i = p0 - h sum_j a^_ij (H_q(P_j, Q_j) + G(Q_j)^T Lam_j)                A^ of IIIB
        0   = g(Q_i),     q1 = Q_s
        p1  = p0 - h sum_j b_j (H_q(P_j, Q_j) + G(Q_j)^T Lam_j),                 0 = G(q1) H_p(p1, q1)

    Q_1 = q0, and Lam_s enters only p1.
    """
    P, dQ, Lam, stage_report = stages(p0, q0, h)
    Q, b = positions(q0, dQ), DATA[3]
    last = -h * b[STAGES - 1] * H_q(P[STAGES - 1], Q[STAGES - 1])
    dp = weighted_but_last(last, -h, b, forces(P, Q, jacobians(G(q0), Q), Lam))
    n, mu, settled = momentum_correction(p0 + dp, Q[STAGES - 1])
    return dp - n, dQ[STAGES - 2], (*Lam, mu / (h * b[STAGES - 1])), both(stage_report, settled)
