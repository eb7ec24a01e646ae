"""SHAKE, HLW (1.23): the three-term recursion in q, started by RATTLE; as HLW say, round-off accumulates in it, unlike in RATTLE."""

from typing import Any

from daebench.claims import Claims
from daebench.kernels.constrain import onto
from daebench.kernels.hole import G, H_p, H_q, Number, Report, Vector, apply, axpy, mass, rows, scale
from daebench.schemes.rattle import step as rattle_step

CLAIMS = Claims(
    order=2, symmetric=False, symplectic=True, keeps_g=True, keeps_Gv=False, system="constrained", source="HLW (1.23)", separable_only=True
)


def start(p0: Vector, q0: Vector, h: Number) -> tuple[Vector, Report]:
    """Return q1 from one step of RATTLE, and its report."""
    _, q1, report = rattle_step(p0, q0, h)
    return q1, report


def step(p0: Vector, q0: Vector, q1: Vector, h: Number) -> Any:
    """Return p1, q1, q2 and a report; p1 needs the step after it, so the memory of SHAKE is the position one step ahead.

    The momentum is defined by a central difference and does not satisfy G H_p = 0. That is also why SHAKE is not symmetric as a
    map of (p, q) from the manifold, though its recursion in q is.

    ::

        q2 = 2 q1 - q0 - h^2 M^-1 (U_q(q1) + G(q1)^T lam),      0 = g(q2)
        p1 = M (q2 - q0) / (2 h)
    """
    q_free = axpy(-h * h, H_p(H_q(p0, q1), q1), axpy(-1.0, q0, scale(2.0, q1)))
    q2, _, report = onto(q_free, rows(G(q1), p0, q1))
    p1 = apply(mass(p0, q1), axpy(-1.0, q0, q2))
    return scale(0.5 / h, p1), q1, q2, report
