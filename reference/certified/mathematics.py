"""What certification asks of the mathematics of a problem, whatever its kind: states are flat lists here, parts one after the other."""

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from daebench.reference.certified.constrained import Constrained
from daebench.reference.certified.definition import Definition
from daebench.reference.certified.poisson import Poisson
from daebench.reference.certified.stages import Rows
from daebench.reference.certified.taylor import Equations

Array = NDArray[np.float64]
Vector = list[Any]


class Coordinates(Protocol):
    """Other coordinates for the same motion."""

    @property
    def name(self) -> str:
        """What they are, in words that follow "in"."""

    @property
    def equations(self) -> Equations:
        """Variables and their rates."""

    def entered(self, x: Vector) -> Vector:
        """Return the other coordinates of a state."""

    def left(self, rows: Rows) -> Rows:
        """Return the states of rows of the other coordinates."""


class Mathematics(Protocol):
    """One definition at mpmath's working precision, and its equations in quadruple precision."""

    series: str
    """What the Taylor series in the problem's own coordinates is, in words."""

    zero: tuple[str, ...]
    """Conserved quantities that vanish; of the others the start has the value."""

    regular: str
    """What must not lose rank along the motion; "" if nothing can."""

    perturbations: str
    """What ``directions`` are, in words."""

    @property
    def closed_form(self) -> bool:
        """Whether the motion has a closed form."""

    @property
    def equations(self) -> Equations:
        """Variables of the problem's own coordinates and their rates."""

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
    return KINDS[definition.scene.sheet.KIND](definition)
