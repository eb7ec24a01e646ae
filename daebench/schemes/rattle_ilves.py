"""RATTLE with ILVES: Newton's iteration on all constraints at once, ended by a tolerance as in molecular dynamics."""

from dataclasses import replace

from daebench.schemes.kernels.branch import on_branch, reach
from daebench.schemes.kernels.claims import Member
from daebench.schemes.kernels.constrain import momentum_correction, tangential
from daebench.schemes.kernels.language import G, exceeding, g, norm, solve
from daebench.schemes.kernels.newton import both
from daebench.schemes.kernels.rattle_step import APPROXIMATE, CHOICES, choices, rattle_step
from daebench.schemes.kernels.relax import position_bounds, require_tolerance, until_met
from daebench.schemes.kernels.spaces import DATA, Jacobian, Multiplier, Number, Report, Rows, Step, Vector

CLAIMS = replace(APPROXIMATE, source="López-Villellas, Mikkelsen and others, arXiv 2503.13075 (2025); HLW (1.25)")
MEMBERS = {
    "rattle_ilves": Member(
        claims=CLAIMS,
        numbers=lambda tolerance, **chosen: (*choices(**chosen), require_tolerance(tolerance)),
        options={"tolerance": 1e-8, **CHOICES},
        multipliers=lambda: {"lam_n": 0.0, "mu_n": 1.0},
    ),
}


def update_positions(
    x: tuple[Vector, Multiplier], data: tuple[Vector, Rows, Multiplier]
) -> tuple[tuple[Vector, Multiplier], Number, Number, Number]:
    """One Newton update for g(q0 + dq - V^T nu) = 0; also return how many constraints do not hold before it."""
    dq, nu = x
    q0, V, bound = data
    q = q0 + dq
    value = g(q)
    change, pivot = solve(G(q) @ V.T, value)
    return (dq - V.T @ change, nu + change), exceeding(value, bound), norm(value), pivot


def solve_positions(p0: Vector, q0: Vector, dq: Vector, G0: Jacobian, V: Rows) -> tuple[Vector, Multiplier, Report]:
    """Return dq - V^T nu on g = 0 within the tolerance, nu and a report."""
    tangent, nu0, start_report = tangential(dq, G0, V)
    (dq, nu), report = until_met(update_positions, (tangent, nu0), (q0, V, position_bounds(G0, q0 + tangent)))
    return dq, nu, on_branch(q0, G0, V, tangent, dq, nu - nu0, both(start_report, report), reach(q0, DATA[2]))


def increment(p0: Vector, q0: Vector, h: Number) -> Step:
    """Return p1 - p0, q1 - q0, lam and mu, and a report.

    The step is :func:`daebench.schemes.kernels.rattle_step.rattle_step`. Positions are those of Newton's iteration on the whole system,
    the first that are within the tolerance; momenta are projected by one linear solve::

        nu -> nu + (G(q) V^T)^-1 g(q),      q = q0 + dq - V^T nu,      V = G(q0) M^-1
        |g_k(q)| <= sum_i |G_ki(q0)| (tolerance |q_i| + 4 eps L)

    It is the iteration of ``rattle`` with another stopping criterion: there the increment of q is at round-off, here the residual is within
    the tolerance of ``rattle_gauss_seidel``, apart from rounding, in which the length L of the initial value problem replaces the size of
    all positions. Each iteration squares the error, so the remaining error is mostly far below the tolerance.
    On a long chain the matrix G(q) V^T is banded. It is eliminated along the chain, as in ``rattle`` and by the same code, at a cost linear
    in the number of links. For few constraints the full matrix is eliminated.
    """
    return rattle_step(solve_positions, momentum_correction, p0, q0, h)
