"""The flow of the potential energy on the manifold, HLW (1.45) with H^[2] = U, for splitting."""

from daebench.schemes.kernels.constrain import momentum_correction
from daebench.schemes.kernels.language import H_q
from daebench.schemes.kernels.spaces import Number, Report, Vector


def potential_increment(p0: Vector, q: Vector, t: Number) -> tuple[Vector, Report]:
    """Return p(t) - p0 and a report, for H = 1/2 p^T M^-1 p + U(q) under the action of U only; q is constant.

    ::

        p(t) = p0 - t (U_q + G^T lam),      0 = G M^-1 p(t)

    On the manifold lam = -(G M^-1 G^T)^-1 G M^-1 U_q, the multiplier of the forces only: the part of lam(p, q) that comes from the motion
    is in the kinetic flow, so a splitting has no stage multiplier. The term with p0 in the equation for lam is zero there, but it prevents
    the rounding of G M^-1 p0 from accumulating over the steps.
    """
    dp = -t * H_q(p0, q)
    n, _, report = momentum_correction(p0 + dp, q)
    return dp - n, report
