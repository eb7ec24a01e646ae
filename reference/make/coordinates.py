"""Coordinates for Taylor series, with the map into them and its inverse."""

from typing import Protocol

from daebench.methods.solvers.taylor_equations import Equations
from daebench.reference.make.stages import Rows, Vector


class Coordinates(Protocol):
    """Coordinates of a motion."""

    @property
    def name(self) -> str:
        """Description that can follow "in"."""

    @property
    def equations(self) -> Equations:
        """Variables and their rates."""

    def entered(self, x: Vector) -> Vector:
        """Return the coordinates of a state."""

    def left(self, rows: Rows) -> Rows:
        """Return the states of rows of the coordinates."""


class Own:
    """The problem's own coordinates, for which both maps are the identity.

    Parameters
    ----------
    equations : list of (expression, expression)
        Variables and their rates.
    """

    name = "the problem's own coordinates"

    def __init__(self, equations: Equations) -> None:
        self.equations = equations

    def entered(self, x: Vector) -> Vector:
        """Return the state itself."""
        return x

    def left(self, rows: Rows) -> Rows:
        """Return the rows themselves."""
        return rows
