"""Coordinates of a motion for Taylor series: the problem's own, its chart, or velocities along the manifold."""

from collections.abc import Callable, Iterable, Sequence
from functools import cached_property
from typing import Any

import mpmath as mp
import numpy as np
import sympy as sp

from daebench.errors import BadInput
from daebench.methods.solvers.taylor_equations import Equations, Translation, dotted, orthogonally, solved
from daebench.reference.keep.definition import Definition
from daebench.reference.make.stages import Rows, Vector
from daebench.systems.extended import force, hamiltonian
from daebench.systems.lazily import heyoka as hy


class Own:
    """The problem's own coordinates, for which both maps are the identity."""

    name = "the problem's own coordinates"

    def __init__(self, equations: Equations) -> None:
        self.equations = equations

    def entered(self, x: Vector) -> Vector:
        """Return the state itself."""
        return x

    def left(self, rows: Rows) -> Rows:
        """Return the rows themselves."""
        return rows


class Local:
    """Equations in the chart y = (eta, xi) of a definition whose positions depend only on xi, with the map into it and its inverse.

    ::

        X^T J X y' = grad K      X = chi'(y)      K = H(chi(y))      X^T J X = [[0, A], [-A^T, C]]
        A xi' = K_eta            A^T eta' = C xi' - K_xi + q_xi^T F

    If eta are the rates of xi, A is the mass matrix of the motion in xi, symmetric and definite, and is eliminated without pivoting.
    Otherwise a pivot may vanish along the motion, and the columns of A are orthogonalised.

    Neither constraints nor multipliers are used, so a comparison with (1.18) reveals an error in them. F are forces without a potential,
    if there are any.
    """

    name = "the problem's chart"

    def __init__(self, definition: Definition) -> None:
        self.definition, self.own = definition, definition.derivation
        chart = definition.derivation.problem.chart
        assert chart is not None
        self.chart = chart
        if set(chart.eta) & sp.Matrix(list(chart.q)).free_symbols:
            raise BadInput(
                f"the chart of {definition.ivp.problem} has positions that depend on eta; certification needs them to depend on xi only.",
                "chart-positions-mix",
            )

    @cached_property
    def equations(self) -> Equations:
        """Variables eta, xi and their rates."""
        eta, xi = list(self.chart.eta), list(self.chart.xi)
        y = [hy.make_vars(str(x)) for x in (*eta, *xi)]
        say = Translation(dict(zip([*eta, *xi], y, strict=True)))
        P, Q = (sp.Matrix(self.definition.settled(part)) for part in (self.chart.p, self.chart.q))
        P_eta, P_xi, Q_xi = P.jacobian(eta), P.jacobian(xi), Q.jacobian(xi)
        A = P_eta.T * Q_xi
        C = P_xi.T * Q_xi - Q_xi.T * P_xi
        K = self._energy(P, Q)

        K_eta, K_xi = ([say(K.diff(x)) for x in part] for part in (eta, xi))
        solve = solved if self._symmetric(A) else orthogonally
        rates = solve(_spelled(say, A), K_eta)
        pushed = self._pushed(say, P, Q, [dotted(row, rates) for row in _spelled(say, Q_xi)])
        drive = [k if f is None else k - f for k, f in zip(K_xi, pushed, strict=True)]
        turned = solve(_spelled(say, A.T), [dotted(row, rates) - k for row, k in zip(_spelled(say, C), drive, strict=True)])
        return list(zip(y, [*turned, *rates], strict=True))

    def _pushed(self, say: Translation, P: sp.Matrix, Q: sp.Matrix, velocity: Sequence[Any]) -> list[Any]:
        """Return q_xi^T F at these positions, momenta and velocities, one expression for each of xi; None if there are no forces."""
        xi, problem = list(self.chart.xi), self.own.problem
        if not self.definition.ivp.facts.FORCED:
            return [None] * len(xi)
        v = [sp.Dummy(f"v{k}", real=True) for k in range(len(velocity))]
        say.known |= dict(zip(v, velocity, strict=True))
        at = dict(zip([*problem.q, *problem.p], [*Q, *P], strict=True))
        F = force(self.own.declared, list(problem.p), v).subs(self.definition.parameters).subs(at, simultaneous=True)
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


