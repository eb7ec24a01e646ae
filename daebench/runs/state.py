"""States of systems: the vectors that they consist of, what a run monitors of them, and their order in files."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property


@dataclass(frozen=True)
class State:
    """Vectors of a state, by name. A component is a name with a number from 1; an initial value is a name with 0.

    States are the same if their kinds are: those without constraints are of the constrained kind.
    """

    name: str
    """Kind of the problem: "constrained" or "poisson"."""
    words: str = field(compare=False)
    """Such a problem in a sentence."""
    vectors: tuple[str, ...] = field(compare=False)
    """Vectors in the order in which a state is stored, and external programs take and return it. The last holds positions or coordinates,
    in which a motion is drawn.
    """
    monitors: tuple[str, ...] = field(compare=False)
    """Quantities that a run can monitor."""
    columns: tuple[str, ...] = field(compare=False)
    """The vectors in the order in which files have them, positions first."""
    gradient: tuple[str, ...] = field(compare=False)
    """Derivatives of H with respect to the vectors."""
    derived: tuple[str, ...] = field(default=(), compare=False)
    """Functions of the state that references have after it."""

    @property
    def position(self) -> str:
        """Name of the vector of positions, or of coordinates."""
        return self.vectors[-1]

    @cached_property
    def starts(self) -> tuple[str, ...]:
        """Names of initial values, in the order of the vectors."""
        return tuple(f"{name}0" for name in self.vectors)

    @property
    def conserved(self) -> str:
        """Monitored quantity that the exact motion conserves besides H: "manifold", "casimirs", or "integrals" where there is neither."""
        return self.monitors[1]

    @property
    def stored(self) -> tuple[str, ...]:
        """Vectors and functions of the state in the order in which references have them."""
        return self.columns + self.derived

    @property
    def arguments(self) -> str:
        """The vectors as arguments of a function."""
        return ", ".join(self.vectors)

    @property
    def as_tuple(self) -> str:
        """A state as external programs pass it, in words: (p, q), or y."""
        return f"({self.arguments})" if len(self.vectors) > 1 else self.arguments

    @property
    def listed(self) -> str:
        """The vectors in a sentence."""
        return " and ".join(self.vectors)


CONSTRAINED = State(
    name="constrained",
    words="a constrained problem",
    vectors=("p", "q"),
    monitors=("energy", "manifold", "integrals"),
    columns=("q", "p"),
    gradient=("H_p", "H_q"),
    derived=("lam",),
)
"""Momenta and positions on the manifold g = 0, G H_p = 0, and the multipliers that follow from them."""

FREE = replace(CONSTRAINED, words="a problem without constraints", monitors=("energy", "integrals"), derived=())
"""Momenta and positions where there are no constraints."""

POISSON = State(
    name="poisson",
    words="a Poisson system",
    vectors=("y",),
    monitors=("energy", "casimirs", "integrals"),
    columns=("y",),
    gradient=("H_y",),
)
"""Coordinates of a Poisson system."""

STATES: Mapping[str, State] = {state.name: state for state in (CONSTRAINED, POISSON)}
"""States by the kind of a problem."""


def state_of_columns(columns: Collection[str]) -> State:
    """Return the state that a file with these columns, or arrays, has; without multipliers that of no constraints, of the same kind."""
    if {"y", "y1"} & set(columns):
        return POISSON
    return CONSTRAINED if {"lam", "lam1"} & set(columns) else FREE
