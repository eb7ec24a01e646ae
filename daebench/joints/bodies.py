"""Bodies as they are declared: the names of the points and directions that are fixed in each, and its mass."""

from collections.abc import Sequence
from dataclasses import dataclass

from daebench.errors import InvalidProblem
from daebench.systems.picture import Exact


@dataclass(frozen=True)
class PointMass:
    """A mass in one point.

    Parameters
    ----------
    point : str
        Name of the point.
    mass : number or Expr
        Mass, kg.
    """

    point: str
    mass: Exact

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the points and directions that are fixed in it."""
        return (self.point,)


class _Uniform:
    """Base of bodies of uniform density between named corners."""

    corners: int
    shape: str
    names: tuple[str, ...]

    def __init__(self, *names: str, mass: Exact) -> None:
        if len(names) < self.corners or any(not isinstance(name, str) for name in names):
            raise InvalidProblem(
                f"a {self.shape} of {', '.join(map(repr, names)) or 'nothing'} needs {self.corners} names of points first.",
                "element-without-points",
            )
        object.__setattr__(self, "names", names)
        object.__setattr__(self, "mass", mass)


@dataclass(frozen=True, init=False)
class Rod(_Uniform):
    """A thin uniform rod between two points: M = mass/6 (2, 1; 1, 2), and one constraint, its length.

    Parameters
    ----------
    *names : str
        Its two ends, and then further points on it, which need no unknowns.
    mass : number or Expr
        Mass, kg.
    """

    corners, shape = 2, "Rod"
    names: tuple[str, ...]
    mass: Exact


@dataclass(frozen=True, init=False)
class Plate(_Uniform):
    """A thin uniform triangle between three points.

    Parameters
    ----------
    *names : str
        Its three corners, and then further points in its plane, which need no unknowns.
    mass : number or Expr
        Mass, kg.
    """

    corners, shape = 3, "Plate"
    names: tuple[str, ...]
    mass: Exact


@dataclass(frozen=True, init=False)
class Body:
    """A rigid body of any mass, centre and inertia.

    In the plane it is two points, or a point and a direction: four unknowns and one constraint. In space it is four points and directions,
    not in one plane: twelve unknowns and six constraints. Directions that are missing are added to it, and what it shares with
    other bodies, or with the ground, is counted once.

    Parameters
    ----------
    *names : str
        Names of points and directions that are fixed in it, a point first.
    mass : number or Expr
        Mass, kg.
    centre : str, or point
        Centre of mass at the reference position: the name of one of its points, or coordinates.
    inertia : number or Expr, or three, or three rows of three
        Moment of inertia about the centre, kg m^2, in the plane; in space the three about the axes at the reference position, or the
        tensor.
    """

    names: tuple[str, ...]
    mass: Exact
    centre: str | Sequence[Exact]
    inertia: Exact | Sequence[Exact] | Sequence[Sequence[Exact]]

    def __init__(
        self, *names: str, mass: Exact, centre: str | Sequence[Exact], inertia: Exact | Sequence[Exact] | Sequence[Sequence[Exact]]
    ) -> None:
        if not names or any(not isinstance(name, str) for name in names):
            raise InvalidProblem(
                f"a {type(self).__name__} needs the name of a point that is fixed in it; give one first.", "body-without-point"
            )
        for name, value in (("names", names), ("mass", mass), ("centre", centre), ("inertia", inertia)):
            object.__setattr__(self, name, value)


@dataclass(frozen=True, init=False)
class QuaternionBody(Body):
    """A rigid body in space whose orientation is a unit quaternion: four unknowns and one constraint.

    Its other unknowns are the three of its centre, or none where the ground has one of its points. Points that it shares with other bodies
    are held together by constraints. M depends on q. T has gauge/2 (d(q.q)/dt)^2 more, which is 0: H has (q.p)^2/(8 gauge).

    Parameters
    ----------
    *names, mass, centre, inertia
        As of a :class:`Body`.
    gauge : number or Expr, optional
        A moment of inertia, kg m^2, on which motions do not depend; by default the mean one about the centre.
    """

    gauge: Exact | None

    def __init__(
        self,
        *names: str,
        mass: Exact,
        centre: str | Sequence[Exact],
        inertia: Sequence[Exact] | Sequence[Sequence[Exact]],
        gauge: Exact | None = None,
    ) -> None:
        super().__init__(*names, mass=mass, centre=centre, inertia=inertia)
        object.__setattr__(self, "gauge", gauge)


AnyBody = PointMass | Rod | Plate | Body
"""Bodies and point masses."""
