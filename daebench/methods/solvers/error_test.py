"""Unknowns of a system in time that the error test of a solver of SUNDIALS sees: those of the equations as they are written.

The test is on the root of the mean of squares over all n unknowns, and the time and p_t are two that nobody has declared. Their weights
are made so small that they add nothing, and all others so much larger that the mean is over the n - 2 others::

    sum (w_i e_i)^2 / n,   w_i = sqrt(n / (n - 2)) / (rtol |y_i| + atol_i)

A run then takes the steps that it takes on the same equations with t as the independent variable.
"""

import math

import numpy as np

from daebench.methods.formulations.constrained import Dae, Posed
from daebench.methods.solvers.drive import Array
from daebench.methods.solvers.multiplier_treatment import UNTESTED


def of_declared_unknowns(posed: Posed, tol: float, atol: Array) -> tuple[float, Array]:
    """Return the tolerances for a test on declared unknowns alone, as they are where nothing else is among the unknowns.

    Shapes: atol (n,).
    """
    if not (isinstance(posed, Dae) and posed.ivp.facts.EXTENDED):
        return tol, atol
    added = [posed.blocks[name].stop - 1 for name in ("q", "v")]
    share = math.sqrt(1 - len(added) * posed.copies / posed.n)
    declared = np.where(atol < UNTESTED, share * atol, atol).reshape(posed.copies, -1)
    declared[:, added] = UNTESTED
    return share * tol, declared.ravel()
