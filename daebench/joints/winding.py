"""Angles at the start: what the points say, with the whole turns that a case gives."""

from collections.abc import Mapping, Sequence

import numpy as np
import sympy as sp

from daebench.errors import InvalidProblem
from daebench.joints.angles import Angles
from daebench.joints.exact import CLOSE, Values, exact, number, numbers
from daebench.systems.picture import Exact

LOOSE = 1e-3
"""Weight of an angle that a case does not give, which is between -pi and pi if those that it gives allow it."""


def wound(case: str, given: Mapping[str, Exact], angles: Angles, q0: Sequence[sp.Expr], values: Values) -> list[sp.Expr]:
    """Return q0 with its angles, shape(d,): those of a case, and others between -pi and pi."""
    at = dict(zip(angles.places.q, q0, strict=True))
    for one in angles.measured.values():
        at[one.theta] = one.value(at, values)
    wanted = {angles.given(name): number(exact(value), values) for name, value in given.items()}
    thetas = [one.theta for one in angles.measured.values() if one.driver is not None]
    forms = [form for form in angles.by_name.values() if form.free_symbols & {*thetas}]
    if not forms:
        return list(at.values())
    now = numbers(sp.Matrix(forms).subs(at), values).ravel()
    turns = np.array([wanted.get(form, 0.0) - x for form, x in zip(forms, now, strict=True)]) / (2 * np.pi)
    weight = np.array([1.0 if form in wanted else LOOSE for form in forms])
    # Few unknowns in whole numbers, which least squares find: an angle of the plane is a difference of two bodies' angles.
    A = np.vstack([weight[:, None] * numbers(sp.Matrix(forms).jacobian(thetas), values), LOOSE**2 * np.eye(len(thetas))])
    whole = np.where(weight == 1.0, turns, np.round(turns))
    added = np.linalg.lstsq(A, np.concatenate([weight * whole, np.zeros(len(thetas))]), rcond=None)[0]
    at |= {theta: at[theta] + 2 * sp.pi * round(x) for theta, x in zip(thetas, added, strict=True)}
    for name in given:
        if abs(off := number(angles.given(name).subs(at), values) - wanted[angles.given(name)]) > CLOSE:
            raise InvalidProblem(
                f"case {case!r} gives the angle {name}, but its points say one that is {off:.3g} rad larger; move a point.",
                "case-angle-against-points",
            )
    return list(at.values())
