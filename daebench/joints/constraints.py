"""All equations that a mechanism keeps: those of its bodies, its joints and its drivers, each once."""

from collections.abc import Sequence
from typing import Any

import sympy as sp

from daebench.errors import InvalidProblem, unknown
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
from daebench.joints.exact import Values, exact, vector
from daebench.joints.frames import Frame
from daebench.joints.joint_equations import equations
from daebench.joints.joints import Distance, Joint, Place, axes_of, check_axes, direction
from daebench.joints.placing import GROUND, Places

Labelled = list[tuple[str, sp.Expr]]
"""Equations with words for what each keeps."""


def equations_of(joints: Sequence[Joint | Distance | Driver], places: Places, values: Values) -> tuple[Labelled, Labelled, list[range]]:
    """Return all equations with their words, the expressions that are positive at the start, and the equations of each joint."""
    tied: Labelled = [pair for name, frame in places.frames.items() if name != GROUND for pair in frame.rigidity()]
    signs: Labelled = []
    tied += places.closures
    groups: list[range] = []
    for joint in joints:
        label, expressions, positive = of_joint(joint, places, values)
        # A joint without equations is entered with 0 = 0, so that it is named among those that add none.
        groups.append(range(len(tied), len(tied) + max(1, len(expressions))))
        tied += [(label, x) for x in expressions or [sp.S.Zero]]
        signs += [(label, x) for x in positive]
    return tied, signs, groups


def of_joint(joint: Joint | Distance | Driver, places: Places, values: Values) -> tuple[str, list[sp.Expr], list[sp.Expr]]:
    """Return the label of a joint, its equations, and expressions that are positive on its branch."""
    if isinstance(joint, DrivenCoordinate):
        places.given(joint.point)
        return f"the driver of {joint.point}", [driven_coordinate(joint, places.columns)], []
    what = f"the {type(joint).__name__} of {joint.first} and {joint.second}"
    if joint.first == joint.second:
        raise InvalidProblem(f"{what} ties {joint.first} to itself; name two.")
    if isinstance(joint, Distance | DrivenDistance):
        a, b = places.given(joint.first), places.given(joint.second)
        if isinstance(joint, DrivenDistance):
            return what, [driven_distance(joint, places.columns)], [exact(joint.distance)]
        gap, was = b.now - a.now, b.reference - a.reference
        return what, [gap.dot(gap) - was.dot(was)], []
    a_frame, b_frame = (_frame(what, name, places) for name in (joint.first, joint.second))
    if isinstance(joint, DrivenAngle):
        axis = None if joint.axis is None else _direction(what, joint.axis, places)
        equation, positive = driven_angle(joint, a_frame, b_frame, axis)
        return what, [equation], [positive]
    axes = [_direction(what, axis, places) for axis in axes_of(joint)]
    check_axes(joint, axes, places.dimension == 2, values)
    place = places.given(joint.at).reference if isinstance(joint.at, str) else vector(f"the place of {what}", joint.at)
    return what, equations(joint, a_frame, b_frame, place, axes), []


def _frame(what: str, name: str, places: Places) -> Frame:
    if name not in places.frames:
        raise unknown(f"body in {what}", name, places.frames)
    return places.frames[name]


def _direction(what: str, axis: Place, places: Places) -> sp.Matrix:
    return places.given(axis).reference if isinstance(axis, str) else direction(f"the axis of {what}", axis)


def keepers(tied: Labelled, q: Sequence[sp.Symbol]) -> list[int | None]:
    """Return for each equation the first one that equals it up to a factor, possibly itself; None if it holds in any position."""
    seen: dict[Any, int] = {}
    index = {x: i for i, x in enumerate(q)}
    firsts: list[int | None] = []
    for k, (label, equation) in enumerate(tied):
        used = sorted((x for x in equation.free_symbols if x in index), key=lambda x: index[x])
        # As a monic polynomial: two equations that differ by a factor are then equal.
        plain = sp.Poly(equation, *used) if used else None
        if not used and sp.expand(equation) != 0 and t in equation.free_symbols:
            raise InvalidProblem(f"{label} moves only the ground; drive a point or body that can move.")
        if plain is None or plain.is_zero:
            firsts.append(None)
        else:
            # An equation with the time is compared as it is: its coefficients are functions, by which nothing is divided.
            firsts.append(seen.setdefault(plain.monic() if t not in equation.free_symbols else equation, k))
    return firsts
