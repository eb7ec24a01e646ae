"""RATTLE with LINCS: a projection whose inverse is a truncated series, and corrections for the rotation of bonds."""

from dataclasses import replace

from daebench.errors import BadInput
from daebench.schemes.kernels.branch import floor, on_branch
from daebench.schemes.kernels.claims import EXPANDABLE, Member
from daebench.schemes.kernels.language import CONSTRAINTS, G, H_p, dot, g, multiplier, norm, rows, sqrt, squares, zero
from daebench.schemes.kernels.rattle_step import APPROXIMATE, CHOICES, choices, rattle_step
from daebench.schemes.kernels.relax import relax
from daebench.schemes.kernels.spaces import DATA, Gram, Jacobian, Multiplier, Number, Report, Rows, Step, Vector

MOST = 64
"""The largest order, and the largest number of iterations."""

Iterate = tuple[Vector, Multiplier, Number]


def numbers(order: float, iterations: float, differences: float, projected: float) -> tuple[float, ...]:
    """Return the choices of velocities, the order and the iterations; raise :class:`BadInput` where these are not from 1 to 64."""
    for name, value in (("order", order), ("iterations", iterations)):
        if not 1 <= value <= MOST or value != int(value):
            raise BadInput(f"{name} = {value:g} must be a whole number from 1 to {MOST}.", "lincs-number-out-of-range")
    return (*choices(differences, projected), float(order), float(iterations))


CLAIMS = replace(APPROXIMATE, source="Hess, Bekker, Berendsen and Fraaije, J. Comput. Chem. 18 (1997) 1463-1472", constraints=EXPANDABLE)
MEMBERS = {
    "rattle_lincs": Member(
        claims=CLAIMS,
        numbers=numbers,
        options={"order": 8, "iterations": 4, **CHOICES},
        multipliers=lambda: {"lam_n": 0.0, "mu_n": 1.0},
    ),
}


def expand(K: Gram, b: Multiplier) -> Multiplier:
    """Return (I + A + A^2 + ... + A^order) D^-1 b with A = I - D^-1 K and the diagonal D of K, for K^-1 b."""
    term = multiplier(b[k] / K[k][k] for k in range(CONSTRAINTS))
    total = term
    # A fixed end and a test: the order is run-time data, so that another order needs no compilation.
    for power in range(1, MOST + 1):
        term = multiplier(term[k] - sum(K[k][j] * term[j] for j in range(CONSTRAINTS)) / K[k][k] for k in range(CONSTRAINTS))
        total = total + term
        if power >= DATA[2]:
            return total
    return total


def update_turning(x: Iterate, data: tuple[Vector, Rows, Gram, Multiplier, Multiplier]) -> tuple[Iterate, Number, Number, Number]:
    """Correct once for the lengthening of bonds by their rotation; also return how many corrections are left."""
    dq, nu, left = x
    q0, V, K, s, D = data
    value = g(q0 + dq)
    # The root is of 2 D^2 - l^2: NaN says that a bond has become longer than sqrt(2) D, where the correction has no solution.
    change = expand(K, multiplier(2.0 * s[k] * value[k] / (D[k] + sqrt(D[k] * D[k] - value[k])) for k in range(CONSTRAINTS)))
    return (dq - V.T @ change, nu + change, left - 1.0), left - 1.0, norm(value), 1.0


def solve_positions(p0: Vector, q0: Vector, dq: Vector, G0: Jacobian, V: Rows) -> tuple[Vector, Multiplier, Report]:
    """Return dq - V^T nu near g = 0, nu and a report."""
    K, value = G0 @ V.T, g(q0)
    s = multiplier(sqrt(dot(G0[k], q0) / 2) for k in range(CONSTRAINTS))
    D = multiplier(sqrt(squares(q0)[k]) for k in range(CONSTRAINTS))
    nu0 = expand(K, G0 @ dq + multiplier(2.0 * s[k] * value[k] / (s[k] + D[k]) for k in range(CONSTRAINTS)))
    tangent = dq - V.T @ nu0
    # Corrections that are left stand for constraints that do not hold, so that ``relax`` makes as many as are asked for.
    (dq, nu, _), report = relax(update_turning, (tangent, nu0, 1.0 * DATA[3]), (q0, V, K, s, D))
    return dq, nu, on_branch(q0, G0, V, tangent, dq, nu - nu0, report, floor(q0))


def update_momenta(x: tuple[Multiplier, Number], data: tuple[Gram, Multiplier]) -> tuple[tuple[Multiplier, Number], Number, Number, Number]:
    """Correct mu once for the remaining velocities along bonds; also return how many corrections are left."""
    mu, left = x
    K, value = data
    rest = multiplier(value[k] - sum(K[k][j] * mu[j] for j in range(CONSTRAINTS)) for k in range(CONSTRAINTS))
    return (mu + expand(K, rest), left - 1.0), left - 1.0, norm(rest), 1.0


def solve_momenta(p: Vector, q: Vector) -> tuple[Vector, Multiplier, Report]:
    """Return n = G(q)^T mu such that G M^-1 (p - n) is approximately 0, mu and a report."""
    G1 = G(q)
    value = G1 @ H_p(p, q)
    (mu, _), report = relax(update_momenta, (zero(q), DATA[3] + 1.0), (G1 @ rows(G1, p, q).T, value))
    return G1.T @ mu, mu, report


def increment(p0: Vector, q0: Vector, h: Number) -> Step:
    """Return p1 - p0, q1 - q0, lam and mu, and a report.

    The step is :func:`daebench.schemes.kernels.rattle_step.rattle_step`. With g_k = |r_k|^2 - d_k^2, G_k(q) q = 2 |r_k|^2 and, up to one
    factor that cancels, lengths s_k = |r_k| at q0 and D_k = d_k, bonds are first given their lengths along their old directions, and then
    corrected ``iterations`` times for the lengthening by rotation::

        G_k(q0) q = 2 s_k D_k,        nu -> nu + K_n^-1 (G(q0) dq + 2 s (s - D)),      s_k - D_k = g_k(q0) / (s_k + D_k)
        p_k = sqrt(2 D_k^2 - l_k^2),  nu -> nu + K_n^-1 (2 s (D - p)),                 D_k - p_k = g_k(q) / (D_k + p_k)

    l_k being the length at q. K_n^-1 stands for the inverse of K = G(q0) V^T, expanded to the given order::

        K^-1 = S (I - A)^-1 S = S (I + A + A^2 + ...) S,      S = diag(K)^-1/2,      A = I - S K S

    with the diagonal of K factored out once, as S A^n S = (I - diag(K)^-1 K)^n diag(K)^-1. The series converges if the spectral radius of A
    is less than 1; otherwise the problem is refused. Momenta are projected with the same series at q1, once and then ``iterations`` times
    for the remainder; with a single projection, as in molecular dynamics programs, momenta are of first order in h. Hess and others, *J.
    Comput. Chem.* 18 (1997), equations of the sections on the projection and on the correction for rotational lengthening.
    """
    return rattle_step(solve_positions, solve_momenta, p0, q0, h)
