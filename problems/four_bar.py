"""A row of four-bar linkages, all bars equal: one degree of freedom, and a configuration in which the constraints lose rank."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import mpmath as mp
import sympy as sp

from daebench.errors import BadInput
from daebench.problems._pendulum_motion import OFF, in_units, planar
from daebench.systems.chain import ConstrainedChain
from daebench.systems.constrained import Case, Chart, Picture


def problem(*, bars: int = 2, mass: float = 1.0, length: float = 1.0, gravity: float = 9.81) -> ConstrainedChain:
    """Return N linkages in a row: uprights from the pivots A_i = (i length, 0) to B_i, i = 0, ..., N, and couplers from B_{i-1} to B_i.

    ::

        q = (x_0, y_0, ..., x_N, y_N), the points B_i, y pointing up      T = mass/6 (v.v + v.w + w.w) of a bar whose ends move with v, w
        g, from link to link:   |B_i - B_{i-1}|^2 - length^2  (i >= 1),   |B_i - A_i|^2 - length^2
        in parallel, B_i - A_i = length (sin theta, -cos theta):
            theta'' = -a gravity / length sin theta,   a = 3 (3 N + 1) / (2 (4 N + 1)),   the motion of a pendulum

    M couples neighbours, so that G M^-1 G^T is full, while [[M, G^T], [G, 0]] is banded from link to link. Where all bars lie in one
    horizontal line, G has rank N + 1 in place of 2 N + 1, and uprights could begin to turn against each other. In the parallel motion the
    constraint forces G^T lam stay finite there; the multipliers of three or more uprights grow like 1/cos(theta). H is the only first
    integral.

    Parameters
    ----------
    bars : int
        Number N of linkages, one less than uprights.
    mass : float
        Mass of each bar, uniform along it, kg.
    length : float
        Length of each bar, and distance of the pivots, m.
    gravity : float
        Gravitational acceleration along -y, m/s^2.
    """
    m, length_ = sp.symbols("mass length", positive=True)
    gamma = sp.Symbol("gravity", real=True)
    x, y, x_before, y_before = sp.symbols("x y x_before y_before", real=True)
    k = sp.Symbol("k", integer=True, nonnegative=True)
    a, one = sp.Rational(1, 10), sp.eye(2)
    return ConstrainedChain(
        nodes=bars + 1,
        here=(x, y),
        before=(x_before, y_before),
        node=k,
        joints=[(x - x_before) ** 2 + (y - y_before) ** 2 - length_**2],
        own=[(x - k * length_) ** 2 + y**2 - length_**2],
        mass=m / 3 * one,
        joint_mass=m / 6 * sp.kronecker_product(sp.Matrix([[2, 1], [1, 2]]), one),
        pull=m * gamma,
        U=y / 2,
        joint_U=(y_before + y) / 2,
        parameters={m: mass, length_: length, gamma: gravity},
        speeds=True,
        cases={
            "iftomm": Case(
                q=(k * length_, length_),
                p=(1, 0),
                parameters={"bars": 2},
                about="IFToMM benchmark A02: upright, B moving at 1 m/s; passes the horizontal, where G loses rank, first at t = 0.71",
                # The exact motion is known in the angle, in which nothing is singular: the run can be compared beyond the loss of rank.
                on_singular="continue",
            ),
            "swing": Case(
                q=(k * length_ + length_ * sp.sin(a), -length_ * sp.cos(a)),
                p=(0, 0),
                about="released at rest 0.1 rad from hanging, any number of linkages: a small swing, far from the horizontal",
            ),
        },
        more=lambda q, p: {"closed_form": closed_form, "chart": angle(q, p, m, length_)},
        drawn=lambda q: picture(q, length_),
    )


def pivots(bars: int, length: sp.Expr) -> list[sp.Matrix]:
    """Return the pivots A_i, i = 0, ..., N."""
    return [sp.Matrix([i * length, 0]) for i in range(bars + 1)]


def couplers(bars: int) -> list[int]:
    """Return how many couplers end at each B_i."""
    return [(i > 0) + (i < bars) for i in range(bars + 1)]


def shares(bars: int) -> list[sp.Expr]:
    """Return the share of each B_i in a parallel motion's momentum, for bars of mass 1: a third of an upright, half of each coupler."""
    return [sp.Rational(1, 3) + sp.Rational(number, 2) for number in couplers(bars)]


def parallel(bars: int, length: sp.Expr, direction: tuple[Any, Any]) -> tuple[sp.Expr, ...]:
    """Return positions, shape(2 N + 2,), with all uprights along a unit vector."""
    return tuple(x for pivot in pivots(bars, length) for x in pivot + length * sp.Matrix(direction))


