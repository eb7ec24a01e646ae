"""The exact motion of a problem that has a closed form, from exact initial values, rounded once at the very end."""

from collections.abc import Sequence

import mpmath

from daebench.compiler.definition import Source
from daebench.errors import BadInput
from daebench.reference.keep.definition import define
from daebench.reference.solution import DIGITS as DIGITS
from daebench.reference.solution import evaluated
from daebench.runs.ivp import Array


def exact_motion(source: Source, case: str, times: Sequence[float]) -> tuple[Array, Array]:
    """Return the exact positions and momenta of a case with a closed form at these times, each shape(n, d)."""
    definition = define(source.problem, case)
    if definition.problem.closed_form is None:
        raise BadInput(f"{source.problem} has no closed form.", "no-closed-form")
    with mpmath.workdps(DIGITS):
        q0, p0 = definition.start_numbers()
        return evaluated(definition.problem.closed_form, times, q0, p0, definition.values())


def swing_period(E: float, L: float) -> float:
    """Return the time from one highest point to the next of the spherical pendulum with unit mass, length and gravity.

    ::

        z'^2 = 2 (E - z) (1 - z^2) - L^2 = 2 (z - z1) (z - z2) (z - z3),     z1 <= z <= z2 < z3
        T    = 2 K(k^2) / w,     w = sqrt((z3 - z1)/2),     k^2 = (z2 - z1)/(z3 - z1)
    """
    with mpmath.workdps(DIGITS):
        z1, z2, z3 = sorted(
            mpmath.re(z) for z in mpmath.polyroots([2, -2 * E, -2, 2 * E - mpmath.mpf(L) ** 2], maxsteps=200, extraprec=200)
        )
        return float(2 * mpmath.ellipk((z2 - z1) / (z3 - z1)) / mpmath.sqrt((z3 - z1) / 2))
