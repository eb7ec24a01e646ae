"""SHAKE, HLW (1.23): the three-term recursion in q, started by RATTLE; as HLW say, round-off may accumulate in it."""

from daebench.schemes.kernels.claims import Claims, Member
from daebench.schemes.kernels.constrain import project_position
from daebench.schemes.kernels.language import G, H_p, H_q, mass, rows
from daebench.schemes.kernels.spaces import Multiplier, Number, Report, Vector
from daebench.schemes.rattle import increment as rattle_increment

CLAIMS = Claims(
    order=2,
    symmetric=False,
    symplectic=True,
    keeps_g=True,
    keeps_Gv=False,
    system="constrained",
    source="HLW (1.23)",
    separable_only=True,
    autonomous_only=True,
    imposes=True,
)
MEMBERS = {"shake": Member(claims=CLAIMS, multipliers=lambda: {"lam_n": 1.0})}


def start(p0: Vector, q0: Vector, h: Number) -> tuple[Vector, Report]:
    """Return q1 from one step of RATTLE, and its report."""
    _, dq, _, report = rattle_increment(p0, q0, h)
    return q0 + dq, report


def step(p0: Vector, q0: Vector, q1: Vector, h: Number) -> tuple[Vector, Vector, Vector, tuple[Multiplier], Report]:
    """Return p1, q1, q2, lam of q1 and a report; p1 needs the step after it, so the memory of SHAKE is the position one step ahead.

    The recursion in q is symmetric: from q2 and q1 it leads back to q0. The momentum is a central difference and does not satisfy
    G H_p = 0, so that the map of (p, q) begins on the manifold and ends off it: that map is not symmetric.

    ::

        q2 = 2 q1 - q0 - h^2 M^-1 (U_q(q1) + G(q1)^T lam),      0 = g(q2)
        p1 = M (q2 - q0) / (2 h)
    """
    dq = q1 - q0
    G1 = G(q1)
    dq2, nu, report = project_position(q1, dq - h**2 * H_p(H_q(p0, q1), q1), G1, rows(G1, p0, q1))
    # The sum of two increments, and not q2 - q0: its rounding is relative to the increments.
    p1 = mass(p0, q1) @ (dq + dq2)
    return 0.5 / h * p1, q1, q1 + dq2, (nu / h**2,), report
