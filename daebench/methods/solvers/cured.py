"""What IDA's methods on either kind of problem share: a formulation, and the cure that keeps multipliers from spoiling the error test."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from daebench.errors import BadInput, unknown
from daebench.methods.formulations.constrained import Posed
from daebench.methods.solvers.drive import Array

CURES = ("derivative", "atol", "none")

UNTESTED = 1e20
"""Absolute tolerance of an unknown that is left out of the error test."""


@dataclass(frozen=True)
class Cured:
    """A formulation posed to IDA under a cure.

    Parameters
    ----------
    formulation : str
        One of the formulations of the kind of problem.
    cure : str, optional
        "derivative", "atol" or "none"; by default the better one for the formulation. ``ode`` has no multiplier to cure.

    Raises
    ------
    BadInput
        If the formulation or the cure is unknown, or a cure is asked for on ``ode``.
    """

    formulation: str
    cure: str | None = None
    knob = "tol"
    kind: ClassVar[str]
    formulations: ClassVar[Collection[str]]
    default_cures: ClassVar[Mapping[str, str]]

    def __post_init__(self) -> None:
        if self.formulation not in self.formulations:
            raise unknown(self.kind, self.formulation, self.formulations)
        if self.cure is not None and self.cure not in CURES:
            raise unknown("cure", self.cure, CURES)
        if self.formulation == "ode" and self.cure not in (None, "none"):
            raise BadInput(f"ode has no multipliers, so there is nothing for {self.cure} to cure; leave the cure out.")

    @property
    def name(self) -> str:
        """Name in the grammar of methods: ida:formulation, or ida:formulation:cure where the cure is not the default."""
        default = self.chosen == self.default_cures[self.formulation]
        return f"ida:{self.formulation}" if default else f"ida:{self.formulation}:{self.chosen}"

    @property
    def chosen(self) -> str:
        """The cure, given or by default."""
        return self.cure or self.default_cures[self.formulation]

    @property
    def multipliers(self) -> str:
        """What the unknowns for multipliers are, as ``pose`` takes it: "derivative" or "plain"."""
        return "derivative" if self.chosen == "derivative" else "plain"

    @property
    def uncured(self) -> str:
        """What to do where a run without a cure stops early; "" where there is one, or nothing to cure."""
        if self.chosen == "none" and self.formulation != "ode":
            return "take the multipliers out of the error test with the cure atol or derivative"
        return ""

    @property
    def untested(self) -> Collection[str]:
        """Names of the blocks of unknowns that the cure ``atol`` leaves out of the error test."""
        return ("lam", "mu")

    def tolerances(self, posed: Posed, tol: float) -> Array:
        """Return the absolute tolerances, shape(n,)."""
        found = np.full(posed.n, tol)
        if self.chosen == "atol":
            for name in self.untested:
                found[posed.blocks.get(name, slice(0))] = UNTESTED
        return found
