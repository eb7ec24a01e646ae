"""RATTLE with the iteration of SHAKE, one constraint at a time until a tolerance is reached, as in molecular dynamics."""

from dataclasses import replace

from daebench.schemes.kernels.branch import on_branch, reach
from daebench.schemes.kernels.claims import Member
from daebench.schemes.kernels.constrain import tangential
from daebench.schemes.kernels.language import CONSTRAINTS, EPS, INF, G, H_p, dot, dot_moduli, g, multiplier, rows, zero
from daebench.schemes.kernels.newton import both
from daebench.schemes.kernels.rattle_step import APPROXIMATE, CHOICES, choices, rattle_step
from daebench.schemes.kernels.relax import bounds, relax, require_tolerance
from daebench.schemes.kernels.spaces import DATA, Jacobian, Multiplier, Number, Report, Rows, Step, Vector

Iterate = tuple[Vector, Multiplier]
Round = tuple[Iterate, Number, Number, Number]

CLAIMS = replace(APPROXIMATE, source="Ryckaert, Ciccotti and Berendsen, J. Comput. Phys. 23 (1977); Andersen, J. Comput. Phys. 52 (1983)")
MEMBERS = {
    "rattle_gauss_seidel": Member(
        claims=CLAIMS,
        numbers=lambda tolerance, **chosen: (*choices(**chosen), require_tolerance(tolerance)),
        options={"tolerance": 1e-8, **CHOICES},
        multipliers=lambda: {"lam_n": 0.0, "mu_n": 1.0},
    ),
}


def update_positions(x: Iterate, data: tuple[Vector, Rows, Multiplier]) -> Round:
    """One round for g(q0 + dq - V^T nu) = 0; each visit to a constraint counts as an evaluation of g and one of G."""
    dq, nu = x
    q0, V, bound = data
    unmet, residual, pivot = 0.0, 0.0, INF
    for k in range(CONSTRAINTS):
        # G and g at the position after the corrections before: this makes the iteration Gauss-Seidel's, and a round m evaluations.
        q = q0 + dq
        row, value = G(q)[k], g(q)[k]
        # A factor in place of a branch: a constraint that holds is left as it is, as SHAKE does.
        late = 1.0 if abs(value) > bound[k] else 0.0
        steep = dot(row, V[k])
        change = late * value / steep
        dq = dq - change * V[k]
        nu = multiplier(nu[j] + (change if j == k else 0.0) for j in range(CONSTRAINTS))
        unmet, residual, pivot = unmet + late, residual + abs(value), min(pivot, abs(steep) / dot_moduli(row, V[k]))
    return (dq, nu), unmet, residual, pivot


def update_velocities(x: Iterate, data: tuple[Jacobian, Rows, Multiplier]) -> Round:
    """One round for G1 (v - V^T mu) = 0."""
    v, mu = x
    G1, V, bound = data
    unmet, residual, pivot = 0.0, 0.0, INF
    for k in range(CONSTRAINTS):
        value = dot(G1[k], v)
        late = 1.0 if abs(value) > max(bound[k], max(DATA[2], 4.0 * EPS) * dot_moduli(G1[k], v)) else 0.0
        steep = dot(G1[k], V[k])
        change = late * value / steep
        v = v - change * V[k]
        mu = multiplier(mu[j] + (change if j == k else 0.0) for j in range(CONSTRAINTS))
        unmet, residual, pivot = unmet + late, residual + abs(value), min(pivot, abs(steep) / dot_moduli(G1[k], V[k]))
    return (v, mu), unmet, residual, pivot


def bent(q: Vector, G0: Jacobian, V: Rows, nu: Multiplier) -> Number:
    """Return 1 if nu^T G(q) V^T nu, at the end q of the free flight, is not within half of nu^T G0 V^T nu, and 0 if it is."""
    b = V.T @ nu
    straight, turned = dot(G0.T @ nu, b), dot(G(q).T @ nu, b)
    return 1.0 if abs(turned - straight) > abs(straight) / 2 else 0.0


def solve_positions(p0: Vector, q0: Vector, dq: Vector, G0: Jacobian, V: Rows) -> tuple[Vector, Multiplier, Report]:
    """Return dq - V^T nu on g = 0 within the tolerance, nu and a report."""
    tangent, nu0, start_report = tangential(dq, G0, V)
    nu = bent(q0 + dq, G0, V, nu0) * nu0
    start = dq - V.T @ nu
    (dq, nu), report = relax(update_positions, (start, nu), (q0, V, bounds(G0, q0 + start)))
    return dq, nu, on_branch(q0, G0, V, tangent, dq, nu - nu0, both(start_report, report), reach(q0, DATA[2]))


def solve_momenta(p: Vector, q: Vector) -> tuple[Vector, Multiplier, Report]:
    """Return n = G(q)^T mu such that G M^-1 (p - n) = 0 within the tolerance, mu and a report."""
    G1, v = G(q), H_p(p, q)
    (_, mu), report = relax(update_velocities, (v, zero(q)), (G1, rows(G1, p, q), bounds(G1, v)))
    return G1.T @ mu, mu, report


def increment(p0: Vector, q0: Vector, h: Number) -> Step:
    """Return p1 - p0, q1 - q0, lam and mu, and a report.

    The step is :func:`daebench.schemes.kernels.rattle_step.rattle_step`. Both sets of constraints are visited one after another, k = 1,
    ..., m, and corrected one by one, until all are met at once::

        q -> q - V_k^T g_k(q) / (G_k(q) V_k^T),                V = G(q0) M^-1,     |g_k(q)|    <= tolerance sum_i |G_ki(q0) q_i|
        v -> v - V_k^T (G_k(q1) v) / (G_k(q1) V_k^T),          V = G(q1) M^-1,     |G_k(q1) v| <= tolerance sum_i |G_ki(q1) v_i|

    with q and v on the right before any correction. The current v is used if this is less strict, because bodies that fall side by side
    have no terms to compare with at first. For a distance from the origin this is | |q|^2 - l^2 | <= 2 l^2 tolerance, as in molecular
    dynamics. Tolerances below 4 eps are refused.

    The iteration starts at the end of the free flight, as SHAKE does, and so leaves the residuals, and has the drift of the energy, of
    SHAKE. The start decides from which side residuals are approached: from where the linearised constraints put the step, the energy of
    rigid water changes 5 to 24 times as much at one tolerance, and that of butane and of a ring by a twentieth to nine tenths of it. The
    iteration starts there all the same where the free flight is so long that the constraints bend before its end, because it may end on
    another branch then.
    """
    return rattle_step(solve_positions, solve_momenta, p0, q0, h)
