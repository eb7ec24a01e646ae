"""Functions of a problem of either kind that certification evaluates; states are flat lists here, parts one after the other."""

from collections.abc import Sequence
from typing import Any, Protocol

from daebench.reference.keep.definition import Definition
from daebench.reference.make.constrained import Constrained
from daebench.reference.make.coordinates import Coordinates
from daebench.reference.make.poisson import Poisson
from daebench.reference.make.stages import Rows, Vector
from daebench.runs.ivp import Array


class Mathematics(Protocol):
    """One definition at mpmath's working precision, and its equations in quadruple precision."""

    zero: tuple[str, ...]
    """Conserved quantities that vanish; of the others the start has the value."""

    crosses: bool
    """Whether it may do so all the same, for nothing but what is derived from the state goes through it."""

    perturbations: str
    """What ``directions`` are, in words."""

    @property
    def regular(self) -> str:
        """What must not lose rank along the motion; "" if nothing can."""

    @property
    def series(self) -> str:
        """What the Taylor series in the first coordinates is, in words."""

    @property
    def closed_form(self) -> bool:
        """Whether the motion has a closed form."""

    @property
    def first(self) -> Coordinates:
        """The coordinates in which the motion is made: the problem's own, or where G may lose rank those of its chart."""

    @property
    def other(self) -> Coordinates | None:
        """The coordinates in which the motion is made a second time, if there are any."""

    @property
    def directions(self) -> Array:
        """A basis of the perturbations of the start that are let grow, one a column."""

    def exact(self, times: Sequence[Any]) -> Rows:
        """Return the closed form at times, the first 0."""

    def parts(self, x: Vector) -> dict[str, Vector]:
        """Return all parts of a row by name."""

    def conserved(self, x: Vector) -> dict[str, Vector]:
        """Return by name what does not change along the motion."""

    def smallest_singular_value(self, x: Vector) -> float:
        """Return that of what must not lose rank."""


KINDS: dict[str, type[Constrained] | type[Poisson]] = {"constrained": Constrained, "poisson": Poisson}


def mathematics(definition: Definition) -> Mathematics:
    """Return the mathematics of a definition."""
    return KINDS[definition.ivp.facts.KIND](definition)
