"""A problem's functions in mpmath numbers, for the energy, constraints, multipliers and rank in a certificate."""

from collections.abc import Callable, Sequence
from typing import Any

import mpmath as mp
import numpy as np
import sympy as sp

from daebench.errors import RunFailed
from daebench.reference.keep.definition import Definition
from daebench.reference.make.stages import Vector


class Functions:
    """H, g, G H_p, first integrals, lam and G H_pp G^T of one definition, at mpmath's working precision.

    They are made from the same expressions as all other functions, but evaluated by mpmath only, without compiled code.
    """

    def __init__(self, definition: Definition) -> None:
        derivation = self.own = definition.derivation
        self.in_time = bool(definition.ivp.facts.EXTENDED)
        problem, q, p = derivation.problem, list(derivation.problem.q), list(derivation.problem.p)

        def compiled(arguments: Sequence[sp.Symbol], expressions: Any) -> Callable[..., Any]:
            return sp.lambdify(arguments, sp.Matrix(expressions).subs(definition.parameters), modules="mpmath")  # type: ignore[no-any-return]

        self._g, self._G = compiled(q, derivation.g), compiled(q, derivation.G)
        self._integrals = compiled(q + p, list(problem.integrals.values())) if problem.integrals else None
        if derivation.explicit:
            self._H, self._H_p, self._H_pp = (
                compiled(q + p, [derivation.H]),
                compiled(q + p, derivation.H_p),
                compiled(q + p, derivation.H_pp),
            )
            self._a0 = compiled(q + p, derivation.a.subs(dict.fromkeys(derivation.lam, 0)))
        else:
            v = list(derivation.v)
            self._M, self._U = compiled(q, derivation.M), compiled(q, [derivation.U])
            self._a0 = compiled(q + v, derivation.g_qv * derivation.velocity)
            self._force = compiled(q + v, derivation.U_q + derivation.c)

    def g(self, q: Vector) -> Vector:
        """Return g(q), shape(m,)."""
        return list(self._g(*q))

    def jacobian(self, q: Vector) -> Any:
        """Return G(q), shape(m, d)."""
        return self._G(*q)

    def velocity(self, q: Vector, p: Vector) -> Vector:
        """Return H_p(p, q), shape(d,)."""
        if self.own.explicit:
            return list(self._H_p(*q, *p))
        v = list(mp.lu_solve(self._M(*q), mp.matrix(p)))
        return [*v[:-1], mp.mpf(1)] if self.in_time else v

    def Gv(self, q: Vector, p: Vector) -> Vector:
        """Return G H_p, shape(m,), HLW (1.11)."""
        return list(self._G(*q) * mp.matrix(self.velocity(q, p)))

    def energy(self, q: Vector, p: Vector) -> Any:
        """Return H(p, q)."""
        if self.own.explicit:
            return self._H(*q, *p)[0]
        n = len(p) - self.in_time
        return mp.fdot(p[:n], self.velocity(q, p)[:n]) / 2 + self._U(*q)[0] + mp.fsum(p[n:])

    def integrals(self, q: Vector, p: Vector) -> Vector:
        """Return the first integrals besides H."""
        return list(self._integrals(*q, *p)) if self._integrals else []

    def schur(self, q: Vector, p: Vector) -> Any:
        """Return G H_pp G^T, shape(m, m)."""
        G = self._G(*q)
        return G * self._H_pp(*q, *p) * G.T if self.own.explicit else G * self._inverse_mass(q) * G.T

    def _inverse_mass(self, q: Vector) -> Any:
        """Return M^-1, shape(d, d), with 0 for the time, which has no mass."""
        inverse = mp.inverse(self._M(*q))
        if self.in_time:
            inverse[inverse.rows - 1, inverse.cols - 1] = 0
        return inverse

    def lam(self, q: Vector, p: Vector) -> Vector:
        """Return lam(p, q), shape(m,), from HLW (1.12): G H_pp G^T lam equals the second derivative of g without the multiplier term."""
        if self.own.explicit:
            rest = self._a0(*q, *p)
        else:
            v = self.velocity(q, p)
            rest = self._a0(*q, *v) - self._G(*q) * (self._inverse_mass(q) * self._force(*q, *v))
        try:
            return list(mp.lu_solve(self.schur(q, p), rest))
        except ZeroDivisionError:
            where = ", ".join(mp.nstr(x, 9) for x in q)
            raise RunFailed(f"G M^-1 G^T is singular at q = ({where}): there are no multipliers; choose other times.") from None

    def smallest_singular_value(self, q: Vector, p: Vector) -> float:
        """Return the smallest singular value of G H_pp G^T."""
        S = np.array(self.schur(q, p).tolist(), dtype=float)
        return float(np.linalg.svd(S, compute_uv=False)[-1])
