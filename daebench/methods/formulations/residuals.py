"""The source of the module that evaluates a formulation: residual, Jacobian, and right side, written into arrays."""

from collections.abc import Mapping, Sequence

import sympy as sp

from daebench.compiler import callbacks, codegen
from daebench.compiler.cache import written
from daebench.compiler.constrained.derivation import Derivation
from daebench.compiler.equal_terms import added
from daebench.compiler.expressions import jacobian
from daebench.compiler.facts import WRITTEN_OUT
from daebench.compiler.linear.compiled_solvers import eliminating
from daebench.compiler.syntax import function, text_of

ALPHA, BETA = sp.Dummy("alpha"), sp.Dummy("beta")
"""Baumgarte's numbers, which no parameter of a problem can be mistaken for."""

OPTIONS = {"baumgarte": (ALPHA, BETA)}


class Equations:
    """The rows from which every formulation is put together, each zero along the motion."""

    def __init__(self, derivation: Derivation) -> None:
        self.of, self.d, self.m = derivation, derivation.d, derivation.m
        self.w = derivation.v if derivation.mechanical else derivation.p
        self.q_rate, self.w_rate = (sp.Matrix([sp.Dummy() for _ in range(self.d)]) for _ in range(2))
        self.holonomic = self.m - getattr(derivation, "on_velocities", 0)
        self.mu = sp.Matrix([sp.Dummy() for _ in range(self.holonomic)])

    @property
    def velocity(self) -> sp.Matrix:
        """Velocity, v itself or H_p, shape(d,)."""
        return self.of.velocity if self.of.mechanical else self.of.H_p

    def positions(self, formulation: str) -> sp.Matrix:
        """Kinematic rows of (1.9), shape(d,)."""
        extra = self.of.of_positions(self.of.G[: self.holonomic, :].T * self.mu) if formulation == "ggl" else sp.zeros(self.d, 1)
        return self.q_rate - self.velocity + extra

    @property
    def momenta(self) -> sp.Matrix:
        """Dynamic rows of (1.9), shape(d,)."""
        of = self.of
        if of.mechanical:
            return of.M * self.w_rate + of.c + of.U_q + of.G.T * of.lam
        return self.w_rate + of.H_q + of.G.T * of.lam

    @property
    def first(self) -> sp.Matrix:
        """Velocity constraint (1.11), shape(m,)."""
        return self.of.G * self.velocity

    @property
    def second(self) -> sp.Matrix:
        """Acceleration constraint (1.12), shape(m,)."""
        of = self.of
        return of.g_qv * of.velocity + of.G * of.of_positions(self.w_rate) if of.mechanical else of.a

    def rows(self, formulation: str) -> sp.Matrix:
        """All rows of a formulation, shape(n,)."""
        constraint = {
            "index3": lambda: [self.of.g],
            "index2": lambda: [self.first],
            "index1": lambda: [self.second],
            "ggl": lambda: [self.of.g[: self.holonomic, :], self.first],
            "baumgarte": lambda: [self.second + 2 * ALPHA * self.first + BETA**2 * self.of.g],
        }
        return sp.Matrix.vstack(self.positions(formulation), self.momenta, *constraint[formulation]())

    @property
    def multiplied(self) -> tuple[sp.Matrix, sp.Matrix]:
        """Linear system that fixes the multiplier: its unknowns z and its rows, each shape(k,).

        In velocities z = (v', lam) and the matrix is [[M, G^T], [G, 0]]; in momenta z = lam and it is -G H_pp G^T.
        """
        if self.of.mechanical:
            return sp.Matrix.vstack(self.w_rate, self.of.lam), sp.Matrix.vstack(self.momenta, self.second)
        return self.of.lam, self.second

    @property
    def slope(self) -> sp.Matrix:
        """Right side of (1.18) in terms of z, shape(2d,)."""
        if self.of.mechanical:
            return sp.Matrix.vstack(self.of.velocity, self.w_rate)
        return sp.Matrix.vstack(self.of.H_p, -self.of.H_q - self.of.G.T * self.of.lam)


Columns = Mapping[str, Sequence[sp.Symbol]]


Tables = dict[str, str] | None
"""Sources of tables that functions in loops read, by name, to which they add theirs; None where functions are written out."""


def writer(name: str, inputs: Columns, outputs: Mapping[str, sp.Matrix], parameters: Sequence[sp.Symbol], tables: Tables = None) -> str:
    """Return the source of ``name(*inputs, *outputs, par)``, which fills the output arrays."""
    if tables is not None:
        return _in_loops(name, inputs, outputs, parameters, tables)
    entries = {
        f"{array}[{row}]" if matrix.cols == 1 else f"{array}[{row}, {column}]": matrix[row, column]
        for array, matrix in outputs.items()
        for row in range(matrix.rows)
        for column in range(matrix.cols)
        if matrix[row, column] != 0
    }
    lines, values = codegen.computed(name, inputs, list(entries.values()), parameters)
    lines += [f"{array}[:] = 0.0" for array in outputs]
    lines += [f"{target} = {value}" for target, value in zip(entries, values, strict=True)]
    return function(f"{name}({', '.join([*inputs, *outputs, 'par'])})", *lines)


