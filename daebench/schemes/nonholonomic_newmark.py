"""Newmark's method with constraints on velocities, and its adjoint."""

from daebench.schemes.kernels.claims import Claims, Member
from daebench.schemes.kernels.constrain import momentum_correction
from daebench.schemes.kernels.language import G, H_p, H_pp, H_q, f, norm, rows, solve
from daebench.schemes.kernels.newton import both, linear, newton
from daebench.schemes.kernels.spaces import DATA, LENGTH, Number, Step, Update, Vector

CLAIMS = Claims(
    order=2,
    symmetric=False,
    symplectic=False,
    keeps_g=False,
    keeps_Gv=True,
    system="constrained",
    source="Newmark (1959) with gamma = 1/2; on velocities after an idea of Anahory Simoes et al., arXiv 2201.13162 (2022)",
    separable_only=True,
    nonholonomic=True,
)
OPTIONS = {"beta": 0.25}


def numbers(beta: float) -> tuple[float, ...]:
    """Return beta."""
    return (beta,)


MEMBERS = {"nonholonomic_newmark": Member(claims=CLAIMS, numbers=numbers, options=OPTIONS, simplified=True)}


def update(dq: Vector, data: tuple[Vector, Vector, Vector, Number]) -> Update:
    """One update of q1 - q0, with the multiplier that makes the velocity at q1 an allowed one."""
    p0, q0, kick0, h = data
    (beta,) = DATA
    q1 = q0 + dq
    kick = -h / 2 * H_q(p0, q1)
    n, _, settled = momentum_correction(p0 + kick0 + kick, q1)
    moved = h * H_p(p0 + (1 - 2 * beta) * kick0 + 2 * beta * (kick - n), q0)
    return moved, norm(moved - dq), max(LENGTH, norm(q1)), settled[1], settled[2]


def increment(p0: Vector, q0: Vector, h: Number) -> Step:
    """Return p1 - p0, q1 - q0, no stage multipliers, and a report.

    ::

        k0 = -U_q(q0) - G(q0)^T lam(p0, q0)                  q1 = q0 + h M^-1 (p0 + h/2 ((1 - 2 beta) k0 + 2 beta k1))
        k1 = -U_q(q1) - G(q1)^T mu                           p1 = p0 + h/2 (k0 + k1),              0 = G(q1) M^-1 p1

    with lam(p, q) of (1.18). All constraints are imposed as constraints on velocities.
    """
    force, _, pivot = f(p0, q0)
    kick0 = h / 2 * force
    dq, report = newton(update, h * H_p(p0 + kick0, q0), (p0, q0, kick0, h))
    dp = kick0 - h / 2 * H_q(p0, q0 + dq)
    n, _, settled = momentum_correction(p0 + dp, q0 + dq)
    return dp - n, dq, (), both(linear(pivot, norm(force)), both(report, settled))


def update_adjoint(x: tuple[Vector, Vector], data: tuple[Vector, Vector, Number]) -> Update:
    """One update of p1 - p0 and q1 - q0 for the adjoint."""
    dp, dq = x
    p0, q0, h = data
    (beta,) = DATA
    p1, q1 = p0 + dp, q0 + dq
    force, _, regular = f(p1, q1)
    kick0, kick1, G1 = -h / 2 * H_q(p0, q0), h / 2 * force, G(q1)
    value = G1 @ H_p(p0 + kick0 + kick1, q1)
    nu, pivot = solve(G1 @ rows(G(q0), p0, q0).T, value)
    kick0 = kick0 - G(q0).T @ nu
    moved_p = kick0 + kick1
    moved_q = h * H_p(p0 + moved_p - (1 - 2 * beta) * kick1 - 2 * beta * kick0, q0)
    size = norm(moved_q - dq) + abs(h) * norm(H_pp(p1, q1) @ (moved_p - dp))
    return (moved_p, moved_q), size, max(LENGTH, norm(q1)), norm(value), min(pivot, regular)


def adjoint(p0: Vector, q0: Vector, h: Number) -> Step:
    """Return p1 - p0, q1 - q0, no stage multipliers, and a report: the inverse of a step by -h.

    ::

        k0 = -U_q(q0) - G(q0)^T mu                           q1 = q0 + h M^-1 (p1 - h/2 ((1 - 2 beta) k1 + 2 beta k0))
        k1 = -U_q(q1) - G(q1)^T lam(p1, q1)                  p1 = p0 + h/2 (k0 + k1),              0 = G(q1) M^-1 p1
    """
    (dp, dq), report = newton(update_adjoint, (0 * p0, h * H_p(p0, q0)), (p0, q0, h))
    return dp, dq, (), report
