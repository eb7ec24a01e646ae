"""Flows of the kinetic energy on manifolds whose geodesics have a closed form: flat space, spheres, rotations, and products of these."""

from collections.abc import Sequence

import sympy as sp

from daebench.errors import InvalidProblem
from daebench.systems.constrained import KineticFlow
from daebench.systems.picture import Exact

TIME = sp.Symbol("t", real=True)

TINY = sp.Rational(1, 10**37)
"""Added to w^2, so that sin(w t)/w is t at rest, in single precision too; it is negligible against any speed that matters."""


def sphere(q: Sequence[sp.Symbol], p: Sequence[sp.Symbol], *, mass: Exact, length: Exact) -> KineticFlow:
    """Return the flow of |p|^2 / (2 mass) on |q| = length: rotation in the plane of q and p, as in HLW Example 1.6.

    ::

        q(t) = q + sin(w t) p / (mass w) - (1 - cos(w t)) q
        p(t) = p - mass w sin(w t) q     - (1 - cos(w t)) p        w = |p| / (mass length)

    With the given length in w, and not |q|, an error of |q| does not grow but decays by the factor cos(w t).

    q and p are of shape(d,).
    """
    _same_length(q, p)
    w = sp.sqrt(sum(x**2 for x in p) / (mass * length) ** 2 + TINY)
    sine, versine = _turn(w)
    return KineticFlow(
        t=TIME,
        p=[y - mass * w * sine * x - versine * y for x, y in zip(q, p, strict=True)],
        q=[x + sine * y / (mass * w) - versine * x for x, y in zip(q, p, strict=True)],
    )


def free(q: Sequence[sp.Symbol], p: Sequence[sp.Symbol], *, mass: Exact) -> KineticFlow:
    """Return the flow of |p|^2 / (2 mass) where there is no constraint: q(t) = q + t p / mass.

    q and p are of shape(d,).
    """
    _same_length(q, p)
    return KineticFlow(t=TIME, p=list(p), q=[x + TIME * y / mass for x, y in zip(q, p, strict=True)])


def rotation(q: Sequence[sp.Symbol], p: Sequence[sp.Symbol], *, c: Exact) -> KineticFlow:
    """Return the flow of |P|^2 / (2 c) on Q^T Q = I, the free rotation of HLW Section VII.5 with D = c I, by Rodrigues' formula.

    ::

        Q(t) = Q R     P(t) = P R     R = I + sin(w t)/w W + (1 - cos(w t))/w^2 W^2
        W = (Q^T P - P^T Q) / (2 c)   w^2 = 1/2 |W|^2

    q and p are of shape(9,), row by row.
    """
    _same_length(q, p)
    if len(q) != 9:
        raise InvalidProblem(f"a rotation has 9 entries, row by row, not {len(q)}.", "rotation-entries")
    Q, P = sp.Matrix(3, 3, list(q)), sp.Matrix(3, 3, list(p))
    product = Q.T * P
    W = (product - product.T) / (2 * c)
    w = sp.sqrt(W[0, 1] ** 2 + W[0, 2] ** 2 + W[1, 2] ** 2 + TINY)
    sine, versine = _turn(w)
    change = sine / w * W + versine / w**2 * W * W
    return KineticFlow(t=TIME, p=list(P + P * change), q=list(Q + Q * change))


def product(*factors: KineticFlow) -> KineticFlow:
    """Return the flow on a product of manifolds whose kinetic energies are not coupled: each factor moves by itself."""
    ends = [[sp.sympify(x).xreplace({factor.t: TIME}) for x in (*factor.p, *factor.q)] for factor in factors]
    return KineticFlow(
        t=TIME,
        p=[x for end in ends for x in end[: len(end) // 2]],
        q=[x for end in ends for x in end[len(end) // 2 :]],
    )


def _turn(w: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    """Return sin(w t) and 1 - cos(w t) from the tangent of the half angle, for which every rounded value gives an exact rotation.

    A rounded cosine and sine are not exactly those of one angle. In a uniform motion their error is the same in every step, and would
    accumulate.
    """
    tau = sp.tan(w * TIME / 2)
    share = 2 / (1 + tau**2)
    return share * tau, share * tau**2


def _same_length(q: Sequence[sp.Symbol], p: Sequence[sp.Symbol]) -> None:
    if len(q) != len(p):
        raise InvalidProblem(
            f"the kinetic flow has {len(q)} positions and {len(p)} momenta; give one momentum for each position.",
            "flow-momenta-not-per-position",
        )
