"""All equations that a mechanism keeps: those of its bodies, angles, joints and drivers, each once."""

from collections.abc import Sequence
from typing import Any

import sympy as sp

from daebench.errors import InvalidProblem
from daebench.joints.angles import Angles, Coupling, Gear, coupled
from daebench.joints.drivers import (
    DrivenAngle,
    DrivenCoordinate,
    DrivenDistance,
    Driver,
    driven_angle,
    driven_coordinate,
    driven_distance,
    t,
)
from daebench.joints.exact import Values, exact
from daebench.joints.joint_equations import equations
from daebench.joints.joints import Distance, Joint, axes_of, check_axes
from daebench.joints.placing import GROUND
from daebench.joints.rolling import Contact, KnifeEdge, Rolling

Tie = Joint | Distance | Driver | Gear | Coupling | Rolling | KnifeEdge
"""Declarations of constraints."""

Labelled = list[tuple[str, sp.Expr]]
"""Equations with words for what each keeps."""


def equations_of(joints: Sequence[Tie], angles: Angles, values: Values) -> tuple[Labelled, Labelled, list[range]]:
    """Return all equations with their words, the expressions that are positive at the start, and the equations of each joint."""
    places = angles.places
    tied: Labelled = [pair for name, frame in places.frames.items() if name != GROUND for pair in frame.rigidity()]
    tied += places.closures
    tied += [(one.words, one.equation) for one in angles.measured.values()]
    signs: Labelled = [(one.words, one.positive) for one in angles.measured.values()]
    groups: list[range] = []
    for joint in joints:
        label, expressions, positive = of_joint(joint, angles, values)
        if isinstance(joint, Rolling | KnifeEdge) and not expressions:
            continue
        # A joint without equations is entered with 0 = 0, so that it is named among those that add none.
        groups.append(range(len(tied), len(tied) + max(1, len(expressions))))
        tied += [(label, x) for x in expressions or [sp.S.Zero]]
        signs += [(label, x) for x in positive]
    return tied, signs, groups


def of_joint(joint: Tie, angles: Angles, values: Values) -> tuple[str, list[sp.Expr], list[sp.Expr]]:
    """Return the label of a joint, its equations, and expressions that are positive on its branch."""
    places = angles.places
    if isinstance(joint, DrivenCoordinate):
        places.given(joint.point)
        return f"the driver of {joint.point}", [driven_coordinate(joint, places.columns)], []
    what = f"the {type(joint).__name__} of {joint.first} and {joint.second}"
    if joint.first == joint.second:
        raise InvalidProblem(f"{what} ties {joint.first} to itself; name two.", "joint-ties-to-itself")
    if isinstance(joint, Gear | Coupling):
        return what, [coupled(joint, angles)], []
    if isinstance(joint, Distance | DrivenDistance):
        a, b = places.given(joint.first), places.given(joint.second)
        if isinstance(joint, DrivenDistance):
            return what, [driven_distance(joint, places.columns)], [exact(joint.distance)]
        gap, was = b.now - a.now, b.reference - a.reference
        return what, [gap.dot(gap) - was.dot(was)], []
    if isinstance(joint, Rolling | KnifeEdge):
        return what, Contact(joint, angles).heights(), []
    a_frame, b_frame = (places.frame(what, name) for name in (joint.first, joint.second))
    if isinstance(joint, DrivenAngle):
        axis = None if joint.axis is None else places.direction(f"the axis of {what}", joint.axis)
        equation, positive = driven_angle(joint, a_frame, b_frame, axis)
        return what, [equation], [positive]
    axes = [places.direction(f"the axis of {what}", axis) for axis in axes_of(joint)]
    check_axes(joint, axes, places.dimension == 2, values)
    place = places.point(f"the place of {what}", joint.at)
    return what, equations(joint, a_frame, b_frame, place, axes), []


def keepers(tied: Labelled, q: Sequence[sp.Symbol]) -> list[int | None]:
    """Return for each equation the first one that equals it up to a factor, possibly itself; None if it holds in any position."""
    seen: dict[Any, int] = {}
    index = {x: i for i, x in enumerate(q)}
    firsts: list[int | None] = []
    for k, (label, equation) in enumerate(tied):
        used = sorted((x for x in equation.free_symbols if x in index), key=lambda x: index[x])
        # As a monic polynomial: two equations that differ by a factor are then equal. That of an angle is none, and there is one of each.
        plain = sp.Poly(equation, *used) if used and equation.is_polynomial(*used) else None
        if not used and sp.expand(equation) != 0 and t in equation.free_symbols:
            raise InvalidProblem(f"{label} moves only the ground; drive a point or body that can move.", "driver-moves-ground")
        if not used or (plain is not None and plain.is_zero):
            firsts.append(None)
        else:
            # An equation with the time is compared as it is: its coefficients are functions, by which nothing is divided.
            firsts.append(seen.setdefault(equation if plain is None or t in equation.free_symbols else plain.monic(), k))
    return firsts
