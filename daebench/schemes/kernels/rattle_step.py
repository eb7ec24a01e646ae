"""The step of RATTLE around a solver of its constraints, with the variants of velocities that are used in molecular dynamics."""

from collections.abc import Callable

from daebench.errors import BadInput
from daebench.schemes.kernels.claims import Claims
from daebench.schemes.kernels.language import G, H_p, H_q, mass, rows
from daebench.schemes.kernels.newton import both
from daebench.schemes.kernels.spaces import DATA, Jacobian, Multiplier, Number, Report, Rows, Step, Vector

Positions = Callable[[Vector, Vector, Vector, Jacobian, Rows], tuple[Vector, Multiplier, Report]]
"""Function of p0, q0, the increment of q without constraints, G(q0) and V = G(q0) M^-1 that returns dq - V^T nu, nu and a report."""

Momenta = Callable[[Vector, Vector], tuple[Vector, Multiplier, Report]]
"""Function of p and q that returns n = G(q)^T mu with G M^-1 (p - n) = 0, mu and a report."""

APPROXIMATE = Claims(
    order=2,
    symmetric=False,
    symplectic=False,
    keeps_g=False,
    keeps_Gv=False,
    system="constrained",
    source="HLW (1.25)",
    separable_only=True,
    imposes=True,
)
"""Claims of the step around a solver that leaves a residual of the constraints."""

CHOICES = {"differences": 0.0, "projected": 1.0}
"""Options of every scheme with this step, with their defaults."""


def choices(differences: float, projected: float) -> tuple[float, float]:
    """Return the first two numbers of a scheme; raise :class:`BadInput` if one is neither 0 nor 1."""
    for name, value in (("differences", differences), ("projected", projected)):
        if value not in (0, 1):
            raise BadInput(f"{name} = {value:g} must be 0 for no or 1 for yes.", "choice-not-zero-or-one")
    return float(differences), float(projected)


def rattle_step(solve_positions: Positions, solve_momenta: Momenta, p0: Vector, q0: Vector, h: Number) -> Step:
    """Return p1 - p0, q1 - q0, lam and mu, and a report.

    ::

        q1     = q0 + h M^-1 (p0 - h/2 U_q(q0)) - V^T nu,                       V = G(q0) M^-1,   g(q1) = 0 to what the solver leaves
        p_half = p0 - h/2 U_q(q0) - G(q0)^T nu / h,      or  M (q1 - q0) / h    where ``differences`` is 1
        p1     = p_half - h/2 U_q(q1) - G(q1)^T mu,      or  mu = 0             where ``projected`` is 0

    The equations are those of RATTLE, HLW (1.25), lam = 2 nu / h^2. Both p_half are equal up to rounding: q1 is rounded to the spacing
    of positions, which differences divide by h (B. Hess, gmx-developers, October 2006, 001873). Without the projection of momenta it is
    SHAKE in the form of velocity Verlet: q0, q1, ... are those of HLW (1.23), and the half kick of the constraints is missing in p1. The
    iterative solvers start where the linearised constraints put q1, or nearby.
    """
    G0 = G(q0)
    kick = -h / 2 * H_q(p0, q0)
    dq, nu, position_report = solve_positions(p0, q0, h * H_p(p0 + kick, q0), G0, rows(G0, p0, q0))
    q1 = q0 + dq
    # Before the choice below, which is a branch on run-time data: functions of the problem are not called in a branch.
    inertia = mass(p0, q0)
    half = 1.0 / h * (inertia @ (q1 - q0)) - p0 if DATA[0] > 0.5 else kick - G0.T @ nu / h
    dp = half - h / 2 * H_q(p0, q1)
    n, mu, settled = solve_momenta(p0 + dp, q1)
    # Multiplied by 0 or 1 in place of a branch.
    return dp - DATA[1] * n, dq, (2 / h**2 * nu, 2 / h * DATA[1] * mu), both(position_report, settled)
