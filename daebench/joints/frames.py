"""A body's frame: every point fixed in a body is linear in its points and directions, the natural coordinates.

::

    r = sum_k c_k e_k,      X = sum_k c_k E_k      E_k: points and directions of the body at the reference position, e_k: anywhere

The coefficients c of a place X follow once and for all from the reference position; those of a point add up to 1 over the points. In the
plane two points, or a point and a direction, have a third direction with them: the first turned by a right angle.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import sympy as sp

from daebench.errors import InvalidProblem
from daebench.joints.exact import CLOSE, Values, levelled, numbers, rank, simplified, spread

QUARTER_TURN = sp.Matrix([[0, -1], [1, 0]])


@dataclass(frozen=True)
class Column:
    """A point (weight 1) or direction (weight 0) that is fixed in a body."""

    name: str
    """Name of the point or direction."""
    reference: sp.Matrix
    """Place or direction at the reference position; shape (2, 1) or (3, 1)."""
    now: sp.Matrix
    """Place or direction at any position: linear in the unknowns."""
    weight: int
    """1 of a point, 0 of a direction."""

    @property
    def homogeneous(self) -> sp.Matrix:
        """The reference with the weight below it."""
        return sp.Matrix([*self.reference, self.weight])


@dataclass(frozen=True)
class Frame:
    """Points and directions of one body of which everything fixed in it is made."""

    body: str
    """Name of the body."""
    columns: tuple[Column, ...]
    """The points and directions, including the additional direction of a plane body."""
    declared: int
    """Number of those that are declared."""
    values: Values
    """Parameters at which ranks are decided."""
    others: tuple[frozenset[str], ...] = ()
    """Names in each earlier body that has some of the same."""

    @property
    def basis(self) -> sp.Matrix:
        """The homogeneous references, side by side."""
        return sp.Matrix.hstack(*(column.homogeneous for column in self.columns))

    @property
    def size(self) -> float:
        """Largest distance of its points from the first of them, m; 1 if there is only one."""
        return spread(numbers(sp.Matrix.hstack(*(x.reference for x in self.columns if x.weight)), self.values)) or 1.0

    def holds(self, place: sp.Matrix, weight: int) -> bool:
        """Return whether a point (weight 1) or direction (weight 0) is a combination of the columns."""
        columns = levelled(numbers(self.basis.row_join(sp.Matrix([*place, weight])), self.values))
        basis, target = columns[:, :-1], columns[:, -1]
        c = np.linalg.lstsq(basis, target, rcond=None)[0]
        return bool(np.linalg.norm(basis @ c - target) <= CLOSE)

    def coefficients(self, place: sp.Matrix, weight: int) -> list[sp.Expr]:
        """Return the c of a point or direction, exact."""
        target = sp.Matrix([*place, weight])
        for k, column in enumerate(self.columns):
            if column.homogeneous == target:
                return [sp.S.One if j == k else sp.S.Zero for j in range(len(self.columns))]
        if not self.holds(place, weight):
            what = "point" if weight else "direction"
            raise InvalidProblem(
                f"the {what} {tuple(place)} is not fixed in {self.body!r} by only {', '.join(x.name for x in self.columns)}; "
                "give the body one more point or direction, for example as a Body.",
                "frame-underdetermined",
            )
        # Columns may be fewer than rows: the place was found to fit, so that any independent rows give its coefficients.
        rows = independent_rows(self.basis, self.values)
        solved = self.basis.extract(rows, list(range(len(self.columns)))).LUsolve(target.extract(rows, [0]))
        return [sp.cancel(simplified(c)) for c in solved]

    def placed(self, place: sp.Matrix, weight: int) -> sp.Matrix:
        """Return a point or direction of the reference position at any position, linear in the unknowns."""
        c = self.coefficients(place, weight)
        return sum((x * column.now for x, column in zip(c, self.columns, strict=True)), sp.zeros(len(place), 1))

    def at(self, place: sp.Matrix) -> sp.Matrix:
        """Return the place of a point of the body."""
        return self.placed(place, 1)

    def along(self, direction: sp.Matrix) -> sp.Matrix:
        """Return a direction of the body at any position."""
        return self.placed(direction, 0)

    @property
    def directions(self) -> list[tuple[sp.Matrix, sp.Matrix]]:
        """Directions that span all directions in the body: at the reference position and at any."""
        first = self.columns[0]
        return [(x.reference - x.weight * first.reference, x.now - x.weight * first.now) for x in self.columns[1:]]

    def rigidity(self) -> list[tuple[str, sp.Expr]]:
        """Return the quantities that a rigid body keeps, in words and as expressions: distances, and products of directions."""
        declared = self.columns[: self.declared]
        points, directions = [x for x in declared if x.weight], [x for x in declared if not x.weight]
        # Between all pairs: with four points six distances, as many as a rigid body in space needs.
        pairs = [(a, b) for a, b in combinations(points, 2) if not self._kept(a, b)]
        spans = [(f"the distance of {a.name} and {b.name}", b.reference - a.reference, b.now - a.now) for a, b in pairs]
        conditions = [(words, now.dot(now) - simplified(was.dot(was))) for words, was, now in spans]
        legs = [(b, b.reference - points[0].reference, b.now - points[0].now) for b in points[1:]]
        for k, u in enumerate(directions):
            ways = [leg for leg in legs if not self._kept(u, points[0], leg[0])]
            ways += [(v, v.reference, v.now) for v in directions[:k] if not self._kept(u, v)]
            conditions += [
                (f"the angle of {u.name} and {v.name}", u.now.dot(now) - simplified(u.reference.dot(was))) for v, was, now in ways
            ]
            if not self._kept(u):
                conditions.append((f"the length of {u.name}", u.now.dot(u.now) - simplified(u.reference.dot(u.reference))))
        return [(f"{words} in {self.body}", expression) for words, expression in conditions]

    def _kept(self, *columns: Column) -> bool:
        """Return whether an earlier body has all of these, so that it keeps their distances and angles already."""
        return any(all(column.name in names for column in columns) for names in self.others)


def rotation(q: sp.Matrix) -> sp.Matrix:
    """Return the rotation of a quaternion times q.q, shape(3, 3): quadratic in q, so that places and M are polynomials."""
    a, u = q[0], sp.Matrix(q[1:])
    cross = sp.Matrix([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])
    return ((a * a - u.dot(u)) * sp.eye(3) + 2 * u * u.T + 2 * a * cross).applyfunc(sp.expand)


def framed(body: str, columns: Sequence[Column], values: Values, others: tuple[frozenset[str], ...] = ()) -> Frame:
    """Return the frame of these columns; in the plane with the direction across the first two of them."""
    if len(columns) == 2 and len(columns[0].reference) == 2:
        first, second = columns
        was, now = second.reference - second.weight * first.reference, second.now - second.weight * first.now
        across = Column(f"across {second.name}", QUARTER_TURN * was, QUARTER_TURN * now, 0)
        return Frame(body, (*columns, across), 2, values, others)
    return Frame(body, tuple(columns), len(columns), values, others)


def fixed_frame(dimension: int, values: Values) -> Frame:
    """Return the frame of the ground."""
    origin, axes = sp.zeros(dimension, 1), sp.eye(dimension)
    columns = [Column("origin", origin, origin, 1)]
    columns += [Column(f"axis {k + 1}", axes[:, k], axes[:, k], 0) for k in range(dimension)]
    return Frame("ground", tuple(columns), dimension + 1, values)


def independent_rows(matrix: sp.Matrix, values: Values) -> list[int]:
    """Return the first rows of the homogeneous references of a frame, side by side, that are independent."""
    entries = numbers(matrix, values)
    directions, points = entries[:, entries[-1] == 0], entries[:-1, entries[-1] != 0]
    # Directions get the length by which points are apart, because rows are compared with each other.
    entries[:, entries[-1] == 0] = directions / np.linalg.norm(directions, axis=0) * (spread(points) or 1.0)
    rows: list[int] = []
    for k in range(entries.shape[0]):
        if rank(entries[[*rows, k]].T) > len(rows):
            rows.append(k)
    return rows
