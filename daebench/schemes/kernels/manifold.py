"""The manifold g = 0, G H_p = 0: its normals, the correction towards it, and the orthogonal projection onto it."""

from daebench.schemes.kernels.constrain import momentum_correction, project_position
from daebench.schemes.kernels.language import CONSTRAINTS, ON_VELOCITIES, G, Gv_p, Gv_q, H_p, H_pp, g, mass, norm, rows, solve_2m, zero
from daebench.schemes.kernels.newton import both, newton
from daebench.schemes.kernels.spaces import LENGTH, Matrix, Multiplier, Number, Report, Rows, Update, Vector

Point = tuple[Vector, Vector, Multiplier, Multiplier]


def normals(p: Vector, q: Vector, inverse_mass: Matrix, mass_: Matrix) -> tuple[Rows, Rows, Rows]:
    """Return D^-1 C^T with C = (g, G H_p)', the normals of the manifold in the metric dq^T M dq + dp^T M^-1 dp.

    These are M Gv_p^T, the momenta of mu, and M^-1 G^T and M^-1 Gv_q^T, the positions of nu and mu; all as rows.
    """
    return Gv_p(p, q) @ mass_.T, G(q) @ inverse_mass.T, Gv_q(p, q) @ inverse_mass.T


def shift(down: tuple[Rows, Rows, Rows], nu: Multiplier, mu: Multiplier) -> tuple[Vector, Vector]:
    """Return the normal vector D^-1 C^T (nu, mu), its momenta first."""
    return down[0].T @ mu, down[2].T @ mu + down[1].T @ nu


def correction(
    w: Number, x: Point, p_free: Vector, q_free: Vector, inverse_mass: Matrix, mass_: Matrix
) -> tuple[Point, Number, Number, Number, Number]:
    """Return the correction to subtract from x = (p, q, nu, mu); and size, scale, residual and pivot for Newton's iteration.

    It leads to the point of the manifold that differs from the free one by a normal vector there; second derivatives of the constraints,
    whose factors are the small multipliers, are omitted. The free point itself moves by w - 1 times that vector::

        dy - w D^-1 C^T (dnu, dmu) = y - y_free - D^-1 C^T (nu, mu)        C dy = (g, G H_p)        y = (p, q)
    """
    p, q, nu, mu = x
    G1, by_p, by_q = G(q), Gv_p(p, q), Gv_q(p, q)
    down_p, down_g, down_q = by_p @ mass_.T, G1 @ inverse_mass.T, by_q @ inverse_mass.T
    r_p = p - p_free - down_p.T @ mu
    r_q = q - q_free - (down_q.T @ mu + down_g.T @ nu)
    value_g, value_v = g(q), G1 @ H_p(p, q)
    dnu, dmu, pivot = solve_2m(
        w * G1 @ down_g.T,
        w * G1 @ down_q.T,
        w * by_q @ down_g.T,
        w * (by_q @ down_q.T + by_p @ down_p.T),
        value_g - G1 @ r_q,
        value_v - (by_q @ r_q + by_p @ r_p),
    )
    dp = r_p + w * down_p.T @ dmu
    dq = r_q + w * (down_q.T @ dmu + down_g.T @ dnu)
    scale_v, scale_q = norm(inverse_mass @ p_free) + norm(inverse_mass @ p), max(LENGTH, norm(q))
    # Momenta as velocities times a length, positions times a speed: the sum then needs no unit of time.
    size = norm(inverse_mass @ dp) * scale_q + norm(dq) * scale_v
    return (dp, dq, dnu, dmu), size, scale_v * scale_q, norm(value_g) + norm(value_v), pivot


def corrected(x: Point, due: Point) -> Point:
    """Return (p, q, nu, mu) minus the correction."""
    return x[0] - due[0], x[1] - due[1], x[2] - due[2], x[3] - due[3]


def update_projection(x: Point, data: tuple[Vector, Vector, Matrix, Matrix]) -> Update:
    """One update of the point of the manifold."""
    p_free, q_free, inverse_mass, mass_ = data
    due, size, scale, residual, pivot = correction(1.0, x, p_free, q_free, inverse_mass, mass_)
    return corrected(x, due), size, scale, residual, pivot


if ON_VELOCITIES == CONSTRAINTS:

    def project(p: Vector, q: Vector) -> tuple[Vector, Vector, Report]:
        """Return momenta with G H_p = 0 at the same positions, and a report: no position is forbidden."""
        n, _, report = momentum_correction(p, q)
        return p - n, q, report

elif ON_VELOCITIES:

    def project(p: Vector, q: Vector) -> tuple[Vector, Vector, Report]:
        """Return positions with g = 0, to which only velocities that are allowed lead, then momenta with G H_p = 0; and a report."""
        G0 = G(q)
        dq, _, moved = project_position(q, 0 * q, G0, rows(G0, p, q))
        n, _, settled = momentum_correction(p, q + dq)
        return p - n, q + dq, both(moved, settled)

else:

    def project(p: Vector, q: Vector) -> tuple[Vector, Vector, Report]:
        """Return the point of the manifold nearest to (p, q), and a report.

        Minimises dq^T M dq + dp^T M^-1 dp subject to the 2m conditions, with M frozen at the point given; Euclidean for M = I. The
        metric adds energies of positions to those of momenta by a unit of time, 1 s: in another unit another point is the nearest.
        """
        data = (p, q, H_pp(p, q), mass(p, q))
        (p, q, _, _), report = newton(update_projection, (p, q, zero(q), zero(q)), data)
        return p, q, report
