"""The two projections that constrained schemes share: positions onto g = 0, momenta onto G H_p = 0."""

from daebench.schemes.kernels.branch import floor, on_branch
from daebench.schemes.kernels.language import FREE, ONE_UNKNOWN, QUADRATIC, G, H_p, g, norm, rows, solve, zero
from daebench.schemes.kernels.newton import both, linear, newton, newton_of_one
from daebench.schemes.kernels.spaces import LENGTH, Jacobian, Multiplier, Report, Rows, Update, Vector


def update_position(x: tuple[Vector, Multiplier], data: tuple[Vector, Rows]) -> Update:
    """One Newton update for g(q0 + dq - V^T nu) = 0; the iteration matrix G(q) V^T is exact."""
    dq, nu = x
    q0, V = data
    q = q0 + dq
    value = g(q)
    change, pivot = solve(G(q) @ V.T, value)
    back = V.T @ change
    # LENGTH, because near the origin of its coordinates g = 0 leaves a position uncertain by more than eps |q|.
    return (dq - back, nu + change), norm(back), max(LENGTH, norm(q)), norm(value), pivot


def tangential(dq: Vector, G0: Jacobian, V: Rows) -> tuple[Vector, Multiplier, Report]:
    """Return dq - V^T nu with G0 (dq - V^T nu) = 0, nu and a report: where the linearised constraint puts the free flight dq."""
    value = G0 @ dq
    nu, pivot = solve(G0 @ V.T, value)
    return dq - V.T @ nu, nu, linear(pivot, norm(value))


def project_position(q0: Vector, dq: Vector, G0: Jacobian, V: Rows) -> tuple[Vector, Multiplier, Report]:
    """Return dq - V^T nu with g(q0 + dq - V^T nu) = 0, nu and a report, for G0 = G(q0) and V of shape(m, d).

    The iteration starts where the linearised constraint puts the step: forces that constraints balance make the free flight dq long, and
    from its end an iteration may reach another branch of g = 0. It is for the increment, so that rounding is relative to the increment and
    not to q0.
    """
    if FREE:  # known when the file is executed
        return tangential(dq, G0, V)
    tangent, nu0, start_report = tangential(dq, G0, V)
    if ONE_UNKNOWN:  # known when the file is executed
        (dq, nu), report = newton_of_one(update_position, (tangent, nu0), (q0, V))
    else:
        (dq, nu), report = newton(update_position, (tangent, nu0), (q0, V))
    return dq, nu, on_branch(q0, G0, V, tangent, dq, nu - nu0, both(start_report, report), floor(q0))


if FREE:

    def momentum_correction(p: Vector, q: Vector) -> tuple[Vector, Multiplier, Report]:
        """Return the zero that momenta without a constraint are corrected by, no mu and a report."""
        G1 = G(q)
        return tangential(0 * p, G1, rows(G1, p, q))

elif QUADRATIC:

    def momentum_correction(p: Vector, q: Vector) -> tuple[Vector, Multiplier, Report]:
        """Return n = G(q)^T mu such that G(q) H_p(p - n, q) = 0, mu and a report, HLW (1.20): linear in mu."""
        G1 = G(q)
        value = G1 @ H_p(p, q)
        mu, pivot = solve(G1 @ rows(G1, p, q).T, value)
        # The correction, not p - n: schemes add it to their increment first, so that p is rounded once in a step.
        return G1.T @ mu, mu, linear(pivot, norm(value))

else:

    def update_momentum(x: tuple[Vector, Multiplier], data: tuple[Vector, Vector, Jacobian]) -> Update:
        """One Newton update for G(q) H_p(p - n, q) = 0 with n = G(q)^T mu."""
        n, mu = x
        p0, q, G1 = data
        p = p0 - n
        value = G1 @ H_p(p, q)
        change, pivot = solve(G1 @ rows(G1, p, q).T, value)
        more = G1.T @ change
        return (n + more, mu + change), norm(more), norm(p), norm(value), pivot

    def momentum_correction(p: Vector, q: Vector) -> tuple[Vector, Multiplier, Report]:
        """Return n = G(q)^T mu such that G(q) H_p(p - n, q) = 0, mu and a report, HLW (1.20)."""
        (n, mu), report = newton(update_momentum, (0 * p, zero(q)), (p, q, G(q)))
        return n, mu, report


def project_momentum(p: Vector, q: Vector) -> tuple[Vector, Multiplier, Report]:
    """Return p - G(q)^T mu with G(q) H_p = 0, mu and a report, HLW (1.20)."""
    n, mu, report = momentum_correction(p, q)
    return p - n, mu, report
