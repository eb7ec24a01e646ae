"""Lagrange-d'Alembert SPARK methods of Jay with the coefficients of Lobatto IIIA-IIIB, of order 2s-2."""

from dataclasses import replace

from daebench.schemes.kernels.claims import Member
from daebench.schemes.kernels.spaces import Number, Step, Vector
from daebench.schemes.lobatto import MEMBERS as LOBATTO
from daebench.schemes.lobatto import increment as lobatto


def _member(s: int) -> Member:
    source = "Jay, SIAM J. Numer. Anal. 47 (2009); Jay, BIT 43 (2003) for the means of constraints"
    member = LOBATTO[f"lobatto{s}"]
    claims = replace(member.claims, symplectic=False, source=source, nonholonomic=True)
    return replace(member, claims=claims, simplified=True)


MEMBERS = {f"spark_lobatto{s}": _member(s) for s in range(2, 5)}


def increment(p0: Vector, q0: Vector, h: Number) -> Step:
    """Return p1 - p0, q1 - q0, the multipliers Lam_1 ... Lam_s, and a report.

    ::

        Q_i = q0 + h sum_j a_ij H_p(P_j, Q_j)                                    A of IIIA
        P_i = p0 - h sum_j a^_ij (H_q(P_j, Q_j) + G(Q_j)^T Lam_j)                A^ of IIIB
        0   = g(Q_i),     0 = sum_j a_ij A(Q_j) H_p(P_j, Q_j),      i = 2 ... s,     Q_1 = q0,     q1 = Q_s
        p1  = p0 - h sum_j b_j (H_q(P_j, Q_j) + G(Q_j)^T Lam_j),                 0 = G(q1) H_p(p1, q1)

    G has the rows of g_q and of A. Constraints on velocities hold at the end of a step. At its stages only their means over c_i h do, by
    the quadrature of IIIA: the values there are multiples of the Legendre polynomial of degree s-1.
    """
    return lobatto(p0, q0, h)
