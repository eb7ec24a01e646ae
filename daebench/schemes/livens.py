"""Energy-momentum scheme of Livens' principle: independent velocities besides the momenta, and discrete derivatives of the Lagrangian."""

from daebench.schemes.energy_momentum import along
from daebench.schemes.kernels.claims import Claims, Member
from daebench.schemes.kernels.language import G, H, H_p, H_pq, H_q, H_qq, curvature, dot, g, mass, norm, solve, zero
from daebench.schemes.kernels.newton import linear, newton
from daebench.schemes.kernels.spaces import LENGTH, Multiplier, Number, Report, Rows, Update, Vector

CLAIMS = Claims(
    order=2,
    symmetric=False,
    symplectic=False,
    keeps_g=True,
    keeps_Gv=False,
    system="constrained",
    source="Kinon, Betsch, arXiv 2312.02825 (2023); EML of metis",
    quadratic_only=True,
    autonomous_only=True,
)
MEMBERS = {"livens": Member(claims=CLAIMS, multipliers=lambda: {"lam_mid": 0.5}, simplified=True)}


def gain(v: Vector, p0: Vector, q0: Vector, q1: Vector) -> Number:
    """Return L(q1, v) - L(q0, v) for L = 1/2 v^T M(q) v - U(q)."""
    end, begin = mass(p0, q1) @ v, mass(p0, q0) @ v
    return dot(v, end - begin) - (H(end, q1) - H(begin, q0))


def forces(v0: Vector, v1: Vector, p0: Vector, q0: Vector, dq: Vector) -> tuple[Vector, Rows]:
    """Return minus the discrete derivative of L with respect to q, shape(d,), and that of g, shape(m, d)."""
    q, q1, direction = q0 + dq / 2, q0 + dq, along(dq, q0 + dq / 2)
    inertia, jacobian = mass(p0, q), G(q)
    slope = (H_q(inertia @ v0, q) + H_q(inertia @ v1, q)) / 2
    missing = (gain(v0, p0, q0, q1) + gain(v1, p0, q0, q1)) / 2 + dot(slope, dq)
    missing_g = g(q1) - g(q0) - jacobian @ dq
    return slope - missing * direction, jacobian + missing_g @ direction.T


def update(x: tuple[Vector, Multiplier], data: tuple[Vector, Vector, Vector, Number]) -> Update:
    """One update of q1 - q0 and h^2/2 lam, with derivatives of the midpoint rule."""
    dq, nu = x
    v0, p0, q0, h = data
    q, q1, v = q0 + dq / 2, q0 + dq, dq / h
    slope, DG = forces(v0, 2 * v - v0, p0, q0, dq)
    inertia, value = (mass(p0, q0) + mass(p0, q1)) / 2, g(q1)
    p = mass(p0, q) @ v
    mixed = inertia @ H_pq(p, q)
    stiffness = curvature(q, nu) / 2 + h**2 / 4 * (H_qq(p, q) - mixed.T @ H_pq(p, q))
    r = inertia @ dq - h * p0 + h**2 / 2 * slope + DG.T @ nu
    by_r, Z, pivot_z = solve(inertia + stiffness + h / 2 * (mixed.T - mixed), r, DG)
    G1 = G(q1)
    change, pivot = solve(G1 @ Z.T, G1 @ by_r - value)
    back = by_r - Z.T @ change
    return (dq - back, nu - change), norm(back), max(LENGTH, norm(q1)), norm(r) + norm(value), min(pivot, pivot_z)


def start(p0: Vector, q0: Vector, h: Number) -> tuple[Vector, Report]:
    """Return the velocity of the start, and a report."""
    return H_p(p0, q0), linear(1.0, 0.0)


def step(p0: Vector, q0: Vector, v0: Vector, h: Number) -> tuple[Vector, Vector, Vector, tuple[Multiplier], Report]:
    """Return p1, q1, v1, lam in the middle of the step, and a report.

    With m for the mean of both ends, and discrete derivatives in q that are those at the midpoint plus a correction along dq::

        q1 - q0 = h vm,       p1 - p0 = h (D_q L - DG^T lam),       pm = (M(q0) + M(q1))/2 vm,       0 = g(q1)
        2 D_q L.dq = L(q1, v0) - L(q0, v0) + L(q1, v1) - L(q0, v1),       DG dq = g(q1) - g(q0)

    By construction it conserves E = p.v - L(q, v) of its three fields. Since pm = M v holds only for means, p - M v is
    -(M(q1) - M(q0)) (v1 - v0)/2 minus its value one step before, of second order, and the error of H(p, q) = E + 1/2 (p - M v)^T M^-1 (p -
    M v) is of fourth order in h. For constant M, p = M v, the scheme is that of ``energy_momentum.py``, and H is conserved. The map
    of (p, q, v) is symmetric; the map of (p, q), which begins with p = M v, is symmetric for constant M only.
    """
    guess = h * v0
    (dq, nu), report = newton(update, (guess, zero(q0)), (v0, p0, q0, h))
    v1 = 2 / h * dq - v0
    slope, DG = forces(v0, v1, p0, q0, dq)
    return p0 - h * slope - 2 / h * DG.T @ nu, q0 + dq, v1, (2 / h**2 * nu,), report
