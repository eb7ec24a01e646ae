"""Mathematics of a constrained problem for certification: HLW (1.18), the chart, constraints and multipliers in mpmath numbers."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import mpmath as mp
import numpy as np
import sympy as sp

from daebench.diagnostics.combined import combined
from daebench.diagnostics.symplecticity import tangent_basis
from daebench.errors import RunFailed
from daebench.methods.solvers.taylor_equations import own_coordinates
from daebench.reference.keep.definition import Definition
from daebench.reference.make.coordinates import Along, Local, Own
from daebench.reference.make.stages import Rows, Vector
from daebench.runs.ivp import Array
from daebench.runs.make_ivp import constrained
from daebench.systems.constrained import Chart
from daebench.systems.definition_parts import extent


class Functions:
    """H, g, G H_p, first integrals, lam and G H_pp G^T of one definition, at mpmath's working precision.

    They are made from the same expressions as all other functions, but evaluated by mpmath only, without compiled code.
    """

    def __init__(self, definition: Definition) -> None:
        derivation = self.own = definition.derivation
        self.in_time = bool(definition.ivp.facts.EXTENDED)
        problem, q, p = derivation.problem, list(derivation.problem.q), list(derivation.problem.p)

        def compiled(arguments: Sequence[sp.Symbol], expressions: Any) -> Callable[..., Any]:
            return sp.lambdify(arguments, sp.Matrix(expressions).subs(definition.parameters), modules="mpmath")  # type: ignore[no-any-return]

        self._g, self._G = compiled(q, derivation.g), compiled(q, derivation.G)
        self._integrals = compiled(q + p, list(problem.integrals.values())) if problem.integrals else None
        if derivation.explicit:
            self._H, self._H_p, self._H_pp = (
                compiled(q + p, [derivation.H]),
                compiled(q + p, derivation.H_p),
                compiled(q + p, derivation.H_pp),
            )
            self._a0 = compiled(q + p, derivation.a.subs(dict.fromkeys(derivation.lam, 0)))
        else:
            v = list(derivation.v)
            self._M, self._U = compiled(q, derivation.M), compiled(q, [derivation.U])
            self._a0 = compiled(q + v, derivation.g_qv * derivation.velocity)
            self._force = compiled(q + v, derivation.U_q + derivation.c)

    def g(self, q: Vector) -> Vector:
        """Return g(q), shape(m,)."""
        return list(self._g(*q))

    def jacobian(self, q: Vector) -> Any:
        """Return G(q), shape(m, d)."""
        return self._G(*q)

    def velocity(self, q: Vector, p: Vector) -> Vector:
        """Return H_p(p, q), shape(d,)."""
        if self.own.explicit:
            return list(self._H_p(*q, *p))
        v = list(mp.lu_solve(self._M(*q), mp.matrix(p)))
        return [*v[:-1], mp.mpf(1)] if self.in_time else v

    def Gv(self, q: Vector, p: Vector) -> Vector:
        """Return G H_p, shape(m,), HLW (1.11)."""
        return list(self._G(*q) * mp.matrix(self.velocity(q, p)))

    def energy(self, q: Vector, p: Vector) -> Any:
        """Return H(p, q)."""
        if self.own.explicit:
            return self._H(*q, *p)[0]
        n = len(p) - self.in_time
        return mp.fdot(p[:n], self.velocity(q, p)[:n]) / 2 + self._U(*q)[0] + mp.fsum(p[n:])

    def integrals(self, q: Vector, p: Vector) -> Vector:
        """Return the first integrals besides H."""
        return list(self._integrals(*q, *p)) if self._integrals else []

    def schur(self, q: Vector, p: Vector) -> Any:
        """Return G H_pp G^T, shape(m, m)."""
        G = self._G(*q)
        return G * self._H_pp(*q, *p) * G.T if self.own.explicit else G * self._inverse_mass(q) * G.T

    def _inverse_mass(self, q: Vector) -> Any:
        """Return M^-1, shape(d, d), with 0 for the time, which has no mass."""
        inverse = mp.inverse(self._M(*q))
        if self.in_time:
            inverse[inverse.rows - 1, inverse.cols - 1] = 0
        return inverse

    def lam(self, q: Vector, p: Vector) -> Vector:
        """Return lam(p, q), shape(m,), from HLW (1.12): G H_pp G^T lam equals the second derivative of g without the multiplier term."""
        if not self.own.m:
            return []
        if self.own.explicit:
            rest = self._a0(*q, *p)
        else:
            v = self.velocity(q, p)
            rest = self._a0(*q, *v) - self._G(*q) * (self._inverse_mass(q) * self._force(*q, *v))
        try:
            return list(mp.lu_solve(self.schur(q, p), rest))
        except ZeroDivisionError:
            where = ", ".join(mp.nstr(x, 9) for x in q)
            raise RunFailed(
                f"G M^-1 G^T is singular at q = ({where}): there are no multipliers; choose other times.", "no-multipliers-there"
            ) from None

    def smallest_singular_value(self, q: Vector, p: Vector) -> float:
        """Return the smallest singular value of G H_pp G^T."""
        S = np.array(self.schur(q, p).tolist(), dtype=float)
        return float(np.linalg.svd(S, compute_uv=False)[-1])


LONG = 10_000
"""Number of operations of a written-out chart above which velocities along the manifold are used instead: SymPy takes two minutes for the
derivatives of 125 000, and seconds for those of 3000."""


class Constrained:
    """A constrained problem at mpmath's working precision, and its equations in quadruple; a state is a flat list, q and then p."""

    zero: tuple[str, ...] = ("g", "Gv")
    """Conserved quantities that vanish; the others have their value at the start."""
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
        """The matrix that must not lose rank; "" where there are no constraints."""
        if not self.functions.own.m:
            return ""
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
        if not self.functions.own.m:
            return {"q": q, "p": p}
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
        """Return g and G H_p, if there are constraints, energy and first integrals."""
        q, p = self._split(x)
        constraints = {"g": self.functions.g(q), "Gv": self.functions.Gv(q, p)} if self.functions.own.m else {}
        quantities = constraints | {"energy": [self.functions.energy(q, p)]}
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
