"""Generalized-alpha of Arnold and Brüls on the constraint g = 0 itself, index 3, as in codes for flexible multibody systems; it damps.

At the default rho_inf = 0.8 the motion is lost if a step turns the constraint's normal by about 0.2 rad. Pendulums at 3, 10 and 30 rad/s
are stable at h omega = 0.15; at 0.2 velocities normal to the manifold grow without bound. A lost run gives a warning.
"""

from typing import Any

from daebench.errors import BadInput, real
from daebench.schemes.kernels.claims import Claims, Member
from daebench.schemes.kernels.in_time import by_mass_alone, with_p_t
from daebench.schemes.kernels.language import EXTENDED, SEPARABLE, G, H_pp, H_pq, H_q, H_qq, curvature, f, g, mass, norm, rows, solve, zero
from daebench.schemes.kernels.newton import linear, newton
from daebench.schemes.kernels.spaces import DATA, LENGTH, I, Multiplier, Number, Report, Update, Vector

Memory = tuple[Vector, Vector, Vector]


def numbers(rho_inf: float) -> tuple[float, ...]:
    """Return alpha_m, alpha_f, beta and gamma of Chung and Hulbert for a spectral radius at infinity.

    Raises
    ------
    BadInput
        If rho_inf is not in [0, 1].
    """
    rho = real("rho_inf", rho_inf)
    if not 0 <= rho <= 1:
        raise BadInput(
            f"rho_inf = {rho:g} must be in [0, 1]: 1 means no damping, 0 damps the highest frequencies completely in one step.",
            "damping-out-of-range",
        )
    alpha_m, alpha_f = (2 * rho - 1) / (rho + 1), rho / (rho + 1)
    gamma = 0.5 + alpha_f - alpha_m
    return alpha_m, alpha_f, (gamma + 0.5) ** 2 / 4, gamma


CLAIMS = Claims(
    order=2,
    symmetric=False,
    symplectic=False,
    keeps_g=True,
    keeps_Gv=False,
    system="index3",
    source="Arnold and Brüls, Multibody Syst. Dyn. 18 (2007); the motion is lost if a step turns normals by 0.2 rad",
    quadratic_only=True,
)
MEMBERS = {
    "generalized_alpha": Member(claims=CLAIMS, numbers=numbers, options={"rho_inf": 0.8}, multipliers=lambda: {"lam_n": 1.0}),
}

if SEPARABLE:

    def change_of_velocity(dp: Vector, p: Vector, q: Vector, v: Vector) -> Vector:
        """Return v' = M^-1 p'."""
        return by_mass_alone(dp, q)

    def momentum(p0: Vector, q: Vector, v: Vector) -> Vector:
        """Return any momentum: the forces do not depend on it."""
        return p0

else:

    def change_of_velocity(dp: Vector, p: Vector, q: Vector, v: Vector) -> Vector:
        """Return v' = H_pp p' + d/dq[H_p] v."""
        return H_pq(p, q) @ v + H_pp(p, q) @ dp

    def momentum(p0: Vector, q: Vector, v: Vector) -> Vector:
        """Return p = M(q) v."""
        return mass(p0, q) @ v


def update(x: tuple[Vector, Multiplier], data: tuple[Vector, Vector, Vector, Vector, Number, Number]) -> Update:
    """One update of z = w v1', the part of q1 due to v1', and nu = w lam; exact for constant M, else up to velocity terms of order h."""
    z, nu = x
    p0, q0, dq, v_free, w, ratio = data
    q, v = q0 + (z + dq), v_free + ratio * z
    p = momentum(p0, q, v)
    G1, value = G(q), g(q)
    by_mass = rows(G1, p, q)
    free = change_of_velocity(-H_q(p, q), p, q, v)
    r = z - w * free + by_mass.T @ nu
    stiffness = curvature(q, nu) + w * H_qq(p, q)
    by_r, Z, pivot_z = solve(I + H_pp(p, q) @ stiffness, r, by_mass)
    change, pivot = solve(G1 @ Z.T, G1 @ by_r - value)
    back = by_r - Z.T @ change
    x = (z - back, nu - change)
    return x, norm(back), max(LENGTH, norm(q)), norm(r) + norm(value), min(pivot, pivot_z)


