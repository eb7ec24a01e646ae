"""The cases of a mechanism: initial values that its joints allow, or a sentence that says which one does not."""

import numpy as np
import sympy as sp

from daebench.errors import InvalidProblem
from daebench.joints.angles import Angles
from daebench.joints.constraints import Labelled
from daebench.joints.drivers import t
from daebench.joints.exact import CLOSE, Values, number, numbers
from daebench.joints.starts import Start, positions, velocities
from daebench.joints.winding import wound
from daebench.systems.constrained import Case


def case_of(
    name: str, start: Start, angles: Angles, M: sp.Matrix, g: Labelled, velocity: Labelled, signs: Labelled, values: Values
) -> Case:
    """Return a case: q where it starts, and p = M v."""
    places = angles.places
    numbers_here = {**values, **{x: start.parameters[str(x)] for x in values if str(x) in start.parameters}}
    q0 = wound(name, start.angles, angles, positions(name, start, places), numbers_here)
    at: dict[sp.Symbol, sp.Expr] = dict(zip(places.q, q0, strict=True)) | {t: sp.S.Zero}
    equations = sp.Matrix(len(g), 1, [x for _, x in g])
    G0 = equations.jacobian(places.q).xreplace(at)
    slopes = np.abs(numbers(G0, numbers_here)) @ places.scales
    for (label, equation), slope in zip(g, slopes, strict=True):
        off = number(equation.xreplace(at), numbers_here)
        # Relative to the change of the equation over the mechanism; an equation that hardly changes is compared with the others.
        if abs(off) > CLOSE * max(slope, CLOSE * slopes.max()):
            raise InvalidProblem(
                f"case {name!r} starts in an inconsistent position: the equation of {label} has a residual of {off:.3g}; move one of its "
                f"points.",
                "case-residual",
            )
    for label, expression in signs:
        if number(expression.xreplace(at), numbers_here) <= 0:
            raise InvalidProblem(
                f"case {name!r} starts in an inconsistent position: {label} is on its other branch; move one of its points.",
                "case-on-other-branch",
            )
    G0 = G0.col_join(sp.Matrix([x for _, x in velocity]).jacobian(places.v).xreplace(at)) if velocity else G0
    # Constraints on velocities prescribe none.
    g_t = equations.diff(t).col_join(sp.zeros(len(velocity), 1))
    M0 = M.xreplace(at)
    v0 = velocities(name, start, places, M0, G0, g_t, at, numbers_here, [label for label, _ in (*g, *velocity)])
    momenta = [sp.expand(x) for x in M0 * sp.Matrix(v0)]
    return Case(q=q0, p=momenta, parameters=start.parameters, about=start.about, on_singular=start.on_singular)