class Along:
    """Maggi's equations of a problem with a constant mass matrix, in positions q and n = d - rank G velocities u along the manifold.

    ::

        v = X u - M^-1 G^T y      y = W^-1 (G X u + a)      W = G M^-1 G^T      so that G v + a = 0
        q' = v       N^T M N u' = N^T (-U_q + G'^T y)       N = dv/du      G' = dG(q(t))/dt

    X, shape(d, n), is constant for some time and spans the null space of G at the beginning of that time; the motion may turn by any angle.
    The velocity satisfies G v + a = 0 at all q, and neither lam nor g'' = 0 is used, so comparison with (1.18) reveals an error in the
    formula of the multipliers. Derivatives of g and U, and the rows of G and terms a of constraints on velocities, are taken here from the
    definition. Where such terms make the energy change, the time is an unknown, and p_t follows from the energy. Garcia de Jalon and Bayo,
    *Kinematic and Dynamic Simulation of Multibody Systems*, Springer 1994, chapter 5, describe the method, with another N.
    """

    name = "velocities along the manifold"

    def __init__(self, definition: Definition) -> None:
        self.in_time = bool(definition.ivp.facts.EXTENDED)
        problem = definition.derivation.definition
        self.q, self.U, self.M = list(problem.q), definition.settled([problem.U])[0], sp.Matrix(problem.M).subs(definition.parameters)
        g, rows = (definition.settled(part) for part in (problem.g, problem.velocity))
        self.G = sp.Matrix([[row.diff(x) for x in xs] for part, xs in ((g, self.q), (rows, problem.v)) for row in part])
        self.a = [*[sp.S.Zero] * len(g), *definition.settled(problem.prescribed)]
        self.d, self.n = len(self.q), len(self.q) - len(self.a)
        self._G, self._a, self._U = (sp.lambdify(self.q, part, modules="mpmath") for part in (self.G, sp.Matrix(self.a), self.U))

    @staticmethod
    def suits(definition: Definition) -> bool:
        """Return whether a problem is given by M and U, with constant M, without time and without forces that have no potential."""
        problem = definition.derivation.definition
        if problem.M is None or problem.t is not None or problem.force is not None:
            return False
        return not sp.Matrix(problem.M).subs(definition.parameters).free_symbols

    @cached_property
    def equations(self) -> Equations:
        """Variables q and u and their rates, with X and X^T M X as parameters of heyoka."""
        d, n = self.d, self.n
        q, u = ([hy.make_vars(f"{part}{k + 1}") for k in range(size)] for part, size in (("q", d), ("u", n)))
        X = [[hy.par[i * n + k] for k in range(n)] for i in range(d)]
        XMX = [[hy.par[d * n + j * n + k] for k in range(n)] for j in range(n)]
        v_symbols = sp.symbols(f"v1:{d + 1}", cls=sp.Dummy, real=True)
        say = Translation(dict(zip(self.q, q, strict=True)))
        G, G_by_mass = (_spelled(say, matrix) for matrix in (self.G, self.G * self.M.inv()))
        W = [[dotted(row, by_mass) for by_mass in G_by_mass] for row in G]
        GX = [[dotted(row, column) for row in G] for column in zip(*X, strict=True)]
        Z = [solved(W, column) for column in GX]
        y = [dotted(row, u) for row in zip(*Z, strict=True)]
        if any(self.a):
            y = [part + more for part, more in zip(y, solved(W, list(map(say, self.a))), strict=True)]
        v = [dotted(row, u) - dotted(column, y) for row, column in zip(X, zip(*G_by_mass, strict=True), strict=True)]
        say.known |= dict(zip(v_symbols, v, strict=True))
        turning = _spelled(say, sum((self.G.diff(x) * w for x, w in zip(self.q, v_symbols, strict=True)), sp.zeros(*self.G.shape)))
        push = [dotted(column, y) - say(self.U.diff(x)) for column, x in zip(zip(*turning, strict=True), self.q, strict=True)]
        by_mass = [dotted(row, push) for row in G_by_mass]
        drive = [dotted(column, push) - dotted(z, by_mass) for column, z in zip(zip(*X, strict=True), Z, strict=True)]
        A = [[XMX[j][k] - dotted(GX[j], Z[k]) for k in range(n)] for j in range(n)]
        time = [(hy.make_vars("t"), say(1))] if self.in_time else []
        return [*zip([*q, *u], [*v, *solved(A, drive)], strict=True), *time]

    def entered(self, x: Vector) -> Vector:
        """Return q and v of a state, and the time if it is one; the coordinates u are chosen anew at each output, see :meth:`begun`."""
        d, first = self.d, self.d + self.in_time
        return [*x[:d], *mp.lu_solve(_numbers(self.M), mp.matrix(x[first : first + d])), *x[d:first]]

    def left(self, rows: Rows) -> Rows:
        """Return (q, p) of rows of q and v; p_t, 0 at the start, is the energy lost since."""
        M, d = _numbers(self.M), self.d
        momenta = [list(M * mp.matrix(row[d : 2 * d])) for row in rows]
        H = [mp.fdot(p, row[d : 2 * d]) / 2 + self._U(*row[:d]) for p, row in zip(momenta, rows, strict=True)]
        return [[*row[:d], *row[2 * d :], *p, *[H[0] - K] * self.in_time] for p, row, K in zip(momenta, rows, H, strict=True)]

    def begun(self, x: Vector) -> tuple[Vector, Vector]:
        """Return q and u at an output, and the parameters of the equations up to the next one."""
        d = self.d
        q, v, M = x[:d], mp.matrix(x[d : 2 * d]), _numbers(self.M)
        G = np.array(self._G(*q).tolist(), dtype=float)
        root = np.linalg.cholesky(np.array(M.tolist(), dtype=float))
        free = np.linalg.svd(np.linalg.solve(root, G.T).T)[2][len(G) :]
        X = mp.matrix(np.linalg.solve(root.T, free.T).tolist())
        N, _ = self._along(q, X)
        return [*q, *mp.lu_solve(N.T * M * N, N.T * M * v), *x[2 * d :]], [*_entries(X), *_entries(X.T * M * X)]

    def ended(self, x: Vector, parameters: Vector) -> Vector:
        """Return q and v from q and u, with the parameters from :meth:`begun`."""
        d, n = self.d, self.n
        X = mp.matrix([parameters[i * n : (i + 1) * n] for i in range(d)])
        N, b = self._along(x[:d], X)
        return [*x[:d], *(N * mp.matrix(x[d : d + n]) + b), *x[d + n :]]

    def _along(self, q: Vector, X: Any) -> tuple[Any, Any]:
        """Return N, shape(d, n), and the velocity that constraints prescribe, shape(d, 1)."""
        G = self._G(*q)
        by_mass = mp.inverse(_numbers(self.M)) * G.T
        W = by_mass * mp.inverse(G * by_mass)
        return X - W * (G * X), -W * mp.matrix(self._a(*q))


def _numbers(matrix: sp.Matrix) -> Any:
    """Return a matrix of exact numbers at mpmath's working precision."""
    return mp.matrix([[sp.N(x, mp.mp.dps + 5)._to_mpmath(mp.mp.prec) for x in row] for row in matrix.tolist()])


def _spelled(say: Translation, matrix: sp.Matrix) -> list[list[Any]]:
    return [[say(x) for x in row] for row in matrix.tolist()]


def _entries(matrix: Iterable[Any]) -> list[Any]:
    """Return the entries of a matrix, row by row."""
    return list(matrix)
