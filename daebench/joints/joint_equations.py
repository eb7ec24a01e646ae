"""The equations of joints between the frames of two bodies."""

from collections.abc import Sequence

import sympy as sp

from daebench.errors import InvalidProblem
from daebench.joints.exact import simplified
from daebench.joints.frames import QUARTER_TURN, Frame
from daebench.joints.joints import Cylindrical, Fixed, Joint, Prismatic, Revolute, Slot, Universal


def coincidence(a: Frame, b: Frame, place: sp.Matrix) -> list[sp.Expr]:
    """Return the equations that keep a point of the two bodies in one place."""
    return list(a.at(place) - b.at(place))


def common_axis(a: Frame, b: Frame, axis: sp.Matrix) -> list[sp.Expr]:
    """Return the equations that keep a direction of the two bodies the same, in space.

    ::

        u_a . w_b = 0  for two directions w at right angles to u, or
        u_a . w_b = u . w  for all directions of a body that has none along u, as a rod that is hinged across
    """
    pairs = [(one, other) for one, other in ((a, b), (b, a)) if one.holds(axis, 0)]
    # Both bodies have the axis by name: nothing is left to keep.
    if len(pairs) == 2 and all(sp.expand(x) == 0 for x in a.along(axis) - b.along(axis)):
        return []
    for one, other in pairs:
        if all(other.holds(w, 0) for w in across(axis)):
            return [one.along(axis).dot(other.along(w)) for w in across(axis)]
    for one, other in pairs:
        if not other.holds(axis, 0):
            return [one.along(axis).dot(now) - simplified(axis.dot(was)) for was, now in other.directions]
    raise InvalidProblem(
        f"neither {a.body!r} nor {b.body!r} has enough directions for their common axis {tuple(axis)}; make one a Body, "
        "or let both name two points of the axis.",
        "no-common-axis",
    )


def across(axis: sp.Matrix) -> list[sp.Matrix]:
    """Return two directions at right angles to an axis and to each other, shape(3, 1), without roots."""
    sizes = [abs(sp.N(x)) if x.is_number else sp.S.One for x in axis]
    # The coordinate axis that is least along it, so that their cross product is not 0.
    least = sp.eye(3)[:, sizes.index(min(sizes))]
    first = axis.cross(least)
    return [first, axis.cross(first)]


def equations(joint: Joint, a: Frame, b: Frame, place: sp.Matrix, axes: Sequence[sp.Matrix]) -> list[sp.Expr]:
    """Return the equations of a joint between two bodies at a place, in the plane or in space."""
    flat = len(place) == 2
    if isinstance(joint, Prismatic):
        return _slide(a, b, place, axes[0]) if flat else _slide_in_space(a, b, place, axes[0])
    if isinstance(joint, Cylindrical):
        return [*common_axis(a, b, axes[0]), *_on_axis(a, b, place, across(axes[0]))]
    if isinstance(joint, Slot):
        gap, ways = a.at(place) - b.at(place), [QUARTER_TURN * axes[0]] if flat else across(axes[0])
        return [gap.dot(b.along(way)) for way in ways]
    conditions = coincidence(a, b, place)
    if isinstance(joint, Universal):
        # The right angle of the cross; that each axis stays in its body needs no equation.
        conditions.append(a.along(axes[0]).dot(b.along(axes[1])))
    elif isinstance(joint, Revolute) and not flat:
        conditions += common_axis(a, b, axes[0])
    elif isinstance(joint, Fixed):
        axes = [sp.eye(len(place))[:, k] for k in range(len(place))]
        conditions += [] if flat else common_axis(a, b, axes[0])
        conditions.append(a.along(axes[-2]).dot(b.along(axes[-1])))
    return conditions


def _on_axis(a: Frame, b: Frame, place: sp.Matrix, ways: Sequence[sp.Matrix]) -> list[sp.Expr]:
    """Return the equations that keep a point of b from going off in directions of a, or of a in those of b."""
    one, other = (a, b) if all(a.holds(way, 0) for way in ways) else (b, a)
    gap = other.at(place) - one.at(place)
    return [gap.dot(one.along(way)) for way in ways]


def _slide(a: Frame, b: Frame, place: sp.Matrix, axis: sp.Matrix) -> list[sp.Expr]:
    aside = QUARTER_TURN * axis
    turned = [a.along(aside).dot(b.along(axis))] if b.holds(axis, 0) and a.holds(aside, 0) else []
    return [*turned, *_on_axis(a, b, place, [aside])]


def _slide_in_space(a: Frame, b: Frame, place: sp.Matrix, axis: sp.Matrix) -> list[sp.Expr]:
    ways = across(axis)
    return [*common_axis(a, b, axis), a.along(ways[0]).dot(b.along(ways[1])), *_on_axis(a, b, place, ways)]
