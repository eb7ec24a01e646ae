"""A molecule of the catalogue in a smooth external potential: a harmonic well that holds its first atom."""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import sympy as sp

from daebench.problems._space import angular_momentum
from daebench.systems.constrained import ConstrainedHamiltonian


def in_a_well(free: ConstrainedHamiltonian, case: str, stiffness: float) -> ConstrainedHamiltonian:
    """Return a molecule with one of its cases and a well of its first atom r_1.

    ::

        U = U_free + stiffness |r_1|^2 / 2

    The centre of mass is elsewhere, so that rotation and motion as a whole are coupled. Angular momentum about the origin stays; total
    momentum does not. What the molecule's own parameters are is fixed.

    Parameters
    ----------
    free : ConstrainedHamiltonian
        The molecule by itself, whose positions are those of its atoms in space.
    case : str
        Name of the case.
    stiffness : float
        Stiffness of the well, kJ/mol/Angstrom^2 where the molecule is in these units.
    """
    k, r = sp.Symbol("stiffness", real=True), sp.Matrix(free.q[:3])
    numbers = {symbol: sp.Rational(str(value)) for symbol, value in free.parameters.items()}

    def fixed(expressions: Iterable[Any]) -> tuple[sp.Expr, ...]:
        return tuple(sp.sympify(x).subs(numbers) for x in expressions)

    start = free.cases[case]
    return replace(
        free,
        M=sp.Matrix(free.M).subs(numbers),
        U=sp.sympify(free.U).subs(numbers) + k * r.dot(r) / 2,
        g=fixed(free.g),
        parameters={k: stiffness},
        cases={case: replace(start, q=fixed(start.q), p=fixed(start.p))},
        integrals=angular_momentum(free.q, free.p),
        chart=None,
    )
