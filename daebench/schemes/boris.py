"""Boris's method for charged particles, with the velocity at both ends of a step: explicit but for a rotation, and of second order."""

from daebench.schemes.kernels.claims import Claims
from daebench.schemes.kernels.language import H_p, H_pp, H_pq, H_q, H_qp, mass, norm, solve
from daebench.schemes.kernels.newton import linear
from daebench.schemes.kernels.spaces import I, Number, Step, Vector

CLAIMS = Claims(
    order=2,
    symmetric=True,
    symplectic=False,
    keeps_g=False,
    keeps_Gv=False,
    system="constrained",
    source="Boris (1970); Qin and others, Phys. Plasmas 20 (2013) 084503; Hairer and Lubich, BIT 58 (2018)",
    volume=True,
    charged_only=True,
)


def increment(p0: Vector, q0: Vector, h: Number) -> Step:
    """Return p1 - p0, q1 - q0, no stage multipliers, and a report.

    It keeps the volume dp dq: a step is two shears, and a Cayley transform of the skew matrix of the magnetic field B between them. It is
    symplectic only where B is uniform. With H = (p - A)^T M^-1 (p - A) / 2 + phi and v = M^-1 (p - A)::

        x       = q0 + h/2 v0
        v1 - v0 = h M^-1 (-phi_q(x) + (A'^T - A')(x) (v0 + v1) / 2)      in space (A'^T - A') v = v x B
        q1      = x + h/2 v1,      p1 = M v1 + A(q1)

    A and its derivatives are read off those of H: A = p - M H_p, M^-1 A' = -H_pq, and A'^T M^-1 = -H_qp, at any p.
    """
    M, v0 = mass(p0, q0), H_p(p0, q0)
    half = h / 2 * v0
    x = q0 + half
    p = p0 + M @ (v0 - H_p(p0, x))  # M v0 + A(x)
    turn = H_pq(p, x)
    rate = turn @ v0 - H_pp(p, x) @ H_q(p, x)
    change, pivot = solve(I - h / 2 * (turn - H_pp(p, x) @ (H_qp(p, x) @ M)), h * rate)
    v1 = v0 + change
    dq = half + h / 2 * v1
    return M @ (v1 - H_p(p0, q0 + dq)), dq, (), linear(pivot, norm(change))
