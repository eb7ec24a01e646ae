"""Equations of motion as expressions of heyoka: the index-reduced one, HLW (1.18), and those with any structure matrix."""

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import sympy as sp

from daebench.compiler.expressions import replaced
from daebench.methods.solvers.quadruple import Expression, Translation, dotted, library, solved

Equations = list[tuple[Expression, Expression]]
"""A variable and its rate, for each unknown."""


class Exact(Protocol):
    """A problem in exact numbers."""

    @property
    def derivation(self) -> Any:
        """Derivation of the problem's definition."""

    @property
    def parameters(self) -> Mapping[sp.Symbol, sp.Rational]:
        """Values of the parameters by their symbols."""


def own_coordinates(definition: Exact) -> Equations:
    """Return the index-reduced equation, HLW (1.18), in q and p.

    ::

        q' = H_p      p' = -H_q - G^T lam(p, q)      with lam(p, q) solved from (1.12) in the equations themselves
    """
    hy, derivation = library(), definition.derivation
    q, p = ([hy.make_vars(str(x)) for x in part] for part in (derivation.problem.q, derivation.problem.p))
    say = Translation(dict(zip([*derivation.problem.q, *derivation.problem.p], [*q, *p], strict=True)))
    numbers = {**definition.parameters, **dict.fromkeys(derivation.lam, sp.S.Zero)}

    def spelled(matrix: sp.Matrix) -> list[list[Expression]]:
        said = list(map(say, replaced(list(matrix), numbers)))
        return [said[i : i + matrix.cols] for i in range(0, len(said), matrix.cols)]

    def column(matrix: sp.Matrix) -> list[Expression]:
        return [row[0] for row in spelled(matrix)]

    G = spelled(derivation.G)
    if derivation.explicit:
        v, force = column(derivation.H_p), [-x for x in column(derivation.H_q)]
        H_pp = spelled(derivation.H_pp)
        W = [[dotted(entries, row) for entries in H_pp] for row in G]
        rest = column(derivation.a)
    else:
        massive = sorted(i for indices in derivation.coupled for i in indices)
        M = spelled(derivation.M[massive, massive])
        say.known |= dict(zip((derivation.v[i] for i in massive), solved(M, [p[i] for i in massive]), strict=True))
        v, force = column(derivation.velocity), column(derivation.T_q - derivation.U_q)
        by_mass = [dict(zip(massive, solved(M, [row[i] for i in massive]), strict=True)) for row in G]
        W = [[row.get(i, 0 * p[0]) for i in range(derivation.d)] for row in by_mass]
        pull = column(derivation.U_q + derivation.c)
        rest = [a - dotted(w, pull) for a, w in zip(column(derivation.g_qv * derivation.velocity), W, strict=True)]
    lam = solved([[dotted(row, w) for w in W] for row in G], rest)
    rates = [f - dotted(column_of_G, lam) for f, column_of_G in zip(force, zip(*G, strict=True), strict=True)]
    return list(zip([*q, *p], [*v, *rates], strict=True))


def hamiltonian(definition: Exact, z: Sequence[sp.Symbol], B: sp.Matrix, K: sp.Expr) -> Equations:
    """Return z' = B(z) grad K(z) with the parameters' values; gradient and product are taken here, and nothing is simplified."""
    variables = [library().make_vars(f"z{i + 1}") for i in range(len(z))]
    say = Translation(dict(zip(z, variables, strict=True)))
    K_z = list(map(say, replaced([sp.diff(K, x) for x in z], definition.parameters)))
    rates = [dotted(list(map(say, replaced(list(B.row(i)), definition.parameters))), K_z) for i in range(len(z))]
    return list(zip(variables, rates, strict=True))