def _in_loops(name: str, inputs: Columns, outputs: Mapping[str, sp.Matrix], parameters: Sequence[sp.Symbol], tables: dict[str, str]) -> str:
    """Return the text of ``writer`` for many unknowns: terms of one form are summed in loops."""
    lines = [f"{array}[:] = 0.0" for array in outputs]
    for array, matrix in outputs.items():
        text = added(name, inputs, _entries(matrix), parameters, array)
        lines += text.lines
        tables |= text.tables
    return function(f"{name}({', '.join([*inputs, *outputs, 'par'])})", *lines)


def _entries(matrix: sp.Matrix) -> dict[tuple[int, ...], sp.Expr]:
    """Return the entries of a matrix that are not zero, by their indices: one where it has one column, and two otherwise."""
    return {(place if matrix.cols > 1 else place[:1]): value for place, value in sorted(matrix.todok().items())}


NAMES = """from numpy import *
from builtins import abs, max, min
"""
"""What functions that Python executes take from NumPy."""

HELPERS = "\n\n".join(map(text_of, (callbacks.finite, callbacks.finite_matrix)))
"""What the functions of every formulation call."""

ROOTS = ("residual", "jacobian", "rhs", "rhs_jacobian", "momenta")
"""Functions that Python calls."""

DAE = """
def residual(t, y, yp, res, par):
    rows(y, yp, res, par)
    return finite(1.0, res)


def jacobian(t, y, yp, res, cj, JJ, par):
    scale = (cj,)
    rows_y(y, yp, scale, JJ, par)
    return finite_matrix(1.0, JJ)
"""

VARIED = """
def residual(t, y, yp, res, par):
    numbers = par[:{parameters}]
    rows(y[:{n}], yp[:{n}], res[:{n}], numbers)
    for c in range(1, {k} + 1):
        s, da = slice(c * {n}, (c + 1) * {n}), par[c * {parameters} : (c + 1) * {parameters}]
        variation(y[:{n}], yp[:{n}], y[s], yp[s], da, res[s], numbers)
    return finite(1.0, res)


def jacobian(t, y, yp, res, cj, JJ, par):
    scale, numbers = (cj,), par[:{parameters}]
    JJ[:] = 0.0
    rows_y(y[:{n}], yp[:{n}], scale, JJ[:{n}, :{n}], numbers)
    for c in range(1, {k} + 1):
        s, da = slice(c * {n}, (c + 1) * {n}), par[c * {parameters} : (c + 1) * {parameters}]
        for i in range({n}):
            for j in range({n}):
                JJ[c * {n} + i, c * {n} + j] = JJ[i, j]
        variation_y(y[:{n}], yp[:{n}], y[s], yp[s], da, scale, JJ[s, :{n}], numbers)
    return finite_matrix(1.0, JJ)
"""
"""The same of unknowns that are followed by their derivatives in k directions, and numbers by theirs.

Without the blocks of ``variation_y`` what Newton's iteration leaves of y, times a second derivative, would be an error of derivatives: at
index 3 IDA takes it for one of the step, and at a tolerance of 1e-10 some six hundred times as many steps.
"""

ODE = """
def rhs(t, y, out, par):
    A, b = empty((K, K)), empty((K, 1))
    system(y, A, b[:, 0], par)
    pivot = eliminate(A, b)
    slope(y, b[:, 0], out, par)
    return finite(pivot, out)


def rhs_jacobian(t, y, JJ, par):
    n = y.shape[0]
    A, b, E_y, f_z = empty((K, K)), empty((K, 1)), empty((K, n)), empty((n, K))
    system(y, A, b[:, 0], par)
    copy = A.copy()
    pivot = eliminate(A, b)
    derivatives(y, b[:, 0], E_y, JJ, f_z, par)
    eliminate(copy, E_y)
    for i in range(n):
        for k in range(K):
            if f_z[i, k] != 0.0:
                for j in range(n):
                    JJ[i, j] -= f_z[i, k] * E_y[k, j]
    return finite_matrix(pivot, JJ)
"""

RESIDUAL = """
def residual(t, y, yp, res, par):
    health = rhs(t, y, res, par)
    for i in range(y.shape[0]):
        res[i] = yp[i] - res[i]
    return health
"""

