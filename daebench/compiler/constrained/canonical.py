"""Functions derived from a definition in the angles Q = xi of a chart and their momenta P = (dq/dxi)^T p: a system without constraints."""

from collections.abc import Callable
from functools import cached_property

import sympy as sp

from daebench.compiler.constrained.derivation import Arguments, Rule
from daebench.compiler.constrained.extended import ExtendedDerivation
from daebench.compiler.constrained.kinetic import inertia_of, potential_of
from daebench.compiler.constrained.local import LocalDerivation
from daebench.compiler.expressions import nested_jacobian
from daebench.compiler.linear.algebras import Values
from daebench.compiler.linear.elimination import Target


class CanonicalDerivation(LocalDerivation):
    """The expressions of one problem with M and U in canonical coordinates. Kernels use the names ``p`` for P and ``q`` for Q.

    With q = q(Q), X = dq/dQ and the velocities w = Q', the Lagrangian function of the chart and the momenta are::

        L(Q, w) = 1/2 w^T X^T M(q) X w - U(q)        P = X^T p = dL/dw        P' = dL/dQ + X^T F

    so that P determines w by a linear system with X^T M X, which kernels solve with numbers. If time is the last coordinate, its rate is 1.
    """

    @cached_property
    def timed(self) -> int:
        """Number of coordinates that are the time: 0 or 1."""
        return int(isinstance(self.original, ExtendedDerivation))

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
        inertia = inertia_of(self.original)
        assert inertia is not None
        return inertia.subs(self._at_place, simultaneous=True)

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
        return self.velocity.dot(self.momenta) / 2 - potential_of(self.original).subs(self._at_place, simultaneous=True)

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

    def algebra(self, target: Target) -> Values:
        """Return the algebra of its vectors, whose norms leave out the time and its momentum."""
        dense = [[True] * self.d]
        return Values(self.d, self.m, dense * self.m, dense * self.d, target, unmeasured=self.timed)

    @cached_property
    def _rules(self) -> dict[str, Callable[[], Rule]]:
        n, chart, one = self.d, self.chart, [sp.S.One] * self.timed
        rules = {name: rule for name, rule in super()._rules.items() if name not in ("chart", "K_y", "two_form")}
        q: Arguments = {"q": list(chart.xi)}
        qw: Arguments = {**q, "v": list(self.w)}
        P = sp.Matrix([sp.Dummy(f"P{i + 1}", real=True) for i in range(n)])
        pq: Arguments = {"p": list(self.p), "q": list(self.q)}

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
