"""The mass matrix and the potential of a problem that is given by H or by M and U, and whether its chart has canonical coordinates."""

from typing import Any

import sympy as sp


def has_canonical(derivation: Any) -> bool:
    """Return whether there are M, U and a chart whose positions depend on xi alone, so that xi has momenta of its own."""
    chart = derivation.problem.chart
    return chart is not None and not sp.Matrix(list(chart.q)).free_symbols & set(chart.eta) and inertia_of(derivation) is not None


def inertia_of(derivation: Any) -> sp.Matrix | None:
    """Return the mass matrix of the declared positions, given or the inverse of a diagonal H_pp; None if H is not 1/2 p^T M^-1 p + U."""
    if derivation.mechanical:
        return sp.Matrix(derivation.definition.M)
    n = len(derivation.definition.p)
    inverse = [derivation.H_pp[i, i] for i in range(n)]
    plain = all(inverse[i] != 0 and sp.expand(derivation.H_p[i] - inverse[i] * derivation.p[i]) == 0 for i in range(n))
    return sp.diag(*(1 / entry for entry in inverse)) if plain else None


def potential_of(derivation: Any) -> sp.Expr:
    """Return the potential energy: U, or H without momenta."""
    return derivation.U if derivation.mechanical else derivation.H.subs(dict.fromkeys(derivation.p, 0))