def angle(q: Sequence[sp.Symbol], p: Sequence[sp.Symbol], mass: sp.Expr, length: sp.Expr) -> Chart:
    """Return the chart of the angle theta of all uprights from hanging and its rate omega, through the horizontal as elsewhere.

    ::

        B_i = A_i + length (sin theta, -cos theta)      p = M q'      X^T J X = (sum of the p_i over B_i') length^2 J, constant
    """
    theta, omega = sp.symbols("theta omega", real=True)
    place = sp.Matrix(parallel(len(q) // 2 - 1, length, (sp.sin(theta), -sp.cos(theta))))
    masses = [mass * share for share in shares(len(q) // 2 - 1)]
    return Chart(
        eta=(omega,),
        xi=(theta,),
        p=tuple(masses[i // 2] * x * omega for i, x in enumerate(place.diff(theta))),
        q=tuple(place),
        inverse_eta=((q[0] * sum(p[1::2]) - q[1] * sum(p[0::2])) / (sum(masses) * length**2),),
        inverse_xi=(sp.atan2(q[0], -q[1]),),
    )


def picture(q: Sequence[sp.Symbol], length: sp.Expr) -> Picture:
    """Return the bars, each a rod, and the pivots; their ends A_i and B_i have names."""
    ends = [tuple(q[k : k + 2]) for k in range(0, len(q), 2)]
    ground = [tuple(pivot) for pivot in pivots(len(ends) - 1, length)]
    points = {f"{name}{i}": place for name, places in (("A", ground), ("B", ends)) for i, place in enumerate(places)}
    return Picture(rods=[*zip(ground, ends, strict=True), *pairwise(ends)], fixed=ground, points=points)


def closed_form(t: Any, q0: Sequence[Any], p0: Sequence[Any], parameters: Mapping[str, Any]) -> tuple[list[Any], list[Any]]:
    """Return the exact state (q, p) at time t of a motion with all uprights parallel, correct to mpmath's working precision.

    By Jacobi's elliptic functions; see ``_pendulum_motion.planar``.

    Parameters
    ----------
    t : number
        Time, s; of either sign.
    q0, p0 : sequence of number, shape(2 N + 2,)
        State at time 0, on the constraint manifold, with the accuracy that the result should have.
    parameters : mapping of str to number
        mass (kg), length (m) and gravity (m/s^2), all positive.

    Raises
    ------
    BadInput
        If the uprights are not parallel, or q0 and p0 off the manifold, by more than rounding.
    """
    with mp.workdps(mp.mp.dps + 10):
        m, length, gravity = (mp.mpmathify(parameters[name]) for name in ("mass", "length", "gravity"))
        ends = couplers(len(q0) // 2 - 1)
        own_shares = [m * (mp.mpf(1) / 3 + mp.mpf(number) / 2) for number in ends]
        # The gravity of the equivalent pendulum: weight over inertia of the parallel motion.
        pulled = gravity * m * mp.fsum(mp.mpf(1 + number) / 2 for number in ends) / mp.fsum(own_shares)
        pendulum_state = [q0[0], q0[1]], [mp.fsum(p0[0::2]), mp.fsum(p0[1::2])]
        _require_parallel(q0, p0, _spread(*pendulum_state, own_shares, length), length)
        moved = in_units(planar, t, *pendulum_state, {"mass": mp.fsum(own_shares), "length": length, "gravity": pulled})
        q, p = _spread(*moved, own_shares, length)
    return [+x for x in q], [+x for x in p]


def _spread(b: Sequence[Any], whole: Sequence[Any], shares: Sequence[Any], length: Any) -> tuple[list[Any], list[Any]]:
    """Return (q, p) of all uprights in parallel with the first, which ends at b, and momenta that add up to a whole."""
    q = [x for i in range(len(shares)) for x in (b[0] + i * length, b[1])]
    return q, [share / sum(shares) * x for share in shares for x in whole]


def _require_parallel(q0: Sequence[Any], p0: Sequence[Any], expected: tuple[list[Any], list[Any]], length: Any) -> None:
    q, p = expected
    away = max(abs(a - b) for a, b in zip(q0, q, strict=True)), max(abs(a - b) for a, b in zip(p0, p, strict=True))
    if away[0] > OFF * length * len(q) or away[1] > OFF * (1 + max(map(abs, p))):
        raise BadInput(
            "the closed form of four_bar needs initial values with all uprights parallel; start there, or project them first.",
            "four-bar-uprights-not-parallel",
        )
