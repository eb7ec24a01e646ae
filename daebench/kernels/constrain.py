"""The two projections that constrained schemes share: positions onto g = 0, momenta onto G H_p = 0."""

from typing import Any

from daebench.kernels.hole import (
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
    solve,
    zero_m,
)
from daebench.kernels.newton import linear, newton


def improve_onto(x: tuple[Vector, Multiplier], V: Matrix) -> Any:
    """One Newton sweep for g(q - V^T nu) = 0; the iteration matrix G(q) V^T is exact."""
    q, nu = x
    value = g(q)
    change, pivot = solve(gram(G(q), V), value)
    dq = mul_full_T(V, change)
    q = axpy(-1.0, dq, q)
    return (q, axpy_m(1.0, change, nu)), norm(dq), max(1.0, norm(q)), norm_m(value), pivot


def onto(q: Vector, V: Matrix) -> tuple[Vector, Multiplier, Report]:
    """Return q - V^T nu with g = 0, nu and a report, for V of shape(m, d)."""
    (q, nu), report = newton(improve_onto, (q, zero_m(q)), V)
    return q, nu, report


if QUADRATIC:

    def tangent(p: Vector, q: Vector) -> tuple[Vector, Multiplier, Report]:
        """Return p - G(q)^T mu with G(q) H_p = 0, mu and a report, HLW (1.20): linear in mu."""
        G1 = G(q)
        value = mul(G1, H_p(p, q))
        mu, pivot = solve(gram(G1, rows(G1, p, q)), value)
        return axpy(-1.0, mul_T(G1, mu), p), mu, linear(pivot, norm_m(value))

else:

    def improve_tangent(x: tuple[Vector, Multiplier], data: tuple[Vector, Matrix]) -> Any:
        """One Newton sweep for G(q) H_p(p - G(q)^T mu, q) = 0."""
        p, mu = x
        q, G1 = data
        value = mul(G1, H_p(p, q))
        change, pivot = solve(gram(G1, rows(G1, p, q)), value)
        dp = mul_T(G1, change)
        p = axpy(-1.0, dp, p)
        return (p, axpy_m(1.0, change, mu)), norm(dp), norm(p), norm_m(value), pivot

    def tangent(p: Vector, q: Vector) -> tuple[Vector, Multiplier, Report]:
        """Return p - G(q)^T mu with G(q) H_p = 0, mu and a report, HLW (1.20)."""
        (p, mu), report = newton(improve_tangent, (p, zero_m(q)), (q, G(q)))
        return p, mu, report
