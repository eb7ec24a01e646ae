"""Kinds of arithmetic that fixed-step runs are computed in."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from daebench.errors import BadInput


@dataclass(frozen=True, kw_only=True)
class Precision:
    """NumPy's number types of a run.

    Parameters
    ----------
    states : str
        Type of states, and of all numbers but forces.
    forces : str
        Type in which forces H_q are evaluated.
    """

    states: str
    forces: str

    @property
    def uniform(self) -> bool:
        """Whether all numbers are of one type."""
        return self.states == self.forces

    @property
    def eps(self) -> float:
        """Distance from 1 to the next larger number, of states."""
        return float(np.finfo(self.states).eps)

    @property
    def coarsest_eps(self) -> float:
        """The same of the coarsest numbers that a step takes."""
        return max(self.eps, float(np.finfo(self.forces).eps))


PRECISIONS: Mapping[str, Precision] = {
    "float64": Precision(states="float64", forces="float64"),
    "float32": Precision(states="float32", forces="float32"),
    "mixed": Precision(states="float64", forces="float32"),
}
"""By name. "mixed" is what OpenMM calls so: forces in single precision, integration and constraints in double precision."""

NAMES = "float64, float32 or mixed"


def precision_of(name: str) -> Precision:
    """Return a kind of arithmetic by name; raise :class:`daebench.errors.BadInput` if there is none."""
    if name not in PRECISIONS:
        raise BadInput(f"unknown precision {name!r}; it is {NAMES}.")
    return PRECISIONS[name]
