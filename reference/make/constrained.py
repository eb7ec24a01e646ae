"""Mathematics of a constrained problem for certification: HLW (1.18), the chart, constraints and multipliers."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import mpmath as mp
import numpy as np
import sympy as sp

from daebench.diagnostics.combined import combined
from daebench.diagnostics.symplecticity import tangent_basis
from daebench.methods.solvers.taylor_equations import own_coordinates
from daebench.reference.keep.definition import Definition
from daebench.reference.make.coordinates import Along, Local, Own
from daebench.reference.make.multiprecision import Functions
from daebench.reference.make.stages import Rows, Vector
from daebench.runs.ivp import Array
from daebench.runs.make_ivp import constrained
from daebench.systems.constrained import Chart
from daebench.systems.definition_parts import extent

LONG = 10_000
"""Number of operations of a written-out chart above which velocities along the manifold are used instead: SymPy takes two minutes for the
derivatives of 125 000, and seconds for those of 3000."""


class Constrained:
    """See :class:`daebench.reference.make.mathematics.Mathematics`; a state is q and then p."""

    zero: tuple[str, ...] = ("g", "Gv")
    perturbations = "along the manifold, q measured in max |q| and p in max |p|"

    def __init__(self, definition: Definition) -> None:
        self.definition, self.functions = definition, Functions(definition)
        ivp = constrained(definition.ivp)
        posed = combined(ivp) if ivp.on_singular == "least-squares" else ivp
        self.redundant = posed is not ivp
        self.independent = replace(definition, ivp=posed) if self.redundant else definition
        self._of_independent = Functions(self.independent) if self.redundant else self.functions
        self.d: int = definition.derivation.d
        self.crosses = definition.crosses

    @property
    def regular(self) -> str:
        """The matrix that must not lose rank."""
        return f"G M^-1 G^T{' of independent combinations of constraints' if self.redundant else ''}"

    @property
    def series(self) -> str:
        """Description of the Taylor series in the first coordinates."""
        return f"Taylor series {f'in {Local.name}' if self.crosses else 'of HLW (1.18)'} in quadruple precision"

    @property
    def closed_form(self) -> bool:
        """Whether the motion has a closed form."""
        return self.definition.problem.closed_form is not None

    @cached_property
    def first(self) -> Own | Local:
        """The index-reduced equation in q and p; or the problem's chart if G may lose rank, because that equation contains lam(p, q)."""
        return Local(self.definition) if self.crosses else Own(own_coordinates(self.independent))

    @cached_property
    def other(self) -> Local | Along | None:
        """The problem's chart if it is short, otherwise velocities along the manifold; none if there is a closed form."""
        if self.closed_form:
            return None
        chart = self.definition.problem.chart
        if Along.suits(self.independent) and (chart is None or _written_out(chart) > LONG):
            return Along(self.independent)
        return None if chart is None else Local(self.definition)

    @cached_property
    def directions(self) -> Array:
        """A basis of the tangent space at the start, shape(2 d, 2 (d - rank G))."""
        ivp = constrained(self.definition.ivp)
        return np.roll(tangent_basis(ivp, *ivp.start), self.d, axis=0)  # positions first

    def exact(self, times: Sequence[Any]) -> Rows:
        """Return the closed form at times, the first 0."""
        form, (q0, p0), values = self.definition.problem.closed_form, self.definition.start_numbers(), self.definition.values()
        return [[*q0, *p0], *([*q, *p] for q, p in (form(t, q0, p0, values) for t in times[1:]))]

    def parts(self, x: Vector) -> dict[str, Vector]:
        """Return q, p and the multipliers lam(p, q), HLW (1.12); those of least norm if constraints are redundant."""
        q, p = self._split(x)
        lam = self._of_independent.lam(q, p)
        return {"q": q, "p": p, "lam": self._of_least_norm(q, p, lam) if self.redundant else lam}

    def _of_least_norm(self, q: Vector, p: Vector, nu: Vector) -> Vector:
        """Return the multipliers of all constraints that give the same forces as those of independent combinations of them.

        Of all such multipliers they are those of least norm. The norm is that of runs, which does not depend on units, see
        :mod:`daebench.schemes.kernels.least_squares`: W holds the largest entries of the columns of G H_pp G^T, after its rows have been
        scaled to have a largest entry of 1.

        ::

            G^T lam = C^T nu      G = A C,  A = G C^T (C C^T)^-1, shape(m, rank G)      W lam = B (B^T B)^-1 nu,  B = W^-1 A
        """
        G, C = self.functions.jacobian(q), self._of_independent.jacobian(q)
        schur = self.functions.schur(q, p)
        largest = [max(abs(x) for x in schur[i, :]) for i in range(schur.rows)]
        W = [max(abs(schur[i, j]) / largest[i] for i in range(schur.rows)) for j in range(schur.cols)]
        B = mp.diag([1 / w for w in W]) * G * C.T * mp.inverse(C * C.T)
        return [x / w for x, w in zip(B * mp.lu_solve(B.T * B, mp.matrix(nu)), W, strict=True)]

    def conserved(self, x: Vector) -> dict[str, Vector]:
        """Return g, G H_p, energy and first integrals."""
        q, p = self._split(x)
        quantities = {"g": self.functions.g(q), "Gv": self.functions.Gv(q, p), "energy": [self.functions.energy(q, p)]}
        integrals = zip(self.definition.problem.integrals, self.functions.integrals(q, p), strict=True)
        return quantities | {name: [value] for name, value in integrals}

    def smallest_singular_value(self, x: Vector) -> float:
        """Return the smallest singular value of G H_pp G^T."""
        return self._of_independent.smallest_singular_value(*self._split(x))

    def _split(self, x: Vector) -> tuple[Vector, Vector]:
        return x[: self.d], x[self.d :]


def _written_out(chart: Chart) -> int:
    """Return the number of operations of a chart's positions and momenta."""
    return sum(extent(sp.sympify(expression))[0] for expression in (*chart.p, *chart.q))
