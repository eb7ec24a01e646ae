"""The mathematics of a constrained problem for certification: HLW (1.18), the chart, constraints and multipliers."""

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np

from daebench.diagnostics.symplecticity import tangent_basis
from daebench.methods.solvers.taylor_equations import own_coordinates
from daebench.reference.keep.definition import Definition
from daebench.reference.make.coordinates import Own
from daebench.reference.make.local import Local
from daebench.reference.make.multiprecision import Functions
from daebench.reference.make.stages import Rows, Vector
from daebench.runs.ivp import Array, ConstrainedIvp


class Constrained:
    """See :class:`daebench.reference.make.mathematics.Mathematics`; a state is q and then p.

    Parameters
    ----------
    definition : Definition
        A constrained problem and its numbers.
    """

    zero: tuple[str, ...] = ("g", "Gv")
    regular = "G M^-1 G^T"
    perturbations = "along the manifold, q measured in max |q| and p in max |p|"

    def __init__(self, definition: Definition) -> None:
        self.definition, self.functions = definition, Functions(definition)
        self.d: int = definition.derivation.d
        self.crosses = definition.crosses

    @property
    def series(self) -> str:
        """What the Taylor series in the first coordinates is, in words."""
        return f"Taylor series {f'in {Local.name}' if self.crosses else 'of HLW (1.18)'} in quadruple precision"

    @property
    def closed_form(self) -> bool:
        """Whether the motion has a closed form."""
        return self.definition.problem.closed_form is not None

    @cached_property
    def first(self) -> Own | Local:
        """The index-reduced equation in q and p, or the problem's chart where G may lose rank, for lam(p, q) stands in that equation."""
        return Local(self.definition) if self.crosses else Own(own_coordinates(self.definition))

    @cached_property
    def other(self) -> Local | None:
        """The problem's chart, if there is no closed form for comparison with the series."""
        return None if self.closed_form or self.definition.problem.chart is None else Local(self.definition)

    @cached_property
    def directions(self) -> Array:
        """A basis of the tangent space at the start, shape(2 d, 2 (d - m))."""
        ivp = self.definition.ivp
        assert isinstance(ivp, ConstrainedIvp)
        return np.roll(tangent_basis(ivp, ivp.p0, ivp.q0), self.d, axis=0)  # positions first

    def exact(self, times: Sequence[Any]) -> Rows:
        """Return the closed form at times, the first 0."""
        form, (q0, p0), values = self.definition.problem.closed_form, self.definition.start_numbers(), self.definition.values()
        return [[*q0, *p0], *([*q, *p] for q, p in (form(t, q0, p0, values) for t in times[1:]))]

    def parts(self, x: Vector) -> dict[str, Vector]:
        """Return q, p and the multipliers lam(p, q), HLW (1.12)."""
        q, p = self._split(x)
        return {"q": q, "p": p, "lam": self.functions.lam(q, p)}

    def conserved(self, x: Vector) -> dict[str, Vector]:
        """Return g, G H_p, energy and first integrals."""
        q, p = self._split(x)
        quantities = {"g": self.functions.g(q), "Gv": self.functions.Gv(q, p), "energy": [self.functions.energy(q, p)]}
        integrals = zip(self.definition.problem.integrals, self.functions.integrals(q, p), strict=True)
        return quantities | {name: [value] for name, value in integrals}

    def smallest_singular_value(self, x: Vector) -> float:
        """Return that of G H_pp G^T."""
        return self.functions.smallest_singular_value(*self._split(x))

    def _split(self, x: Vector) -> tuple[Vector, Vector]:
        return x[: self.d], x[self.d :]
