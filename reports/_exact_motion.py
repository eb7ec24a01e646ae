"""The exact motion of a problem that has a closed form, from exact initial values, rounded once at the very end."""

from collections.abc import Sequence

import mpmath
import numpy as np
import sympy as sp

from daebench.errors import BadInput
from daebench.scene import Array, Source

DIGITS = 20
"""Decimal digits of the closed form; double precision needs 16."""


def exact_motion(source: Source, case: str, times: Sequence[float]) -> tuple[Array, Array]:
    """Return the exact positions and momenta of a case at these times, each shape(n, d).

    Raises
    ------
    BadInput
        If the problem has no closed form.
    """
    problem = source.derivation.problem
    if problem.closed_form is None:
        raise BadInput(f"{source.problem} has no closed form.")
    values = {symbol: sp.nsimplify(value) for symbol, value in problem.parameters.items()}
    values |= {symbol: problem.cases[case].parameters.get(str(symbol), value) for symbol, value in values.items()}
    with mpmath.workdps(DIGITS):
        q0, p0 = ([_exact(x, values) for x in part] for part in (problem.cases[case].q, problem.cases[case].p))
        parameters = {str(symbol): _exact(value, {}) for symbol, value in values.items()}
        states = [problem.closed_form(mpmath.mpf(float(t)), q0, p0, parameters) for t in times]
        q, p = (np.array([[float(x) for x in state[k]] for state in states]) for k in (0, 1))
    return q, p


def _exact(expression: object, values: dict[sp.Symbol, sp.Expr]) -> mpmath.mpf:
    return mpmath.mpmathify(sp.N(sp.sympify(expression).subs(values), DIGITS + 10))
