"""Functions derived from a definition in local coordinates y = (eta, xi) of its manifold, HLW VII.2.3, or in canonical ones."""

from collections.abc import Mapping, Sequence
from functools import cached_property

import sympy as sp

from daebench.compiler.constrained.derivation import Derivation
from daebench.compiler.constrained.extended import ExtendedDerivation
from daebench.compiler.derived import Rule, Rules
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
        """Return the algebra of its vectors, whose products omit no entry, and whose norms leave out a time of canonical coordinates."""
        dense = [[True] * self.d]
        return Values(self.d, self.m, dense * self.m, dense * self.d, target, unmeasured=self.timed)

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
    def _rules(self) -> Rules:
        n, chart = 2 * self.d, self.chart
        pq = {"p": list(self.p), "q": list(self.q)}
        y = {"p": list(chart.eta), "q": list(chart.xi)}
        return {
            "integrals": lambda: (pq, list(self.problem.integrals.values()), (len(self.problem.integrals),)),
            "chart": lambda: (y, [*chart.p, *chart.q], (2, self.original.d)),
            "inverse_chart": lambda: (pq, [*chart.inverse_eta, *chart.inverse_xi], (2, self.d)),
            "K_y": lambda: (y, self.K_y, (n,)),
            "two_form": lambda: (y, self.two_form, (n, n)),
        }


class CanonicalDerivation(LocalDerivation):
    """The expressions of one problem with M and U in canonical coordinates. Kernels use the names ``p`` for P and ``q`` for Q.

    With q = q(Q), X = dq/dQ and the velocities w = Q', the Lagrangian function of the chart and the momenta are::

        L(Q, w) = 1/2 w^T X^T M(q) X w - U(q)        P = X^T p = dL/dw        P' = dL/dQ + X^T F

    so that P determines w by a linear system with X^T M X, which kernels solve with numbers. If time is the last coordinate, its rate is 1.
    """

    def __init__(self, derivation: Derivation) -> None:
        super().__init__(derivation)
        self.timed = derivation.timed

    @cached_property
    def w(self) -> sp.Matrix:
        """Velocities Q', shape(n,); the symbol for the rate of the time occurs in no expression."""
        return sp.Matrix([sp.Dummy(f"w{i + 1}", real=True) for i in range(self.d)])

    @cached_property
    def X(self) -> sp.Matrix:
        """Derivative of the positions and of the time with respect to Q, shape(d, n)."""
        return nested_jacobian(self.chart.q, self.chart.xi)

    @cached_property
    def X_w(self) -> sp.Matrix:
        """Derivative of the positions with respect to the coordinates without the time."""
        return self.X[: self.original.d - self.timed, : self.d - self.timed]

    @cached_property
    def X_t(self) -> sp.Matrix:
        """Velocity of the positions where the coordinates are at rest: zero where the chart does not depend on time."""
        places = self.original.d - self.timed
        return self.X[:places, -1] if self.timed else sp.zeros(places, 1)

    @cached_property
    def carried_mass(self) -> sp.Matrix:
        """Mass matrix of the positions at the place q(Q)."""
        assert self.original.inertia is not None
        return self.original.inertia.subs(self._at_place, simultaneous=True)

    @cached_property
    def velocity(self) -> sp.Matrix:
        """Velocities q' = X w of the positions."""
        return self.X_w * self.w[: self.d - self.timed, :] + self.X_t

    @cached_property
    def momenta(self) -> sp.Matrix:
        """Momenta p = M X w of the positions."""
        return self.carried_mass * self.velocity

    @cached_property
    def lagrangian(self) -> sp.Expr:
        """L(Q, w)."""
        return self.velocity.dot(self.momenta) / 2 - self.original.potential.subs(self._at_place, simultaneous=True)

    @cached_property
    def L_q(self) -> sp.Matrix:
        """P' = dL/dQ + X^T F, shape(n,)."""
        L_q = nested_jacobian([self.lagrangian], self.chart.xi).T
        if self.forced is None:
            return L_q
        forces = self.forced.forces(list(self.momenta), [*self.velocity, *[sp.S.One] * self.timed])
        return L_q + self.X.T * forces.subs(self._at_place, simultaneous=True)

    @cached_property
    def _at_place(self) -> dict[sp.Symbol, sp.Expr]:
        return dict(zip(self.problem.q, self.chart.q, strict=True))

    @cached_property
    def _rules(self) -> Rules:
        n, chart, one = self.d, self.chart, [sp.S.One] * self.timed
        rules = {name: rule for name, rule in super()._rules.items() if name not in ("chart", "K_y", "two_form")}
        q = {"q": list(chart.xi)}
        qw = {**q, "v": list(self.w)}
        P = sp.Matrix([sp.Dummy(f"P{i + 1}", real=True) for i in range(n)])
        pq = {"p": list(self.p), "q": list(self.q)}

        def impulse() -> Rule:
            rest = P[: n - self.timed, :] - self.X_w.T * self.carried_mass * self.X_t
            return {"p": list(P), **q}, [*rest, *one], (n,)

        def placed() -> Rule:
            conjugate = [P[n - 1] - self.X_t.dot(self.momenta)] * self.timed
            return {**qw, "p": list(P)}, [*self.momenta, *conjugate, *chart.q], (2, self.original.d)

        def inverse() -> Rule:
            X = self.X.subs(dict(zip(chart.xi, chart.inverse_xi, strict=True)), simultaneous=True)
            return pq, [*(X.T * self.p), *chart.inverse_xi], (2, n)

        def by_velocity() -> Rule:
            moved = nested_jacobian(list(self.L_q), list(self.w[: n - self.timed]))
            return qw, moved.row_join(sp.zeros(n, self.timed)), (n, n)

        return rules | {
            "M": lambda: (q, sp.diag(self.X_w.T * self.carried_mass * self.X_w, *one), (n, n)),
            "impulse": impulse,
            "L_q": lambda: (qw, self.L_q, (n,)),
            "L_qv": by_velocity,
            "placed": placed,
            "inverse_chart": inverse,
        }