def begun(p0: Vector, q0: Vector, h: Number) -> tuple[Memory, Report]:
    """Return v0, a0 and v'(0) such that lam has no error of first order in the first steps, and a report.

    v'(0) is that of (1.18), and a0 approximates v'((alpha_m - alpha_f) h), at the time to which the averages a belong, up to h^2. The
    normal part of v0 has an error of h^2, as in later steps. If it were zero at the start, the multiplier would have to produce it::

        v0 = v + C h^2 M^-1 G^T (G M^-1 G^T)^-1 G v'',     C = 1/6 - beta - (alpha_m - alpha_f)/2
    """
    alpha_m, alpha_f, beta, _ = DATA
    dp, v, pivot = f(p0, q0)
    p, q = p0 + h * dp, q0 + h * v
    dp_next, v_next, pivot_next = f(p, q)
    rate = change_of_velocity(dp, p0, q0, v)
    jump = change_of_velocity(dp_next, p, q, v_next) - rate
    G0 = G(q0)
    by_mass = rows(G0, p0, q0)
    share, pivot_share = solve(G0 @ by_mass.T, G0 @ jump)
    C = 1 / 6 - beta - (alpha_m - alpha_f) / 2
    memory = (v + C * h * by_mass.T @ share, rate + (alpha_m - alpha_f) * jump, rate)
    return memory, linear(min(pivot, min(pivot_next, pivot_share)), norm(dp) + norm(dp_next))


def advanced(p0: Vector, q0: Vector, memory: Memory, h: Number) -> tuple[Vector, Memory, Multiplier, Report]:
    """Return q1, the next v, a and v', lam of q1 and a report.

    ::

        q1 = q0 + h v0 + h^2 ((1/2 - beta) a0 + beta a1),      v1 = v0 + h ((1 - gamma) a0 + gamma a1),      p1 = M(q1) v1
        (1 - alpha_m) a1 + alpha_m a0 = (1 - alpha_f) v1' + alpha_f v0'
        v1' = H_pp p1' + d/dq[H_p] v1,                         p1' = -H_q(p1, q1) - G(q1)^T lam,             0 = g(q1)

    lam is of second order for rho_inf < 1. For rho_inf = 1 its errors are not damped but add up, so that it is of first order only. There,
    from about 0.95 on at any step, and for 0.8 if a step turns normals of the manifold by 0.2 rad or more, velocities along the normals
    grow until the motion is lost. Each step still solves its equations, so no report shows this.
    """
    alpha_m, alpha_f, beta, gamma = DATA
    v0, a0, rate0 = memory
    share = (1 - alpha_f) / (1 - alpha_m)
    a_free = -alpha_m / (1 - alpha_m) * a0 + alpha_f / (1 - alpha_m) * rate0
    dq = h * v0 + h**2 * (beta * a_free + (0.5 - beta) * a0)
    v_free = v0 + h * (gamma * a_free + (1 - gamma) * a0)
    w = beta * share * h * h
    # z = w v1' is a part of q1: an increment of it is compared with positions, whatever the size of h.
    (z, nu), report = newton(update, (w * rate0, zero(q0)), (p0, q0, dq, v_free, w, gamma / (beta * h)))
    q1, v1, rate1 = q0 + (z + dq), v_free + gamma / (beta * h) * z, z / w
    return q1, (v1, a_free + share * rate1, rate1), nu / w, report


def of_velocities(memory: tuple[Memory, Vector]) -> Memory:
    """Return v, a and v' of the memory of a system in time."""
    return memory[0]


def of_momenta(memory: tuple[Memory, Vector]) -> Vector:
    """Return p' of the memory of a system in time."""
    return memory[1]


if EXTENDED:

    def start(p0: Vector, q0: Vector, h: Number) -> Any:
        """Return the memory of the velocities, p'(0), and a report."""
        memory, report = begun(p0, q0, h)
        return (memory, f(p0, q0)[0]), report

    def step(p0: Vector, q0: Vector, memory: Any, h: Number) -> tuple[Vector, Vector, Any, tuple[Multiplier], Report]:
        """Return p1, q1, the next memory, lam of q1 and a report; p_t by the trapezoidal rule, also of order 2.

        ::

            p1 = M(q1) v1,      p_t1 = p_t0 + h/2 (p_t'(0) + p_t'(1)),      p' = -H_q - G^T lam
        """
        q1, memory1, lam, report = advanced(p0, q0, of_velocities(memory), h)
        # p_t has no mass, so that it cannot follow from a velocity; it is integrated apart.
        p = mass(p0, q1) @ memory1[0]
        dp = -(H_q(p, q1) + G(q1).T @ lam)
        return with_p_t(p, p0, h / 2 * (of_momenta(memory) + dp), q1), q1, (memory1, dp), (lam,), report

else:

    def start(p0: Vector, q0: Vector, h: Number) -> Any:
        """Return v0, a0 and v'(0), and a report."""
        return begun(p0, q0, h)

    def step(p0: Vector, q0: Vector, memory: Any, h: Number) -> tuple[Vector, Vector, Any, tuple[Multiplier], Report]:
        """Return p1, q1, the next v, a and v', lam of q1 and a report."""
        q1, memory1, lam, report = advanced(p0, q0, memory, h)
        return mass(p0, q1) @ memory1[0], q1, memory1, (lam,), report