JACOBIAN = """
def jacobian(t, y, yp, res, cj, JJ, par):
    health = rhs_jacobian(t, y, JJ, par)
    for i in range(y.shape[0]):
        for j in range(y.shape[0]):
            JJ[i, j] = -JJ[i, j]
        JJ[i, i] += cj
    return health
"""

IMPLICIT = RESIDUAL + JACOBIAN
"""The residual y' - f(y) of a right side, and its Jacobian."""


def source(title: str, derivation: Derivation, formulation: str, multipliers: str, *, directions: int = 0) -> str:
    """Return the source of a formulation's module.

    It has ``residual`` and ``jacobian`` (for ``ode`` also ``rhs`` and ``rhs_jacobian``) as machine code; ``system`` and
    ``slope``, which give the multiplier and the rates at a state; and K (number of unknowns of ``system``), MECHANICAL.
    """
    equations = Equations(derivation)
    parameters = [*derivation.parameters, *OPTIONS.get(formulation, ())]
    state = [*derivation.q, *equations.w]
    z, system = equations.multiplied
    at_zero = dict.fromkeys(z, 0)
    tables: Tables = {} if derivation.d > WRITTEN_OUT and not directions else None
    start = [
        writer("system", {"y": state}, {"A": jacobian(system, z), "b": -system.subs(at_zero)}, parameters, tables),
        writer("slope", {"y": state, "z": list(z)}, {"out": equations.slope}, parameters, tables),
    ]
    if formulation == "ode":
        outputs = {"E_y": jacobian(system, state), "f_y": jacobian(equations.slope, state), "f_z": jacobian(equations.slope, z)}
        compiled = [*start, writer("derivatives", {"y": state, "z": list(z)}, outputs, parameters, tables), ODE, IMPLICIT]
        plain = []
    else:
        compiled, plain = implicit(*_unknowns(equations, formulation, multipliers), parameters, directions, tables), start
    n = len(state) + {"ode": 0, "ggl": equations.m + equations.holonomic}.get(formulation, equations.m)
    kinds = [callbacks.IMPLICIT, callbacks.DENSE, *[callbacks.EXPLICIT, callbacks.EXPLICIT_DENSE] * (formulation == "ode")]
    compiled.append(callbacks.called_back(n * (1 + directions), len(parameters) * (1 + directions), *kinds))
    facts = [f"K = {len(z)}", f"MECHANICAL = {derivation.mechanical}", *(f"{name} = {text}" for name, text in (tables or {}).items())]
    solver = [eliminating()] if formulation == "ode" else []
    return written(title, ROOTS, [HELPERS, *solver, *compiled], [NAMES, *facts, *plain])


def _unknowns(equations: Equations, formulation: str, multipliers: str) -> tuple[sp.Matrix, list[sp.Symbol], list[sp.Symbol]]:
    """Return the rows F(y, y'), y and y'."""
    forces = [*equations.of.lam, *(equations.mu if formulation == "ggl" else [])]
    others = [sp.Dummy() for _ in forces]
    y = [*equations.of.q, *equations.w, *(forces if multipliers == "plain" else others)]
    yp = [*equations.q_rate, *equations.w_rate, *(others if multipliers == "plain" else forces)]
    return equations.rows(formulation), y, yp


def implicit(
    F: sp.Matrix,
    y: Sequence[sp.Symbol],
    yp: Sequence[sp.Symbol],
    parameters: Sequence[sp.Symbol],
    directions: int = 0,
    tables: Tables = None,
) -> list[str]:
    """Return the source of ``residual`` and ``jacobian`` of the rows F(y, y', a), and of so many of their variations.

    ::

        F_y s + F_y' s' + F_a da,      of the change da of the parameters a
    """
    inputs, scale = {"y": y, "yp": yp}, sp.Dummy("scale")
    F_y, F_yp = jacobian(F, y), jacobian(F, yp)
    writers = [
        writer("rows", inputs, {"res": F}, parameters, tables),
        writer("rows_y", {**inputs, "scale": [scale]}, {"JJ": F_y + scale * F_yp}, parameters, tables),
    ]
    if not directions:
        return [*writers, DAE]
    s, sp_, da = ([sp.Dummy() for _ in symbols] for symbols in (y, yp, parameters))
    V = F_y * sp.Matrix(s) + F_yp * sp.Matrix(sp_) + jacobian(F, parameters) * sp.Matrix(da)
    text = VARIED.format(n=len(y), k=directions, parameters=len(parameters))
    more = {**inputs, "s": s, "sp": sp_, "da": da}
    V_y = jacobian(V, y) + scale * jacobian(V, yp)
    writers += [
        writer("variation", more, {"res": V}, parameters),
        writer("variation_y", {**more, "scale": [scale]}, {"JJ": V_y}, parameters),
    ]
    return [*writers, text]
