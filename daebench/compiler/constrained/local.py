"""Functions derived from a definition in local coordinates y = (eta, xi) of its manifold, HLW VII.2.3."""

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property

import sympy as sp

from daebench.compiler.constrained.derivation import Arguments, Derivation, Rule
from daebench.compiler.constrained.extended import ExtendedDerivation
from daebench.compiler.expressions import nested_jacobian, shortened
from daebench.compiler.linear.algebras import Values
from daebench.compiler.linear.elimination import Target
from daebench.compiler.monitored import Monitored
from daebench.systems.extended import hamiltonian


class LocalDerivation(Derivation):
    """The expressions of one problem in its chart. Kernels use the names ``p`` for eta and ``q`` for xi, shape(n,) each.

    The monitored quantities are functions of the problem's own p and q, which the loop gets from ``chart``.
    """

    def __init__(self, derivation: Derivation) -> None:
        assert derivation.problem.chart is not None
        super().__init__(derivation.problem)
        self.original, self.chart = derivation, derivation.problem.chart
        self.d = len(self.chart.xi)
        self.y = sp.Matrix([*self.chart.eta, *self.chart.xi])

    @cached_property
    def forced(self) -> ExtendedDerivation | None:
        """The problem's own expressions if it has forces without a potential."""
        return self.original if isinstance(self.original, ExtendedDerivation) and self.original.forced else None

    @cached_property
    def explicit(self) -> bool:
        """Whether all functions that kernels ask for are expressions: always."""
        return True

    @cached_property
    def constants(self) -> dict[str, bool | int]:
        """Constants of ``kernels/language.py``; no kernel asks whether K is separable, or quadratic in eta."""
        return {"SEPARABLE": False, "QUADRATIC": False, "CONSTRAINTS": self.m}

    def algebra(self, target: Target) -> Values:
        """Return the algebra of its vectors, whose products omit no entry."""
        dense = [[True] * self.d]
        return Values(self.d, self.m, dense * self.m, dense * self.d, target)

    @cached_property
    def H(self) -> sp.Expr:
        """Hamiltonian H(p, q), or H + p_t, as an expression."""
        if self.original.explicit:
            return self.original.H
        declared = self.original.definition
        return hamiltonian(declared) + sum(self.p[len(declared.p) :])

    @cached_property
    def Gv(self) -> sp.Matrix:
        """Velocity constraint G H_p, shape(m,)."""
        return self.G * sp.Matrix([self.H]).jacobian(self.p).T

    def monitored(self, names: Sequence[str], kinds: int, stage_multipliers: int, *, arrays: bool = False) -> Monitored:
        """Return the functions that the loop calls besides the step, for states in the problem's own coordinates."""
        return self.original.monitored(names, kinds, stage_multipliers, arrays=arrays)

    @cached_property
    def K_y(self) -> sp.Matrix:
        """Gradient of K(y) = H(chi(y)), minus (dq/dy)^T F where there are forces F without a potential, shape(2 n,)."""
        chi = dict(zip([*self.problem.p, *self.problem.q], [*self.chart.p, *self.chart.q], strict=True))
        K_y = nested_jacobian([self.H.subs(chi, simultaneous=True)], self.y).T
        if self.forced is None:
            return K_y
        forces = self.forced.forces(list(self.p), list(sp.Matrix([self.H]).jacobian(self.p)))
        return K_y - nested_jacobian(self.chart.q, self.y).T * forces.subs(chi, simultaneous=True)

    @cached_property
    def two_form(self) -> sp.Matrix:
        """X^T J X with X = chi'(y), the inverse of B(y) of (2.21)."""
        p_y, q_y = (nested_jacobian(part, self.y) for part in (self.chart.p, self.chart.q))
        half = p_y.T * q_y
        upper = sp.Matrix(*half.shape, lambda i, j: shortened(half[i, j] - half[j, i]) if i < j else 0)
        return upper - upper.T

    @property
    def named(self) -> Mapping[str, tuple[str, str]]:
        """Functions that are attributes; see the base class."""
        return {"H": ("p q", ""), "g": ("q", "m"), "Gv": ("p q", "m")}

    @cached_property
    def _rules(self) -> dict[str, Callable[[], Rule]]:
        n, chart = 2 * self.d, self.chart
        pq: Arguments = {"p": list(self.p), "q": list(self.q)}
        y: Arguments = {"p": list(chart.eta), "q": list(chart.xi)}
        return {
            "integrals": lambda: (pq, list(self.problem.integrals.values()), (len(self.problem.integrals),)),
            "chart": lambda: (y, [*chart.p, *chart.q], (2, self.original.d)),
            "inverse_chart": lambda: (pq, [*chart.inverse_eta, *chart.inverse_xi], (2, self.d)),
            "K_y": lambda: (y, self.K_y, (n,)),
            "two_form": lambda: (y, self.two_form, (n, n)),
        }
