"""Springs and dampers between two points: their potentials, and the forces of those without one."""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import sympy as sp

from daebench.errors import InvalidProblem
from daebench.joints.exact import Values, exact, number, simplified
from daebench.joints.frames import Column
from daebench.systems.picture import Exact


class NegativeDamping(UserWarning):
    """A damper that feeds energy in."""


@dataclass(frozen=True)
class Spring:
    """A spring between two points, with a damper beside it: U = stiffness/2 (l - length)^2, and a force -damping l' along it.

    Where the points can only move along the line through both, as a slider and a fixed point on its guide, l has a sign: it is positive at
    the reference position, and U stays smooth where one point passes the other and l changes its sign. Cases start where l is positive.

    Parameters
    ----------
    first, second : str
        Names of the points.
    stiffness : number or Expr
        Its stiffness, N/m.
    length : number or Expr, optional
        Its length without force, m; by default the one at the reference position.
    damping : number or Expr
        Damping, N s/m; a negative one feeds energy in, which a warning says.
    """

    first: str
    second: str
    stiffness: Exact = 0
    length: Exact | None = None
    damping: Exact = 0


@dataclass(frozen=True)
class Damper:
    """A damper between two points: a force -damping l' along the line between them.

    Parameters
    ----------
    first, second : str
        Names of the points.
    damping : number or Expr
        Damping, N s/m; a negative one feeds energy in, which a warning says.
    """

    first: str
    second: str
    damping: Exact


Force = Spring | Damper


def spring_energy(spring: Spring, columns: Mapping[str, Column], values: Values) -> sp.Expr:
    """Return U of a spring."""
    gap, rest = columns[spring.second].now - columns[spring.first].now, rest_length(spring, columns)
    # Without a length at rest U is a polynomial, smooth also where the points meet.
    if rest == 0:
        return exact(spring.stiffness) / 2 * gap.dot(gap)
    along = length_along(spring, columns, values)
    return exact(spring.stiffness) / 2 * ((sp.sqrt(gap.dot(gap)) if along is None else along) - rest) ** 2


def sides(springs: Sequence[Spring], columns: Mapping[str, Column], values: Values) -> list[tuple[str, sp.Expr]]:
    """Return the lengths that have a sign, with words for each: cases start where all are positive."""
    lengths = [
        (f"the Spring of {x.first} and {x.second}", length_along(x, columns, values)) for x in springs if rest_length(x, columns) != 0
    ]
    return [(words, length) for words, length in lengths if length is not None]


def rest_length(spring: Spring, columns: Mapping[str, Column]) -> sp.Expr:
    """Return the length of a spring without force."""
    reference = columns[spring.second].reference - columns[spring.first].reference
    return sp.sqrt(simplified(reference.dot(reference))) if spring.length is None else exact(spring.length)


def length_along(force: Force, columns: Mapping[str, Column], values: Values) -> sp.Expr | None:
    """Return the length of a spring or damper whose ends stay on one line, with a sign, linear in q; None of any other."""
    a, b = columns[force.first], columns[force.second]
    gap = (b.now - a.now).applyfunc(sp.expand)
    k = next((k for k, x in enumerate(gap) if x != 0), None)
    if k is None:
        return None
    ways = (gap / gap[k]).applyfunc(sp.cancel)
    # The direction of the gap depends on the position: it is no line.
    if ways.free_symbols - {*values}:
        return None
    at_reference = number((b.reference - a.reference)[k], values)
    if at_reference == 0 and isinstance(force, Spring) and rest_length(force, columns) != 0:
        raise InvalidProblem(
            f"the Spring of {force.first} and {force.second} has length 0 at the reference position, and both points stay on one line, so "
            "that its direction is not known; place them apart.",
            "spring-of-length-zero",
        )
    return gap[k] * sp.sqrt(simplified(ways.dot(ways))) * (-1 if at_reference < 0 else 1)


def damping_force(
    dampers: Sequence[Force], columns: Mapping[str, Column], q: Sequence[sp.Symbol], v: Sequence[sp.Symbol], values: Values
) -> list[sp.Expr] | None:
    """Return the generalised forces -c l' dl/dq of all dampers, shape(d,), with l' = dl/dq v; None where none damps."""
    total, damped = sp.zeros(len(q), 1), False
    for damper in dampers:
        c = exact(damper.damping)
        if c == 0:
            continue
        damped = True
        if number(c, values) < 0:
            text = f"the damper between {damper.first} and {damper.second} has negative damping {c}, so it adds energy."
            warnings.warn(text, NegativeDamping, stacklevel=3)
        gap = columns[damper.second].now - columns[damper.first].now
        along = length_along(damper, columns, values)
        # l dl/dq in place of dl/dq, divided by l^2 at the end: this avoids the root of l.
        slope, square = (gap.T * gap.jacobian(q), gap.dot(gap)) if along is None else (sp.Matrix([along]).jacobian(q), sp.S.One)
        total -= c / square * (slope * sp.Matrix(v))[0] * slope.T
    return list(total) if damped else None
