"""Unknowns that the error test of a solver of SUNDIALS sees: treatments of multipliers, and systems in time.

In a system in time these are the unknowns of the equations as they are written. The test is on the root of the mean of squares over all n
unknowns, and the time and p_t are two that nobody has declared. Their weights are made so small that they add nothing, or hardly
anything, and all others so much larger that the mean is over the n - 2 others::

    sum (w_i e_i)^2 / n,   w_i = sqrt(n / (n - 2)) / (rtol |y_i| + atol_i)

A run then takes the steps that it takes on the same equations with t as the independent variable.
"""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from daebench.errors import BadInput, unknown
from daebench.methods.formulations.constrained import Dae, Posed
from daebench.methods.solvers.drive import Array, require_native
from daebench.runs.request import Request

TREATMENTS = ("derivative", "atol", "none", "suppress")

UNTESTED = 1e20
"""Absolute tolerance of an unknown that is left out of the error test."""

RECEIVED, RECEIVED_FAST = 1e6, 1e8
"""Absolute tolerance of p_t in tolerances of the run, and the one where velocities are left out of the error test.

Without any, Newton's iteration ends before p_t has converged, and the rest grows from step to step, up to 1e18 J: order 5 extrapolates it.
"""


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
            raise BadInput(
                f"ode has no multipliers, so there is nothing for {self.treatment} to treat; leave the treatment out.",
                "ode-has-no-treatment",
            )

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


def of_declared_unknowns(posed: Posed, tol: float, atol: Array) -> tuple[float, Array]:
    """Return the tolerances for a test on declared unknowns alone, as they are where nothing else is among the unknowns.

    Shapes: atol (n,).
    """
    if not (isinstance(posed, Dae) and posed.ivp.facts.EXTENDED):
        return tol, atol
    added = [posed.blocks[name].stop - 1 for name in ("q", "v")]
    share = math.sqrt(1 - len(added) * posed.copies / posed.n)
    declared = np.where(atol < UNTESTED, share * atol, atol).reshape(posed.copies, -1)
    declared[:, added] = UNTESTED, tol * (RECEIVED if atol[added[1]] < UNTESTED else RECEIVED_FAST)
    return share * tol, declared.ravel()
