"""The equations of each formulation as expressions, and the source of the functions that evaluate them.

A problem given by M(q) and U(q) is written in velocities, so that M is never inverted; one given by H(p, q) in momenta::

    q' = v - G^T mu                   q' = H_p - G^T mu
    M v' = -c - U_q - G^T lam         p' = -H_q - G^T lam
    0 = g_qv(q, v) v + G v'           0 = (1.12)

with c = M'(q)[v] v - T_q, and mu in ``ggl`` only. Equations are HLW (1.9), (1.11), (1.12), (1.18).
"""

import inspect
from collections.abc import Mapping, Sequence

import sympy as sp

from daebench import codegen, elimination
from daebench.derive import Derivation

ALPHA, BETA = sp.Dummy("alpha"), sp.Dummy("beta")
"""Baumgarte's numbers, which no parameter of a problem can be mistaken for."""

OPTIONS = {"baumgarte": (ALPHA, BETA)}


class Equations:
    """The rows from which every formulation is put together, each zero along the motion.

    Parameters
    ----------
    derivation : Derivation
        The problem.
    """

    def __init__(self, derivation: Derivation) -> None:
        self.of, self.d, self.m = derivation, derivation.d, derivation.m
        self.w = derivation.v if derivation.mechanical else derivation.p
        self.q_rate, self.w_rate = (sp.Matrix([sp.Dummy() for _ in range(self.d)]) for _ in range(2))
        self.mu = sp.Matrix([sp.Dummy() for _ in range(self.m)])

    @property
    def velocity(self) -> sp.Matrix:
        """Velocity, v itself or H_p, shape(d,)."""
        return self.of.v if self.of.mechanical else self.of.H_p

    def positions(self, formulation: str) -> sp.Matrix:
        """Kinematic rows of (1.9), shape(d,)."""
        extra = self.of.G.T * self.mu if formulation == "ggl" else sp.zeros(self.d, 1)
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
        return of.g_qv * of.v + of.G * self.w_rate if of.mechanical else of.a

    def rows(self, formulation: str) -> sp.Matrix:
        """All rows of a formulation of METHODS section 2, shape(n,)."""
        constraint = {
            "index3": lambda: [self.of.g],
            "index2": lambda: [self.first],
            "index1": lambda: [self.second],
            "ggl": lambda: [self.of.g, self.first],
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
            return sp.Matrix.vstack(self.of.v, self.w_rate)
        return sp.Matrix.vstack(self.of.H_p, -self.of.H_q - self.of.G.T * self.of.lam)


Columns = Mapping[str, Sequence[sp.Symbol]]


def writer(name: str, inputs: Columns, outputs: Mapping[str, sp.Matrix], parameters: Sequence[sp.Symbol]) -> str:
    """Return the source of ``name(*inputs, *outputs, par)``, which fills the output arrays.

    Parameters
    ----------
    name : str
        Name of the function.
    inputs : mapping of str to sequence of Symbol
        Arrays that are read, and the symbols that their entries stand for.
    outputs : mapping of str to Matrix
        Arrays that are written, zeros included: of one axis where the matrix has one column, and of two otherwise.
    parameters : sequence of Symbol
        What ``par`` holds.
    """
    fresh = {s: sp.Symbol(f"{array}_{i}", **_assumptions(s)) for array, symbols in inputs.items() for i, s in enumerate(symbols)}
    fresh |= {s: sp.Symbol(f"par_{i}", **_assumptions(s)) for i, s in enumerate(parameters)}
    entries = {
        f"{array}[{row}]" if matrix.cols == 1 else f"{array}[{row}, {column}]": matrix[row, column].xreplace(fresh)
        for array, matrix in outputs.items()
        for row in range(matrix.rows)
        for column in range(matrix.cols)
        if matrix[row, column] != 0
    }
    columns = {array: [fresh[s] for s in symbols] for array, symbols in inputs.items()}
    values = codegen.expressions(f"{name}_", columns, list(entries.values()), (len(entries),), [fresh[s] for s in parameters])
    lines = [f"{array}[:] = 0.0" for array in outputs]
    lines.append(f"x = {name}_({', '.join([*inputs, 'par'])})")
    lines += [f"{target} = x[{k}]" for k, target in enumerate(entries)]
    return values + "\n\n" + codegen.function(f"{name}({', '.join([*inputs, *outputs, 'par'])})", *lines)


def _assumptions(symbol: sp.Symbol) -> dict[str, bool]:
    return {key: value for key, value in symbol.assumptions0.items() if value is not None}


DAE = """
def residual(t, y, yp, res, par):
    rows(y, yp, res, par)
    return finite(1.0, res)


def jacobian(t, y, yp, res, cj, JJ, par):
    scale = (cj,)
    rows_y(y, yp, scale, JJ, par)
    return finite(1.0, JJ.ravel())
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
    return finite(pivot, JJ.ravel())


def residual(t, y, yp, res, par):
    health = rhs(t, y, res, par)
    for i in range(y.shape[0]):
        res[i] = yp[i] - res[i]
    return health


def jacobian(t, y, yp, res, cj, JJ, par):
    health = rhs_jacobian(t, y, JJ, par)
    for i in range(y.shape[0]):
        for j in range(y.shape[0]):
            JJ[i, j] = -JJ[i, j]
        JJ[i, i] += cj
    return health
"""


def source(title: str, derivation: Derivation, formulation: str, multipliers: str, *, cached: bool) -> str:
    """Return the source of a formulation's module.

    It has ``residual`` and ``jacobian`` (for ``ode`` also ``rhs`` and ``rhs_jacobian``) handed to numba; ``system`` and
    ``slope``, which give the multiplier and the rates at a state; and K (number of unknowns of ``system``), MECHANICAL.

    Parameters
    ----------
    title : str
        The module's docstring.
    derivation : Derivation
        The problem.
    formulation : str
        A formulation of METHODS section 2.
    multipliers : str
        "plain" or "derivative".
    cached : bool
        Whether numba may keep its machine code beside the file.
    """
    equations = Equations(derivation)
    parameters = [*derivation.parameters, *OPTIONS.get(formulation, ())]
    state = [*derivation.q, *equations.w]
    z, system = equations.multiplied
    at_zero = dict.fromkeys(z, 0)
    start = [
        writer("system", {"y": state}, {"A": system.jacobian(z), "b": -system.subs(at_zero)}, parameters),
        writer("slope", {"y": state, "z": list(z)}, {"out": equations.slope}, parameters),
    ]
    if formulation == "ode":
        outputs = {"E_y": system.jacobian(state), "f_y": equations.slope.jacobian(state), "f_z": equations.slope.jacobian(z)}
        compiled = [*start, writer("derivatives", {"y": state, "z": list(z)}, outputs, parameters), ODE]
        plain = []
    else:
        compiled, plain = [*_dae(equations, formulation, multipliers, parameters), DAE], start
    compiled = [inspect.getsource(elimination.eliminate), inspect.getsource(elimination.finite), *compiled]
    facts = f"K = {len(z)}\nMECHANICAL = {derivation.mechanical}"
    header = f'"""{title}"""\n\nfrom typing import Any\n\nimport numpy as np\nfrom numba import njit\nfrom numpy import *\nfrom builtins import abs, max, min\n'
    return "\n\n".join([header, facts, *plain, *(_decorated(text, cached=cached) for text in compiled)]) + "\n"


def _dae(equations: Equations, formulation: str, multipliers: str, parameters: Sequence[sp.Symbol]) -> list[str]:
    """Return the writers of the rows F(y, y') and of dF/dy + scale dF/dy'."""
    forces = [*equations.of.lam, *(equations.mu if formulation == "ggl" else [])]
    others = [sp.Dummy() for _ in forces]
    y = [*equations.of.q, *equations.w, *(forces if multipliers == "plain" else others)]
    yp = [*equations.q_rate, *equations.w_rate, *(others if multipliers == "plain" else forces)]
    F, scale = equations.rows(formulation), sp.Dummy("scale")
    inputs = {"y": y, "yp": yp}
    F_y = F.jacobian(y) + scale * F.jacobian(yp)
    return [
        writer("rows", inputs, {"res": F}, parameters),
        writer("rows_y", {**inputs, "scale": [scale]}, {"JJ": F_y}, parameters),
    ]


def _decorated(text: str, *, cached: bool) -> str:
    """Hand each function to numba; only those that are called from outside are kept on disk, with everything else inside them."""
    roots = ("residual", "jacobian", "rhs", "rhs_jacobian")
    lines = []
    for line in text.splitlines():
        if line.startswith("def "):
            keep = ", cache=True" if cached and line[4:].split("(")[0] in roots else ""
            lines.append(f"@njit(error_model='numpy'{keep})")
        lines.append(line)
    return "\n".join(lines)
