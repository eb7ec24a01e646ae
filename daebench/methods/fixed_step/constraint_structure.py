"""Requirements of constraint solvers from molecular dynamics, and the spectral radius that decides on LINCS."""

import numpy as np

from daebench.compiler.number_types import number_type
from daebench.errors import BadInput
from daebench.runs.ivp import ConstrainedIvp
from daebench.schemes.kernels.claims import STRUCTURES, WATER
from daebench.schemes.kernels.relax import FINEST

RADIUS = 1.0 - 1e-9
"""Spectral radius above which the expansion of LINCS counts as divergent; 1 up to the rounding of eigenvalues."""


def spectral_radius(ivp: ConstrainedIvp) -> float:
    """Return the spectral radius of A = I - S K S at the start of a problem, S = diag(K)^-1/2, K = G M^-1 G^T, shape(m, m).

    The inverse of K that LINCS expands is S (I + A + A^2 + ...) S, Hess, Bekker, Berendsen and Fraaije, *J. Comput. Chem.* 18 (1997)
    1463-1472. A is symmetric, with the cosines of the angles between neighbouring bonds in it, weighted by masses::

        >>> import daebench
        >>> from daebench.methods.fixed_step.constraint_structure import spectral_radius
        >>> round(spectral_radius(daebench.initial_value_problem("butane", "gauche")), 3)
        0.874
    """
    G = np.asarray(ivp.value("G", ivp.q0))
    K = G @ np.asarray(ivp.value("H_pp", ivp.p0, ivp.q0)) @ G.T
    s = 1 / np.sqrt(np.diag(K))
    return float(np.max(np.abs(np.linalg.eigvalsh(np.eye(len(K)) - s[:, None] * K * s)), initial=0.0))


def misfit(structure: str, ivp: ConstrainedIvp) -> str:
    """Return why the constraints of a problem are not of a structure, as the text after the name of a method, or ""."""
    if structure == WATER:
        order = "written oxygen first, as |r_2 - r_1|^2 - d^2, |r_3 - r_1|^2 - d^2 and |r_3 - r_2|^2 - d_H^2"
        return "" if ivp.facts.WATER else f"needs {STRUCTURES[WATER]}, {order}, which {ivp.problem} does not have; use rattle."
    if not ivp.facts.DISTANCES:
        return f"needs distances between point masses, but not all constraints of {ivp.problem} are such; use rattle."
    radius = spectral_radius(ivp)
    if radius < RADIUS:
        return ""
    return (
        f"expands an inverse in powers of a matrix, which diverges on {ivp.problem}, case {ivp.case}: the spectral radius is "
        f"{radius:.4g} at the start, and must be less than 1, as it is without fixed angles; use rattle or rattle_ilves."
    )


def finest(precision: str) -> float:
    """Return the smallest tolerance that constraints can reach in a number type."""
    return FINEST * number_type(precision).spacing


def require_reached(name: str, tolerance: float, precision: str) -> None:
    """Refuse a tolerance that rounding does not let a scheme reach; ``name`` is the scheme's."""
    if tolerance >= finest(precision):
        return
    wider = ", or float64" if precision == "float32" else ""
    raise BadInput(
        f"{name} cannot satisfy constraints within tolerance = {tolerance:g} in {precision}, whose rounding leaves "
        f"{finest(precision):.2g}; "
        f"use a larger tolerance{wider}.",
        "tolerance-below-round-off",
    )
