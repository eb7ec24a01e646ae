"""Where a mechanism starts: places and velocities of some of its points, from which those of all follow."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import sympy as sp
from sympy.polys.matrices import DomainMatrix

from daebench.errors import InvalidProblem, unknown
from daebench.joints.exact import CLOSE, Array, Values, exact, numbers, rank, simplified, vector
from daebench.joints.frames import QUARTER_TURN, Frame
from daebench.joints.placing import Places, gone
from daebench.systems.picture import Exact


@dataclass(frozen=True, kw_only=True)
class Start:
    """Initial values of a mechanism.

    Parameters
    ----------
    at : mapping of str to point
        Points and directions that are not at their reference place: those that have unknowns of their own. That of a QuaternionBody
        ``top`` is ``top.quaternion``, four numbers, the real part first.
    velocity : mapping of str to vector
        Velocities of some points, m/s. All others follow: of the motions that the joints allow, it is the one of least kinetic energy.
    angles : mapping of str to number or Expr
        Angles at the start, rad. Points say where bodies are, so that whole turns are all that is added; angles that are not named are
        between -pi and pi.
    spin : mapping of str to number or vector
        Angular velocities of some bodies, rad/s: a number in the plane, a vector in space.
    parameters, about, on_singular
        As for :class:`daebench.Case`.
    """

    at: Mapping[str, Sequence[Exact]] = field(default_factory=dict)
    velocity: Mapping[str, Sequence[Exact]] = field(default_factory=dict)
    angles: Mapping[str, Exact] = field(default_factory=dict)
    spin: Mapping[str, Any] = field(default_factory=dict)
    parameters: Mapping[str, float] = field(default_factory=dict)
    about: str = ""
    on_singular: str = "stop"


def positions(case: str, start: Start, places: Places) -> list[sp.Expr]:
    """Return q at the start, shape(d,)."""
    q0 = dict(zip(places.q, places.reference, strict=True))
    for name, place in start.at.items():
        unknowns = places.owners.get(name) if name in places.declared or name in places.quaternions else None
        if unknowns is None:
            places.given(name)
            free = ", ".join(x for x in places.owners if x in places.declared or x in places.quaternions)
            raise InvalidProblem(f"case {case!r} places {name}, which depends on others; place some of {free}.", "case-places-dependent")
        where = (_quaternion if name in places.quaternions else _as_long)(f"{name} of case {case!r}", place, places.dimension)
        if name in places.guides:
            where = gone(places.guides[name], where)
        q0 |= dict(zip(unknowns, where, strict=True))
    return list(q0.values())


def velocities(
    case: str,
    start: Start,
    places: Places,
    M: sp.Matrix,
    G0: sp.Matrix,
    g_t: sp.Matrix,
    at: Mapping[sp.Symbol, sp.Expr],
    values: Values,
    labels: Sequence[str],
) -> list[sp.Expr]:
    """Return v at the start, shape(d,): G v = -g_t, the given velocities, and the least kinetic energy otherwise."""
    rows, right = G0, -g_t.xreplace(at)
    for name, velocity in start.velocity.items():
        there = places.given(name).reference
        rows = rows.col_join(places.columns[name].now.jacobian(places.q).xreplace(at))
        right = right.col_join(_as_long(f"velocity of {name} in case {case!r}", velocity, len(there)))
    for name, spin in start.spin.items():
        for was, rate in _turning(case, places.frames, name, spin):
            rows = rows.col_join(was.jacobian(places.q).xreplace(at))
            right = right.col_join(rate.xreplace(at))
    if not any(right):
        return [sp.S.Zero] * len(places.q)
    # Unknowns in units of how far they may go, and rows of length 1: a rank and a residual then depend on no unit.
    A = numbers(rows, values) * places.scales
    lengths = np.linalg.norm(A, axis=1)
    lengths[lengths == 0] = 1.0
    A, b = A / lengths[:, None], numbers(right, values).ravel() / lengths
    chosen = _independent(A)
    if np.abs(A @ np.linalg.lstsq(A[chosen], b[chosen], rcond=None)[0] - b).max() > CLOSE * np.abs(b).max():
        if start.velocity or start.spin:
            raise InvalidProblem(
                f"the velocities of case {case!r} contradict the joints; give fewer of them, or others.", "velocities-against-joints"
            )
        raise _contradiction(case, labels, A, b)
    return solved(M, rows.extract(chosen, list(range(rows.cols))), right.extract(chosen, [0]))


def _contradiction(case: str, labels: Sequence[str], A: Array, b: Array) -> InvalidProblem:
    """Return the error for the driver that contradicts the equations before it: the first row with which A v = b has no solution.

    Rows are those of the joints, A = G and b = -g_t, each in its own unit, with the words for what each keeps.
    """
    b = b / np.abs(b).max()
    rows = [k for k in range(len(A)) if b[k] == 0]
    for driven in (k for k in range(len(A)) if b[k] != 0):
        # Equations with b = 0 hold at rest; only drivers ask for a velocity.
        rows.append(driven)
        if rank(np.column_stack([A, b])[rows].T) > rank(A[rows].T):
            break
    return InvalidProblem(
        f"{labels[rows[-1]]} contradicts the other joints and drivers: no velocities at the start of case {case!r} satisfy all of them; "
        "leave out a driver, or change its start to agree with them.",
        "driver-contradicts-others",
    )


def solved(M: sp.Matrix, S: sp.Matrix, right: sp.Matrix) -> list[sp.Expr]:
    """Return the exact v with S v = right and the least v^T M v, for rows S that are independent.

    Numbers on the right that are not rational, such as exp(9.4), are replaced by symbols meanwhile: elimination would multiply them out.
    """
    d = S.cols
    stand_ins = {sp.Dummy(): x for x in right if not x.is_Rational}
    names = {x: name for name, x in stand_ins.items()}
    matrix, target = S, right.applyfunc(lambda x: names.get(x, x))
    # With as many rows as unknowns the velocity is determined, and M plays no part.
    if S.rows < d:
        matrix = sp.Matrix(sp.BlockMatrix([[M, S.T], [S, sp.zeros(S.rows, S.rows)]]))
        target = sp.zeros(d, 1).col_join(target)
    # In a field of rational functions: elimination by expressions would have to ask of each pivot whether it is zero.
    both = DomainMatrix.from_Matrix(matrix.row_join(target).applyfunc(simplified)).to_field()
    left, last = both[:, : matrix.cols], both[:, matrix.cols :]
    return [sp.cancel(x).xreplace(stand_ins) for x in left.lu_solve(last).to_Matrix()[:d, 0]]


def _independent(A: Array) -> list[int]:
    rows: list[int] = []
    for k in range(len(A)):
        if rank(A[[*rows, k]].T) > len(rows):
            rows.append(k)
    return rows


def _as_long(what: str, x: Sequence[Exact], dimension: int) -> sp.Matrix:
    """Return a point or vector of the mechanism's space."""
    column = vector(what, x)
    if len(column) != dimension:
        raise InvalidProblem(f"{what} has {len(column)} coordinates; the mechanism has {dimension}.", "start-vector-dimension")
    return column


def _quaternion(what: str, x: Sequence[Exact], _: int) -> sp.Matrix:
    """Return a quaternion, shape(4, 1)."""
    if isinstance(x, str) or len(x) != 4:
        raise InvalidProblem(f"{what} is {x!r}; give four numbers, the real part first.", "quaternion-malformed")
    return sp.Matrix([exact(entry) for entry in x])


def _turning(case: str, frames: Mapping[str, Frame], name: str, spin: Any) -> list[tuple[sp.Matrix, sp.Matrix]]:
    """Return the directions of a body and how they turn."""
    if name not in frames:
        raise unknown(f"body in the spins of case {case!r}", name, frames)
    frame = frames[name]
    if not frame.directions:
        raise InvalidProblem(
            f"case {case!r} gives the spin of {name}, which has no direction that turns; leave it out.", "spin-without-direction"
        )
    if len(frame.columns[0].reference) == 2:
        return [(now, exact(spin) * QUARTER_TURN * now) for _, now in frame.directions]
    omega = vector(f"spin of {frame.body}", spin)
    return [(now, omega.cross(now)) for _, now in frame.directions]
