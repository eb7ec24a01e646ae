"""Quantities derived from a definition, under the textbook's names; each is computed when it is first asked for and then stored."""

from functools import cached_property
from typing import Any

import sympy as sp

from daebench.compiler.expressions import Symbols, jacobian
from daebench.compiler.monitored import may_be_left_unseen
from daebench.systems.constrained import ConstrainedHamiltonian


def _derivative(of: str, by: str) -> "cached_property[Any]":
    """Return the derivative of an attribute with respect to another, as an attribute."""
    return cached_property(lambda self: jacobian(getattr(self, of), getattr(self, by)))


def _gradient(of: str, by: str) -> "cached_property[Any]":
    return cached_property(lambda self: jacobian([getattr(self, of)], getattr(self, by)).T)


class Quantities:
    """The expressions of one problem.

    A problem is *explicit* if H is known as an expression (given as such, or with diagonal M); then all its derivatives are
    expressions. Otherwise linear systems with M(q) are solved numerically, and only M, U, g and their derivatives are expressions;
    ``kernels/mechanical.py`` composes H_p, H_q and the like from them.
    """

    timed = 0
    """Number of coordinates that are the time: 0 or 1."""

    def __init__(self, problem: ConstrainedHamiltonian) -> None:
        self.definition = self.problem = problem
        self.d, self.m = problem.d, problem.m
        self.q, self.p = sp.Matrix(problem.q), sp.Matrix(problem.p)
        self.v = sp.Matrix([sp.Dummy(f"v{i + 1}", real=True) for i in range(self.d)])
        self.lam = sp.Matrix(self.m, 1, [sp.Dummy(f"lam{i + 1}", real=True) for i in range(self.m)])
        self.parameters: Symbols = list(problem.parameters)

    @cached_property
    def mechanical(self) -> bool:
        """Whether H = 1/2 p^T M^-1 p + U(q) was given as M and U."""
        return self.problem.M is not None

    @cached_property
    def explicit(self) -> bool:
        """Whether H is known as an expression."""
        return self.problem.M is None or bool(self.problem.M.is_diagonal())

    @cached_property
    def constant_mass(self) -> bool:
        """Whether M was given and does not depend on q."""
        return self.problem.M is not None and not self.problem.M.free_symbols & set(self.problem.q)

    @cached_property
    def separable(self) -> bool:
        """Whether H = 1/2 p^T M^-1 p + U(q) with constant M, HLW (1.22)."""
        if not self.explicit:
            return self.constant_mass
        mixed = self.H_qp == sp.zeros(self.d, self.d)
        return mixed and not self.H_pp.free_symbols & {*self.problem.p, *self.problem.q}

    @cached_property
    def quadratic(self) -> bool:
        """Whether H is quadratic in p, so that G H_p = 0 is linear in p."""
        return not self.explicit or not self.H_pp.free_symbols & set(self.problem.p)

    @cached_property
    def charged(self) -> bool:
        """Whether there are no constraints, and H = 1/2 (p - A(q))^T M^-1 (p - A(q)) + phi(q) with constant M, the mass in H_pp."""
        if self.m or not self.explicit or self.H_pp.free_symbols & {*self.problem.p, *self.problem.q}:
            return False
        return not self.H_pp.is_diagonal() or all(self.H_pp[i, i] != 0 for i in range(self.d))

    @cached_property
    def H(self) -> sp.Expr:
        """Hamiltonian H(p, q) as an expression, of an explicit problem."""
        if self.problem.H is not None:
            return sp.sympify(self.problem.H)
        T = sum(self.p[i] ** 2 / self.M[i, i] for i in range(self.d)) / 2
        return T + self.U

    @cached_property
    def M(self) -> sp.Matrix:
        """Mass matrix M(q), shape(d, d)."""
        return sp.Matrix(self.problem.M)

    @cached_property
    def U(self) -> sp.Expr:
        """Potential energy U(q)."""
        return sp.sympify(self.problem.U)

    @cached_property
    def g(self) -> sp.Matrix:
        """Constraint g(q), shape(m,), with a 0 for each constraint on velocities."""
        return sp.Matrix(self.m, 1, [*self.problem.g, *[0] * self.on_velocities])

    @cached_property
    def A(self) -> sp.Matrix:
        """Rows A(q) of the constraints A v = 0 on velocities, shape(m, d), with a row of 0 for each constraint on positions."""
        none = sp.zeros(self.m - self.on_velocities, self.d)
        return none.col_join(jacobian(self.problem.velocity, self.problem.v)) if self.problem.v and self.on_velocities else none

    @cached_property
    def A_qv(self) -> sp.Matrix:
        """Derivative of A(q) v with respect to q at fixed v, shape(m, d)."""
        return jacobian(self.A * self.v, self.q)

    @cached_property
    def G(self) -> sp.Matrix:
        """Constraint Jacobian G(q): rows of g_q, and below them rows of A, shape(m, d)."""
        rows = jacobian(self.g, self.q)
        return rows + self.A if self.on_velocities else rows

    H_p = _gradient("H", "p")
    """Velocity H_p(p, q), shape(d,)."""

    H_q = _gradient("H", "q")
    """Minus the force, H_q(p, q), shape(d,)."""

    H_pp, H_qp = _derivative("H_p", "p"), _derivative("H_q", "p")
    """Inverse mass H_pp(p, q), and the derivative of H_q with respect to p, shape(d, d)."""

    @cached_property
    def Gv(self) -> sp.Matrix:
        """Velocity constraint G H_p, shape(m,), HLW (1.11)."""
        return self.G * self.H_p

    @cached_property
    def velocity(self) -> sp.Matrix:
        """Velocity in terms of v, shape(d,): v itself."""
        return self.v

    def of_positions(self, x: sp.Matrix) -> sp.Matrix:
        """Return the part of a vector that belongs to the positions, shape(d,): all of it."""
        return x

    @cached_property
    def momenta(self) -> sp.Matrix:
        """Momenta M(q) v of the positions, shape(d,)."""
        return self.of_positions(self.M * self.velocity)

    N = _derivative("momenta", "q")
    """Derivative of M(q) v with respect to q, shape(d, d)."""

    @cached_property
    def T_q(self) -> sp.Matrix:
        """Gradient of 1/2 v^T M(q) v with respect to q at fixed v, shape(d,)."""
        return jacobian([(self.v.T * self.M * self.v)[0] / 2], self.q).T

    U_q = _gradient("U", "q")
    """Gradient of U, shape(d,)."""

    @cached_property
    def c(self) -> sp.Matrix:
        """Velocity terms c = M'(q)[v] v - T_q(q, v), shape(d,), of which T_q has the forces without a potential."""
        return self.N * self.velocity - self.T_q

    @cached_property
    def g_qv(self) -> sp.Matrix:
        """Derivative of G(q) v with respect to q at fixed v, shape(m, d)."""
        return jacobian(self.G * self.velocity, self.q)

    @cached_property
    def a(self) -> sp.Matrix:
        """Right side of (1.12): the second derivative of g along the solution, shape(m,)."""
        force = self.H_q + self.G.T * self.lam
        return jacobian(self.Gv, self.q) * self.H_p - self.G * self.H_pp * force

    H_qq, H_pq = _derivative("H_q", "q"), _derivative("H_p", "q")
    Gv_p, Gv_q, a_p = _derivative("Gv", "p"), _derivative("Gv", "q"), _derivative("a", "p")
    U_qq, T_qq, T_qv, c_v = _derivative("U_q", "q"), _derivative("T_q", "q"), _derivative("T_q", "v"), _derivative("c", "v")
    """Second derivatives of H, U and T, and derivatives of G H_p, a and c."""

    @cached_property
    def curvature(self) -> sp.Matrix:
        """Derivative of G(q)^T lam with respect to q, shape(d, d)."""
        return jacobian(self.G.T * self.lam, self.q)

    @cached_property
    def structure(self) -> list[list[bool]]:
        """Pattern of the nonzero entries of G, shape(m, d)."""
        return [[self.G[row, column] != 0 for column in range(self.d)] for row in range(self.m)]

    @cached_property
    def inverse_mass(self) -> list[list[bool]]:
        """Pattern of the entries of H_pp that may be nonzero, shape(d, d); all of them if H_pp is not explicit."""
        return [[not self.explicit or self.H_pp[row, column] != 0 for column in range(self.d)] for row in range(self.d)]

    @cached_property
    def coupled(self) -> list[list[int]]:
        """Sets of positions that M couples with each other; linear systems with M are solved set by set."""
        sets: list[list[int]] = []
        for i in range(self.d):
            met = [group for group in sets if self.mechanical and any(self.M[i, j] != 0 for j in group)]
            sets = [group for group in sets if group not in met] + [sorted([i, *(j for group in met for j in group)])]
        return sorted(sets)

    @cached_property
    def kinetic_increment(self) -> list[sp.Expr]:
        """Increments of p, then of q, under the flow of the kinetic energy, shape(2 d,), for a problem that declares it."""
        flow = self.problem.kinetic_flow
        assert flow is not None
        return [end - start for end, start in zip([*flow.p, *flow.q], [*self.p, *self.q], strict=True)]

    @property
    def canonical(self) -> bool:
        """Whether there are M, U and a chart whose positions depend on xi alone, so that xi has momenta of its own."""
        chart = self.problem.chart
        return chart is not None and not sp.Matrix(list(chart.q)).free_symbols & set(chart.eta) and self.inertia is not None

    @cached_property
    def inertia(self) -> sp.Matrix | None:
        """Mass matrix of the declared positions, given or the inverse of a diagonal H_pp; None if H is not 1/2 p^T M^-1 p + U."""
        if self.mechanical:
            return sp.Matrix(self.definition.M)
        n = len(self.definition.p)
        inverse = [self.H_pp[i, i] for i in range(n)]
        plain = all(inverse[i] != 0 and sp.expand(self.H_p[i] - inverse[i] * self.p[i]) == 0 for i in range(n))
        return sp.diag(*(1 / entry for entry in inverse)) if plain else None

    @property
    def potential(self) -> sp.Expr:
        """Potential energy: U, or H without momenta."""
        return self.U if self.mechanical else self.H.subs(dict.fromkeys(self.p, 0))

    @property
    def on_velocities(self) -> int:
        """Number of constraints on velocities."""
        return len(self.problem.velocity)

    @cached_property
    def guarded(self) -> bool:
        """Whether H may be undefined at a state where the forces are defined."""
        problem = self.problem
        return may_be_left_unseen([problem.H, problem.U, *(problem.M or ())], [*problem.q, *problem.p])
