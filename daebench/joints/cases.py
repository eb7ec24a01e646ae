"""The cases of a mechanism: initial values that its joints allow, or a sentence that says which one does not."""

import sympy as sp

from daebench.errors import InvalidProblem
from daebench.joints.constraints import Labelled
from daebench.joints.drivers import t
from daebench.joints.exact import CLOSE, Values, number
from daebench.joints.placing import Places
from daebench.joints.starts import Start, positions, velocities
from daebench.systems.constrained import Case


def case_of(name: str, start: Start, places: Places, M: sp.Matrix, g: Labelled, signs: Labelled, values: Values) -> Case:
    """Return a case: q where it starts, and p = M v."""
    q0 = positions(name, start, places)
    at: dict[sp.Symbol, sp.Expr] = dict(zip(places.q, q0, strict=True)) | {t: sp.S.Zero}
    numbers_here = {**values, **{x: start.parameters[str(x)] for x in values if str(x) in start.parameters}}
    size = max([1.0, *(abs(number(x, numbers_here)) for x in q0)])
    for label, equation in g:
        off = number(equation.subs(at), numbers_here)
        if abs(off) > CLOSE * size**2:
            raise InvalidProblem(
                f"case {name!r} starts in an inconsistent position: the equation of {label} has a residual of {off:.3g}; move one of its "
                f"points."
            )
    for label, expression in signs:
        if number(expression.subs(at), numbers_here) <= 0:
            raise InvalidProblem(
                f"case {name!r} starts in an inconsistent position: {label} is on its other branch; move one of its points."
            )
    G = sp.Matrix([x for _, x in g]).jacobian(places.q)
    g_t = sp.Matrix([x for _, x in g]).diff(t)
    v = velocities(name, start, places, M, G, g_t, at, numbers_here, [label for label, _ in g])
    momenta = [sp.expand(x) for x in M * sp.Matrix(v)]
    return Case(q=q0, p=momenta, parameters=start.parameters, about=start.about, on_singular=start.on_singular)
