"""Radau IIA on the formulation of Gear, Gupta and Leimkuhler, which keeps g = 0 and G H_p = 0 both by a multiplier of its own."""

from functools import partial
from typing import Any

from daebench.claims import Claims, Member
from daebench.kernels.hole import (
    DATA,
    LENGTH,
    STAGES,
    Multiplier,
    Number,
    Report,
    Vector,
    axpy,
    axpy_m,
    g,
    gram,
    gram_full,
    mul,
    mul_full,
    mul_T,
    norm,
    norm_m,
    scale_mm,
    solve_stages_twice,
    zero_m,
)
from daebench.kernels.newton import newton
from daebench.kernels.radau import begin, held, moved, nodes, numbers, size_of, velocity_matrix
from daebench.kernels.stages import weighted


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


def matrix(h: Number, J: Any, R: Any, C: Any) -> Any:
    """Return minus the derivative of (G H_p, g) at the stages with respect to (Lam, mu), as 2 s rows of blocks of shape(m, m)."""
    A, square = DATA[0], DATA[1]
    by_Lam = velocity_matrix(h, J, R, C)
    upper = tuple(by_Lam[i] + tuple(scale_mm(h * A[i][j], gram_full(C[i], J[j])) for j in range(STAGES)) for i in range(STAGES))
    lower = tuple(
        tuple(scale_mm(h * h * square[i][j], gram(J[i], R[j])) for j in range(STAGES))
        + tuple(scale_mm(h * A[i][j], gram(J[i], J[j])) for j in range(STAGES))
        for i in range(STAGES)
    )
    return upper + lower


def shifted(h: Number, free: Any, J: Any, mu: tuple[Multiplier, ...]) -> tuple[Vector, ...]:
    """Return positions moved by -h sum_j a_ij G_j^T mu_j."""
    back = tuple(mul_T(J[j], mu[j]) for j in range(STAGES))
    return tuple(axpy(1.0, weighted(-h, DATA[0][i], back), free[i]) for i in range(STAGES))


def improve(x: Any, data: tuple[Vector, Vector, Number]) -> Any:
    """One sweep for P_i - p0, Q_i - q0, Lam_i and mu_i: Newton's but for second derivatives and that of H_p with respect to q."""
    dP, dQ, Lam, mu = x
    p0, q0, h = data
    Q, free_P, V, S, J, R, C, scale_v = held(p0, q0, dP, dQ, Lam, h)
    free_Q = shifted(h, tuple(weighted(h, DATA[0][i], V) for i in range(STAGES)), J, mu)
    drift = tuple(axpy(-1.0, dQ[i], free_Q[i]) for i in range(STAGES))
    value_v = tuple(axpy_m(1.0, mul(J[i], V[i]), mul_full(C[i], drift[i])) for i in range(STAGES))
    value_g = tuple(axpy_m(1.0, g(Q[i]), mul(J[i], drift[i])) for i in range(STAGES))
    change, pivot = solve_stages_twice(matrix(h, J, R, C), value_v + value_g)
    P1, Q1 = moved(h, free_P, free_Q, J, R, change)
    Q1 = shifted(h, Q1, J, tuple(change[STAGES + i] for i in range(STAGES)))
    scale_q = max(LENGTH, norm(Q[STAGES - 1]))
    size = size_of(S, dP, dQ, P1, Q1, scale_v, scale_q)
    residual = sum(norm_m(value_v[i]) + norm_m(value_g[i]) for i in range(STAGES))
    Lam = tuple(axpy_m(1.0, change[i], Lam[i]) for i in range(STAGES))
    mu = tuple(axpy_m(1.0, change[STAGES + i], mu[i]) for i in range(STAGES))
    return (P1, Q1, Lam, mu), size, scale_v * scale_q, residual, pivot


def increment(p0: Vector, q0: Vector, h: Number) -> tuple[Vector, Vector, Any, Report]:
    """Return p1 - p0, q1 - q0, the multipliers Lam_1 ... Lam_s and mu_1 ... mu_s, and a report.

    ::

        Q_i = q0 + h sum_j a_ij (H_p(P_j, Q_j) - G(Q_j)^T mu_j),                   0 = g(Q_i)
        P_i = p0 - h sum_j a_ij (H_q(P_j, Q_j) + G(Q_j)^T Lam_j),                  0 = G(Q_i) H_p(P_i, Q_i)
        p1  = P_s,     q1 = Q_s
    """
    dP, dQ = begin(p0, q0, h)
    none = tuple(zero_m(q0) for i in range(STAGES))
    (dP, dQ, Lam, mu), report = newton(improve, (dP, dQ, none, none), (p0, q0, h))
    return dP[STAGES - 1], dQ[STAGES - 1], Lam + mu, report
