"""Parts of a state of each kind of problem: names of columns, of arrays, and of the states of external programs."""

from collections.abc import Collection
from dataclasses import dataclass


@dataclass(frozen=True)
class StateLayout:
    """The parts of a stored row, by name. A component is a name with a number from 1; the initial value of a part is a name with 0.

    Parameters
    ----------
    state : tuple of str
        Parts of a state, in the order in which they are stored.
    external : tuple of str
        The same parts in the order in which external programs take and return them.
    derived : tuple of str
        Functions of the state that are stored after it.
    """

    state: tuple[str, ...]
    external: tuple[str, ...]
    derived: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """All parts in the order in which they are stored."""
        return self.state + self.derived

    @property
    def told(self) -> str:
        """A state as external programs pass it, in words: (p, q), or y."""
        return f"({', '.join(self.external)})" if len(self.external) > 1 else self.external[0]


CONSTRAINED = StateLayout(("q", "p"), ("p", "q"), ("lam",))
"""Positions and momenta, and the multipliers that follow from them."""

POISSON = StateLayout(("y",), ("y",))
"""The state of a Poisson system."""

KINDS = {"constrained": CONSTRAINED, "poisson": POISSON}
"""State layouts by the kind of a problem."""


def layout_of_columns(columns: Collection[str]) -> StateLayout:
    """Return the parts of a file with these columns."""
    return POISSON if "y1" in columns else CONSTRAINED
