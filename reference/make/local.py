"""The same motion in second coordinates: the problem's chart, HLW (2.22), in quadruple precision."""

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import sympy as sp

from daebench.errors import BadInput
from daebench.methods.solvers.quadruple import Translation, dotted, library, orthogonally, solved
from daebench.methods.solvers.taylor_equations import Equations
from daebench.reference.keep.definition import Definition
from daebench.reference.make.stages import Rows
from daebench.systems.extended import force, hamiltonian


class Local:
    """Equations in the chart y = (eta, xi) of a definition whose positions depend only on xi, with the map into it and its inverse.

    ::

        X^T J X y' = grad K      X = chi'(y)      K = H(chi(y))      X^T J X = [[0, A], [-A^T, C]]
        A xi' = K_eta            A^T eta' = C xi' - K_xi + q_xi^T F

    If eta are the rates of xi, A is the mass matrix of the motion in xi, symmetric and definite, and is eliminated without pivoting.
    Otherwise a pivot may vanish along the motion, and the columns of A are orthogonalised.

    Neither constraints nor multipliers are used, so a comparison with (1.18) reveals an error in them. F are forces without a potential,
    if there are any.

    Parameters
    ----------
    definition : Definition
        A problem that declares a chart.

    Raises
    ------
    BadInput
        If the chart's positions depend on eta.
    """

    name = "the problem's chart"

    def __init__(self, definition: Definition) -> None:
        self.definition, self.own = definition, definition.derivation
        chart = definition.derivation.problem.chart
        assert chart is not None
        self.chart = chart
        if set(chart.eta) & sp.Matrix(list(chart.q)).free_symbols:
            raise BadInput(
                f"the chart of {definition.ivp.problem} has positions that depend on eta; certification needs them to depend on xi only."
            )

    @cached_property
    def equations(self) -> Equations:
        """Variables eta, xi and their rates."""
        eta, xi = list(self.chart.eta), list(self.chart.xi)
        y = [library().make_vars(str(x)) for x in (*eta, *xi)]
        say = Translation(dict(zip([*eta, *xi], y, strict=True)))
        P, Q = (sp.Matrix(self.definition.settled(part)) for part in (self.chart.p, self.chart.q))
        P_eta, P_xi, Q_xi = P.jacobian(eta), P.jacobian(xi), Q.jacobian(xi)
        A = P_eta.T * Q_xi
        C = P_xi.T * Q_xi - Q_xi.T * P_xi
        K = self._energy(P, Q)

        def spelled(matrix: sp.Matrix) -> list[list[Any]]:
            return [[say(matrix[i, j]) for j in range(matrix.shape[1])] for i in range(matrix.shape[0])]

        K_eta, K_xi = ([say(K.diff(x)) for x in part] for part in (eta, xi))
        solve = solved if self._symmetric(A) else orthogonally
        rates = solve(spelled(A), K_eta)
        pushed = self._pushed(say, P, Q, [dotted(row, rates) for row in spelled(Q_xi)])
        drive = [k if f is None else k - f for k, f in zip(K_xi, pushed, strict=True)]
        turned = solve(spelled(A.T), [dotted(row, rates) - k for row, k in zip(spelled(C), drive, strict=True)])
        return list(zip(y, [*turned, *rates], strict=True))

    def _pushed(self, say: Translation, P: sp.Matrix, Q: sp.Matrix, velocity: Sequence[Any]) -> list[Any]:
        """Return q_xi^T F at these positions, momenta and velocities, one expression for each of xi; None if there are no forces."""
        xi, own = list(self.chart.xi), self.own.problem
        if not self.definition.ivp.facts.FORCED:
            return [None] * len(xi)
        v = [sp.Dummy(f"v{k}", real=True) for k in range(len(velocity))]
        say.known |= dict(zip(v, velocity, strict=True))
        at = dict(zip([*own.q, *own.p], [*Q, *P], strict=True))
        F = force(self.own.declared, list(own.p), v).subs(self.definition.parameters).subs(at, simultaneous=True)
        return [say(entry) for entry in Q.jacobian(xi).T * F]

    def _symmetric(self, A: sp.Matrix) -> bool:
        """Return whether A is symmetric, tested at a point without accidental symmetry."""
        place = {x: sp.Rational(k, 17) for k, x in enumerate([*self.chart.eta, *self.chart.xi], 2)}
        numbers = sp.N(A.subs(place), 30)
        return bool(sp.N((numbers - numbers.T).norm()) < 1e-20 * sp.N(numbers.norm()))

    def _energy(self, P: sp.Matrix, Q: sp.Matrix) -> sp.Expr:
        """Return K(y)."""
        at = dict(zip([*self.own.problem.q, *self.own.problem.p], [*Q, *P], strict=True))
        H = self.own.H if self.own.explicit else self._with_mass()
        return H.subs(self.definition.parameters).subs(at, simultaneous=True)

    def _with_mass(self) -> sp.Expr:
        """Return H(p, q) of a problem given by M and U, or K = H(p, q, t) + p_t."""
        if not self.definition.ivp.facts.EXTENDED:
            return hamiltonian(self.own.problem)
        return hamiltonian(self.own.declared) + self.own.problem.p[-1]

    def entered(self, x: list[Any]) -> list[Any]:
        """Return y of a state (q, p) on the manifold."""
        problem = self.own.problem
        return list(self._compiled([*problem.q, *problem.p], [*self.chart.inverse_eta, *self.chart.inverse_xi])(*x))

    def left(self, rows: Rows) -> Rows:
        """Return (q, p) of rows of y."""
        back = self._compiled([*self.chart.eta, *self.chart.xi], [*self.chart.q, *self.chart.p])
        return [list(back(*row)) for row in rows]

    def _compiled(self, arguments: list[sp.Symbol], expressions: list[sp.Expr]) -> Callable[..., Any]:
        return sp.lambdify(arguments, sp.Matrix(self.definition.settled(expressions)), modules="mpmath", cse=True)  # type: ignore[no-any-return]
