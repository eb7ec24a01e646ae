"""A molecule of the catalogue in a smooth external potential: a harmonic well that holds its first atom."""

from dataclasses import replace

import sympy as sp

from daebench.problems._space import angular_momentum
from daebench.systems.constrained import ConstrainedHamiltonian

STIFFNESS = 20.0
"""Stiffness of the well, kJ/mol/Angstrom^2."""


def in_a_well(free: ConstrainedHamiltonian, stiffness: float = STIFFNESS) -> ConstrainedHamiltonian:
    """Return a molecule with a well of its first atom r_1, and with its cases.

    ::

        U = U_free + stiffness |r_1|^2 / 2

    The centre of mass is elsewhere, so that rotation and motion as a whole are coupled. Angular momentum about the origin stays; total
    momentum does not.
    """
    k, r = sp.Symbol("stiffness", real=True), sp.Matrix(free.q[:3])
    integrals = angular_momentum(free.q, free.p)
    return replace(free, U=free.U + k * r.dot(r) / 2, parameters={**free.parameters, k: stiffness}, integrals=integrals, chart=None)
