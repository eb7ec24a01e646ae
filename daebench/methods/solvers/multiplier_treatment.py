"""Common part of IDA's methods on either kind of problem: a formulation, and the treatment of its multipliers in the error test."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from daebench.errors import BadInput, unknown
from daebench.methods.formulations.constrained import Posed
from daebench.methods.solvers.drive import Array, require_native
from daebench.runs.request import Request

TREATMENTS = ("derivative", "atol", "none", "suppress")

UNTESTED = 1e20
"""Absolute tolerance of an unknown that is left out of the error test."""


@dataclass(frozen=True)
class TreatedMultipliers:
    """A formulation posed to IDA with a treatment of its multipliers in the error test."""

    tells_steps: ClassVar = True
    formulation: str
    """One of the formulations of the kind of problem."""
    treatment: str | None = None
    """"derivative", "atol", "none" or "suppress"; by default the better one for the formulation; ``ode`` has no multiplier."""
    kind: ClassVar[str]
    formulations: ClassVar[Collection[str]]
    default_treatments: ClassVar[Mapping[str, str]]

    def __post_init__(self) -> None:
        if self.formulation not in self.formulations:
            raise unknown(self.kind, self.formulation, self.formulations)
        if self.treatment is not None and self.treatment not in TREATMENTS:
            raise unknown("treatment of the multipliers", self.treatment, TREATMENTS)
        if self.formulation == "ode" and self.treatment not in (None, "none"):
            raise BadInput(f"ode has no multipliers, so there is nothing for {self.treatment} to treat; leave the treatment out.")

    @property
    def name(self) -> str:
        """Name in the grammar of methods: ida:formulation, or ida:formulation:treatment where the treatment is not the default."""
        default = self.chosen == self.default_treatments[self.formulation]
        return f"ida:{self.formulation}" if default else f"ida:{self.formulation}:{self.chosen}"

    @property
    def chosen(self) -> str:
        """The treatment, given or by default."""
        return self.treatment or self.default_treatments[self.formulation]

    @property
    def multipliers(self) -> str:
        """Kind of the unknowns for multipliers, as ``pose`` takes it: "derivative" or "plain"."""
        return "derivative" if self.chosen == "derivative" else "plain"

    @property
    def treatment_advice(self) -> str:
        """Advice where a run without a treatment stops early; "" where there is one, or no multiplier."""
        if self.chosen == "none" and self.formulation != "ode":
            return "take the multipliers out of the error test with the treatment atol or derivative"
        return ""

    @property
    def untested(self) -> Collection[str]:
        """Names of the blocks of unknowns that the treatments ``atol`` and ``suppress`` leave out of the error test."""
        return ("lam", "mu")

    def check_treatment(self, request: Request) -> None:
        """Refuse ``suppress`` where SUNDIALS is not called directly; raise :class:`BadInput`."""
        if self.chosen == "suppress":
            require_native(self.name, "has no way to suppress unknowns", request)

    def suppressed(self, posed: Posed) -> NDArray[np.bool_] | None:
        """Return which unknowns the treatment ``suppress`` declares to be algebraic, shape(n,); None where it is another."""
        return self._left_out(posed) if self.chosen == "suppress" else None

    def tolerances(self, posed: Posed, tol: float) -> Array:
        """Return the absolute tolerances, shape(n,)."""
        return np.where(self._left_out(posed) & (self.chosen == "atol"), UNTESTED, tol)

    def _left_out(self, posed: Posed) -> NDArray[np.bool_]:
        """Return which unknowns are in :attr:`untested`, shape(n,): derivatives as what they are derivatives of."""
        left_out = np.zeros((posed.copies, posed.n // posed.copies), bool)
        for name in self.untested:
            left_out[:, posed.blocks.get(name, slice(0))] = True
        return left_out.ravel()
