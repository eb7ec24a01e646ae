"""Symplectic Euler on the index-reduced ODE, HLW (1.18): the cautionary tale of Fig. 1.1."""

from typing import Any

from daebench.claims import Claims
from daebench.kernels.hole import (
    SEPARABLE,
    G,
    H_p,
    H_pp,
    H_q,
    H_qp,
    Matrix,
    Multiplier,
    Number,
    Report,
    Vector,
    a,
    a_p,
    apply,
    axpy,
    axpy_m,
    gram,
    gram_full,
    identity_plus,
    mul_full,
    mul_full_T,
    mul_T,
    norm,
    norm_m,
    plus_mm,
    rows,
    scale_md,
    solve,
    solve_dm,
    zero_m,
)
from daebench.kernels.newton import newton

CLAIMS = Claims(order=1, symmetric=False, symplectic=False, keeps_g=False, keeps_Gv=False, system="ode", source="HLW (1.18), Fig. 1.1 se")

if SEPARABLE:

    def respond(p: Vector, q: Vector, h: Number, r_p: Vector, by_lam: Matrix) -> Any:
        """Return r_p and by_lam: H_q does not depend on p."""
        return r_p, by_lam, 1.0

else:

    def respond(p: Vector, q: Vector, h: Number, r_p: Vector, by_lam: Matrix) -> Any:
        """Return (I + h H_qp)^-1 applied to r_p and to the rows of by_lam."""
        return solve_dm(identity_plus(h, H_qp(p, q)), r_p, by_lam)


def improve(x: tuple[Vector, Multiplier], data: tuple[Vector, Vector, Matrix, Number]) -> Any:
    """One Newton sweep for p1 and lam(p1, q0)."""
    p, lam = x
    p0, q0, G0, h = data
    force = axpy(1.0, mul_T(G0, lam), H_q(p, q0))
    r_p = axpy(h, force, axpy(-1.0, p0, p))
    value = a(p, q0, lam)
    a_by_p = a_p(p, q0, lam)
    by_p, P, pivot_p = respond(p, q0, h, r_p, scale_md(h, G0))
    matrix = plus_mm(gram_full(a_by_p, P), gram(G0, rows(G0, p, q0)))
    change, pivot = solve(matrix, axpy_m(-1.0, value, mul_full(a_by_p, by_p)))
    dp = axpy(-1.0, mul_full_T(P, change), by_p)
    by_mass = H_pp(p, q0)
    x = (axpy(-1.0, dp, p), axpy_m(-1.0, change, lam))
    scale_v = norm(apply(by_mass, p)) + abs(h) * norm(apply(by_mass, force))
    return x, norm(apply(by_mass, dp)), scale_v, norm(r_p) + norm_m(value), min(pivot, pivot_p)


def step(p0: Vector, q0: Vector, h: Number) -> tuple[Vector, Vector, Any, Report]:
    """Return p1, q1, no raw multipliers, and a report.

    ::

        p1 = p0 - h (H_q(p1, q0) + G(q0)^T lam(p1, q0)),     lam(p, q) from (1.12)
        q1 = q0 + h H_p(p1, q0)

    lam is evaluated in full, also off the manifold, where the solution soon is.
    """
    (p1, _), report = newton(improve, (p0, zero_m(q0)), (p0, q0, G(q0), h))
    return p1, axpy(h, H_p(p1, q0), q0), (), report
