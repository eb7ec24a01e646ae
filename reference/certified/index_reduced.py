"""The index-reduced equation in the problem's own coordinates, HLW (1.18), as expressions of quadruple precision."""

from collections.abc import Sequence

import sympy as sp

from daebench.reference.certified.definition import Definition
from daebench.reference.certified.quadruple import Expression, Translation, dotted, library, solved
from daebench.reference.certified.taylor import Equations


def own_coordinates(definition: Definition) -> Equations:
    """Return the index-reduced equation, HLW (1.18), in q and p.

    ::

        q' = H_p      p' = -H_q - G^T lam(p, q)      with lam(p, q) solved from (1.12) in the equations themselves
    """
    hy, own = library(), definition.derivation
    q, p = ([hy.make_vars(str(x)) for x in part] for part in (own.problem.q, own.problem.p))
    say = Translation(dict(zip([*own.problem.q, *own.problem.p], [*q, *p], strict=True)))

    def spelled(matrix: sp.Matrix) -> list[list[Expression]]:
        settled = matrix.subs(definition.parameters)
        return [[say(settled[i, j]) for j in range(settled.shape[1])] for i in range(settled.shape[0])]

    def column(matrix: sp.Matrix) -> list[Expression]:
        return [row[0] for row in spelled(matrix)]

    G = spelled(own.G)
    if own.explicit:
        v, force = column(own.H_p), [-x for x in column(own.H_q)]
        W = [_times(spelled(own.H_pp), row) for row in G]
        rest = column(own.a.subs(dict.fromkeys(own.lam, 0)))
    else:
        M = spelled(own.M)
        v = solved(M, p)
        say.known |= dict(zip(own.v, v, strict=True))
        force = column(own.T_q - own.U_q)
        W = [solved(M, row) for row in G]
        pull = column(own.U_q + own.c)
        rest = [a - dotted(w, pull) for a, w in zip(column(own.g_qv * own.v), W, strict=True)]
    lam = solved([[dotted(row, w) for w in W] for row in G], rest)
    rates = [f - dotted(column_of_G, lam) for f, column_of_G in zip(force, zip(*G, strict=True), strict=True)]
    return list(zip([*q, *p], [*v, *rates], strict=True))


def _times(A: Sequence[Sequence[Expression]], x: Sequence[Expression]) -> list[Expression]:
    return [dotted(row, x) for row in A]
