"""The source of the module that evaluates a Poisson system in a formulation: residual, Jacobian, and right side."""

import sympy as sp

from daebench.compiler.cache import written
from daebench.compiler.callbacks import DENSE, EXPLICIT, EXPLICIT_DENSE, called_back
from daebench.compiler.callbacks import IMPLICIT as IMPLICIT_CALLED_BACK
from daebench.compiler.poisson.derivation import PoissonDerivation
from daebench.compiler.poisson.lattice import LatticeDerivation
from daebench.compiler.syntax import function
from daebench.methods.formulations.residuals import HELPERS, IMPLICIT, ROOTS, implicit, writer

ODE = """
def rhs(t, y, out, par):
    field(y, out, par)
    return finite(1.0, out)


def rhs_jacobian(t, y, JJ, par):
    field_y(y, JJ, par)
    return finite_matrix(1.0, JJ)
"""


def source(
    title: str,
    derivation: PoissonDerivation | LatticeDerivation,
    formulation: str,
    multipliers: str,
    *,
    directions: int = 0,
) -> str:
    """Return the source of a formulation's module: ``residual`` and ``jacobian``, for ``ode`` also ``rhs`` and ``rhs_jacobian``.

    Parameters are those of :func:`daebench.methods.formulations.residuals.source`, with a formulation of
    ``daebench.methods.formulations.table.POISSON_FORMULATIONS``.
    """
    if isinstance(derivation, LatticeDerivation):
        texts = (
            LatticeRates(derivation.lattice).written()
            if formulation == "ode"
            else _plain(PoissonDerivation(derivation.problem), formulation, multipliers)
        )
    else:
        texts = _varied(derivation, formulation, multipliers, directions) if directions else _plain(derivation, formulation, multipliers)
    return written(title, ROOTS, [HELPERS, *texts])


def _plain(of: PoissonDerivation, formulation: str, multipliers: str) -> list[str]:
    """Return the functions of a formulation."""
    if formulation == "ode":
        return _ode(of)
    F, y, yp, parameters = _casimirs(of, multipliers)
    return [*implicit(F, y, yp, parameters), _called_back(len(y), len(parameters))]


def _varied(of: PoissonDerivation, formulation: str, multipliers: str, k: int) -> list[str]:
    """Return the functions of a formulation with its variations in k directions."""
    if formulation == "ode":
        rates = [sp.Dummy(real=True) for _ in range(of.n)]
        F, y, yp, parameters = sp.Matrix(rates) - of.field, list(of.y), rates, list(of.parameters)
    else:
        F, y, yp, parameters = _casimirs(of, multipliers)
    return [*implicit(F, y, yp, parameters, k), _called_back(len(y) * (1 + k), len(parameters) * (1 + k))]


def _ode(of: PoissonDerivation) -> list[str]:
    y = list(of.y)
    field = writer("field", {"y": y}, {"out": of.field}, of.parameters)
    return [
        field,
        writer("field_y", {"y": y}, {"JJ": of.field.jacobian(y)}, of.parameters),
        ODE,
        IMPLICIT,
        _called_back(of.n, len(of.parameters), EXPLICIT, EXPLICIT_DENSE),
    ]


def _called_back(n: int, parameters: int, *more: str) -> str:
    return called_back(n, parameters, IMPLICIT_CALLED_BACK, DENSE, *more)


class LatticeRates(LatticeDerivation):
    """The right side of a Poisson lattice and its derivative, as loops over sites."""

    def written(self) -> list[str]:
        """Return the functions of the formulation ``ode``."""
        lattice, N = self.lattice, self.lattice.sites
        neighbours = ((lattice.left, "k_left"), (lattice.here, "k"), (lattice.right, "k_right"))
        entries = {
            f"JJ[{i * N} + k, {j * N} + {site}]": sp.diff(rate, symbol)
            for i, rate in enumerate(self.field)
            for symbols, site in neighbours
            for j, symbol in enumerate(symbols)
        }
        entries = {target: value for target, value in entries.items() if value != 0}
        rates = self._loop([f"out[{i * N} + k]" for i in range(self.fields)], self.field)
        slopes = self._loop(list(entries), list(entries.values()))
        return [
            function("field(y, out, par)", *rates),
            function("field_y(y, JJ, par)", "JJ[:] = 0.0", *slopes),
            ODE,
            IMPLICIT,
            _called_back(self.fields * N, len(self.parameters), EXPLICIT, EXPLICIT_DENSE),
        ]


def _casimirs(of: PoissonDerivation, multipliers: str) -> tuple[sp.Matrix, list[sp.Symbol], list[sp.Symbol], list[sp.Symbol]]:
    """Return the rows F(y, y', a), y, y' and a, which the values end that the Casimir functions keep.

    ::

        F = (y' - B H_y - C_y^T mu, C(y) - c)
    """
    C = sp.Matrix(list(of.problem.casimirs.values()))
    rates, mu, others, c = ([sp.Dummy(real=True) for _ in range(n)] for n in (of.n, len(C), len(C), len(C)))
    F = sp.Matrix([sp.Matrix(rates) - of.field - of.C_y.T * sp.Matrix(mu), C - sp.Matrix(c)])
    y = [*of.y, *(mu if multipliers == "plain" else others)]
    yp = [*rates, *(others if multipliers == "plain" else mu)]
    return F, y, yp, [*of.parameters, *c]
