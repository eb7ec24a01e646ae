"""RATTLE with the iteration of SHAKE, one constraint at a time until a tolerance is met, as molecular dynamics runs it."""

from daebench.errors import BadInput, positive
from daebench.schemes.kernels.claims import Claims, Member
from daebench.schemes.kernels.language import CONSTRAINTS, EPS, INF, G, H_p, H_q, dot, dot_moduli, g, multiplier, norm, rows, zero
from daebench.schemes.kernels.newton import both
from daebench.schemes.kernels.relax import relax
from daebench.schemes.kernels.spaces import DATA, Jacobian, Multiplier, Number, Rows, Step, Vector

Iterate = tuple[Vector, Multiplier]
Round = tuple[Iterate, Number, Number, Number]


def numbers(tolerance: float) -> tuple[float, ...]:
    """Return the tolerance; raise :class:`BadInput` where it is not between 0 and 1."""
    if positive("tolerance", tolerance) >= 1:
        raise BadInput(f"tolerance = {tolerance:g} must be less than 1: it is what constraints may be off by, relative to their terms.")
    return (float(tolerance),)


CLAIMS = Claims(
    order=2,
    symmetric=False,
    symplectic=False,
    keeps_g=False,
    keeps_Gv=False,
    system="constrained",
    source="Ryckaert, Ciccotti and Berendsen, J. Comput. Phys. 23 (1977); Andersen, J. Comput. Phys. 52 (1983)",
    separable_only=True,
)
MEMBERS = {
    "rattle_iterative": Member(
        claims=CLAIMS, numbers=numbers, options={"tolerance": 1e-8}, multipliers=lambda: {"lam_n": 0.0, "mu_n": 1.0}
    ),
}


def bounds(X: Rows, x: Vector) -> Multiplier:
    """Return the tolerance times sum_i |X_ki x_i|: what a relative change of x by it makes of constraint k; never below rounding.

    The rounding of a constraint between what is zero, as between two axes of a body at rest, is that of what is not.
    """
    return multiplier(max(DATA[0] * dot_moduli(X[k], x), 4.0 * EPS * norm(X[k]) * norm(x)) for k in range(CONSTRAINTS))


def update_positions(x: Iterate, data: tuple[Vector, Rows, Multiplier]) -> Round:
    """One round for g(q0 + dq - V^T nu) = 0; each visit to a constraint counts as an evaluation of g and one of G."""
    dq, nu = x
    q0, V, bound = data
    unmet, residual, pivot = 0.0, 0.0, INF
    for k in range(CONSTRAINTS):
        q = q0 + dq
        row, value = G(q)[k], g(q)[k]
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
        late = 1.0 if abs(value) > max(bound[k], max(DATA[0], 4.0 * EPS) * dot_moduli(G1[k], v)) else 0.0
        steep = dot(G1[k], V[k])
        change = late * value / steep
        v = v - change * V[k]
        mu = multiplier(mu[j] + (change if j == k else 0.0) for j in range(CONSTRAINTS))
        unmet, residual, pivot = unmet + late, residual + abs(value), min(pivot, abs(steep) / dot_moduli(G1[k], V[k]))
    return (v, mu), unmet, residual, pivot


def increment(p0: Vector, q0: Vector, h: Number) -> Step:
    """Return p1 - p0, q1 - q0, lam and mu, and a report.

    The equations are those of RATTLE, HLW (1.25). Both sets of constraints are visited one after another, k = 1, ..., m, and corrected
    one by one, until all are met at once::

        q -> q - V_k^T g_k(q) / (G_k(q) V_k^T),                V = G(q0) M^-1,     |g_k(q)|    <= tolerance sum_i |G_ki(q0) q_i|
        v -> v - V_k^T (G_k(q1) v) / (G_k(q1) V_k^T),          V = G(q1) M^-1,     |G_k(q1) v| <= tolerance sum_i |G_ki(q1) v_i|

    with q and v on the right as they are before any correction; v also as it has become, where that allows more, for bodies that fall
    side by side have no terms to compare with before. For a distance from the origin that is | |q|^2 - l^2 | <= 2 l^2 tolerance,
    as in molecular dynamics. The tolerance is taken as 4 eps where it is less.
    """
    G0 = G(q0)
    kick = -h / 2 * H_q(p0, q0)
    dq_free = h * H_p(p0 + kick, q0)
    (dq, nu), position_report = relax(update_positions, (dq_free, zero(q0)), (q0, rows(G0, p0, q0), bounds(G0, q0 + dq_free)))
    q1 = q0 + dq
    dp = kick - G0.T @ nu / h - h / 2 * H_q(p0, q1)
    G1, v_free = G(q1), H_p(p0 + dp, q1)
    (_, mu), settled = relax(update_velocities, (v_free, zero(q0)), (G1, rows(G1, p0, q1), bounds(G1, v_free)))
    return dp - G1.T @ mu, dq, (2 / h**2 * nu, 2 / h * mu), both(position_report, settled)
