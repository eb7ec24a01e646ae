"""Springs and dampers between two points: their potentials, and the forces of those without one."""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import sympy as sp

from daebench.joints.exact import Values, exact, number, simplified
from daebench.joints.frames import Column
from daebench.systems.picture import Exact


class NegativeDamping(UserWarning):
    """A damper that feeds energy in."""


@dataclass(frozen=True)
class Spring:
    """A spring between two points, with a damper beside it: U = stiffness/2 (l - length)^2, and a force -damping l' along it.

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


def spring_energy(spring: Spring, columns: Mapping[str, Column]) -> sp.Expr:
    """Return U of a spring."""
    a, b = columns[spring.first], columns[spring.second]
    gap, reference = b.now - a.now, b.reference - a.reference
    rest = sp.sqrt(simplified(reference.dot(reference))) if spring.length is None else exact(spring.length)
    return exact(spring.stiffness) / 2 * (sp.sqrt(gap.dot(gap)) - rest) ** 2


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
        slope = gap.T * gap.jacobian(q)
        total -= c / gap.dot(gap) * (slope * sp.Matrix(v))[0] * slope.T
    return list(total) if damped else None
