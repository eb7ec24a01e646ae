"""The joints of a model's tree: each link shares points and directions with its parent, by how it moves against it."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from daebench.joints.joints import Cylindrical, Joint, Prismatic, Universal
from daebench.joints.models.builder import Builder
from daebench.joints.models.links import FIXED, Link
from daebench.joints.models.motions import Motion


def tie(builder: Builder, link: Link, motion: Motion) -> Iterator[Joint]:
    """Name the points and directions that a link shares with its parent, and yield the joints that take equations."""
    parent, name = link.parent, builder.names.joint(link.joints[0])
    if not motion.slides:
        yield from _pivot(builder, link, motion, name)
        return
    free = len(motion.slides) == len(builder.space.axes)
    builder.of.setdefault(link.number, [])
    point = builder.point(link.number, motion.place, f"{link.name}_centre" if free else name)
    yield from _slides(builder, link, motion, point, free)
    if not builder.space.plane or parent == FIXED:
        builder.share(link.number, [point, *_kept(builder, link, motion, name)])
    else:
        builder.share(link.number, [point])


def _pivot(builder: Builder, link: Link, motion: Motion, name: str) -> Iterator[Joint]:
    """Share a point, and the axis of a hinge."""
    point = builder.point(link.parent, motion.place, name)
    turns = [] if builder.space.plane else motion.turns
    axes = [builder.direction(link.parent, turns[0], f"{name}_axis")] if len(turns) == 1 else []
    builder.share(link.number, [point, *axes])
    if len(turns) == 2:
        first = builder.direction(link.parent, turns[0], f"{name}_axis")
        second = builder.direction(link.number, turns[1], f"{builder.names.joint(link.joints[1])}_axis")
        yield Universal(builder.named(link.parent), link.name, point, first_axis=first, second_axis=second)


def _slides(builder: Builder, link: Link, motion: Motion, point: str, free: bool) -> Iterator[Joint]:
    """Lead a point along a line or in a plane of the ground, or by a joint along a line of the parent."""
    if free:
        return
    if link.parent == FIXED:
        builder.guides[point] = motion.slides
        return
    kind: Any = Prismatic if builder.space.plane else Cylindrical
    yield kind(builder.named(link.parent), link.name, point, axis=builder.space.vector(motion.slides[0]))


def _kept(builder: Builder, link: Link, motion: Motion, name: str) -> list[str]:
    """Return the directions that a link that slides has in common with its parent."""
    if motion.turns:
        return (
            [builder.direction(link.parent, motion.turns[0], f"{name}_axis")] if len(motion.turns) == 1 and not builder.space.plane else []
        )
    whose = "" if link.parent == FIXED else f"{builder.named(link.parent)}_"
    # In the plane one direction says how a body is turned.
    axes = builder.space.axes[:1] if builder.space.plane else builder.space.axes
    return [builder.direction(link.parent, axis, f"{whose}{'xyz'[int(np.argmax(axis))]}") for axis in axes]
