"""The two projections that constrained schemes share: positions onto g = 0, momenta onto G H_p = 0."""

from typing import Any

from daebench.kernels.hole import (
    LENGTH,
    QUADRATIC,
    G,
    H_p,
    Matrix,
    Multiplier,
    Report,
    Vector,
    axpy,
    axpy_m,
    g,
    gram,
    mul,
    mul_full_T,
    mul_T,
    norm,
    norm_m,
    rows,
    scale,
    solve,
    zero_m,
)
from daebench.kernels.newton import linear, newton


def improve_reach(x: tuple[Vector, Multiplier], data: tuple[Vector, Matrix]) -> Any:
    """One Newton sweep for g(q0 + dq - V^T nu) = 0; the iteration matrix G(q) V^T is exact."""
    dq, nu = x
    q0, V = data
    q = axpy(1.0, dq, q0)
    value = g(q)
    change, pivot = solve(gram(G(q), V), value)
    back = mul_full_T(V, change)
    return (axpy(-1.0, back, dq), axpy_m(1.0, change, nu)), norm(back), max(LENGTH, norm(q)), norm_m(value), pivot


def reach(q0: Vector, dq: Vector, V: Matrix) -> tuple[Vector, Multiplier, Report]:
    """Return dq - V^T nu with g(q0 + dq - V^T nu) = 0, nu and a report, for V of shape(m, d).

    It is the increment that is iterated, so that rounding is relative to it and not to q0.
    """
    (dq, nu), report = newton(improve_reach, (dq, zero_m(q0)), (q0, V))
    return dq, nu, report


if QUADRATIC:

    def normal(p: Vector, q: Vector) -> tuple[Vector, Multiplier, Report]:
        """Return n = G(q)^T mu such that G(q) H_p(p - n, q) = 0, mu and a report, HLW (1.20): linear in mu."""
        G1 = G(q)
        value = mul(G1, H_p(p, q))
        mu, pivot = solve(gram(G1, rows(G1, p, q)), value)
        return mul_T(G1, mu), mu, linear(pivot, norm_m(value))

else:

    def improve_normal(x: tuple[Vector, Multiplier], data: tuple[Vector, Vector, Matrix]) -> Any:
        """One Newton sweep for G(q) H_p(p - n, q) = 0 with n = G(q)^T mu."""
        n, mu = x
        p0, q, G1 = data
        p = axpy(-1.0, n, p0)
        value = mul(G1, H_p(p, q))
        change, pivot = solve(gram(G1, rows(G1, p, q)), value)
        more = mul_T(G1, change)
        return (axpy(1.0, more, n), axpy_m(1.0, change, mu)), norm(more), norm(p), norm_m(value), pivot

    def normal(p: Vector, q: Vector) -> tuple[Vector, Multiplier, Report]:
        """Return n = G(q)^T mu such that G(q) H_p(p - n, q) = 0, mu and a report, HLW (1.20)."""
        (n, mu), report = newton(improve_normal, (scale(0.0, p), zero_m(q)), (p, q, G(q)))
        return n, mu, report


def tangent(p: Vector, q: Vector) -> tuple[Vector, Multiplier, Report]:
    """Return p - G(q)^T mu with G(q) H_p = 0, mu and a report, HLW (1.20)."""
    n, mu, report = normal(p, q)
    return axpy(-1.0, n, p), mu, report
