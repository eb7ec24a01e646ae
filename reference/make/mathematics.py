"""Functions of a problem of either kind that certification evaluates. States are flat lists here, with one part after another."""

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
    """Conserved quantities that vanish; the others have their value at the start."""

    crosses: bool
    """Whether it may still lose rank, because only functions derived from the state use it."""

    perturbations: str
    """Description of ``directions``."""

    @property
    def regular(self) -> str:
        """The matrix that must not lose rank along the motion; "" if there is none."""

    @property
    def series(self) -> str:
        """Description of the Taylor series in the first coordinates."""

    @property
    def closed_form(self) -> bool:
        """Whether the motion has a closed form."""

    @property
    def first(self) -> Coordinates:
        """The coordinates in which the motion is computed: the problem's own, or those of its chart if G may lose rank."""

    @property
    def other(self) -> Coordinates | None:
        """The coordinates in which the motion is computed a second time, if there are any."""

    @property
    def directions(self) -> Array:
        """A basis of the perturbations of the start whose growth is computed, one per column."""

    def exact(self, times: Sequence[Any]) -> Rows:
        """Return the closed form at times, the first 0."""

    def parts(self, x: Vector) -> dict[str, Vector]:
        """Return all parts of a row by name."""

    def conserved(self, x: Vector) -> dict[str, Vector]:
        """Return the conserved quantities by name."""

    def smallest_singular_value(self, x: Vector) -> float:
        """Return the smallest singular value of the matrix that must not lose rank."""


KINDS: dict[str, type[Constrained] | type[Poisson]] = {"constrained": Constrained, "poisson": Poisson}


def mathematics(definition: Definition) -> Mathematics:
    """Return the mathematics of a definition."""
    return KINDS[definition.ivp.facts.KIND](definition)
