"""The implicit midpoint rule on the index-reduced ODE (1.18): conserves quadratic integrals, but is not symplectic there."""

from functools import partial

from daebench.schemes.gauss import claims, numbers
from daebench.schemes.gauss import increment as collocate
from daebench.schemes.kernels.claims import Member
from daebench.schemes.kernels.spaces import Number, Step, Vector

MEMBERS = {"midpoint": Member(claims=claims(1), stages=1, numbers=partial(numbers, 1), simplified=True)}


def increment(p0: Vector, q0: Vector, h: Number) -> Step:
    """Return p1 - p0, q1 - q0, no stage multipliers, and a report, for x = (p, q): Gauss collocation of one stage.

    ::

        x1 = x0 + h f((x0 + x1)/2)
    """
    return collocate(p0, q0, h)
