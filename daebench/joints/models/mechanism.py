"""From a compiled model to a mechanism of ``daebench.joints``."""

from dataclasses import replace
from typing import Any

import numpy as np

from daebench.errors import BadInput
from daebench.joints.constraints import Tie
from daebench.joints.mechanism import Mechanism
from daebench.joints.models.builder import Builder
from daebench.joints.models.cases import OPEN, cases_of
from daebench.joints.models.closures import close
from daebench.joints.models.compiled import Compiled
from daebench.joints.models.forces import Coordinates, controls_of
from daebench.joints.models.links import FIXED, Link, at, links_of
from daebench.joints.models.motions import motion_of
from daebench.joints.models.names import Names
from daebench.joints.models.positions import Loops
from daebench.joints.models.space import space_of
from daebench.joints.models.tree import tie
from daebench.joints.placing import Guided
from daebench.systems.lazily import mujoco


def mechanism_of(source: Compiled) -> tuple[Mechanism, list[str]]:
    """Return the mechanism of a model, and sentences on what was changed for it."""
    if not source.model.nv:
        raise BadInput(f"{source.path}: no body of the model moves; give one a joint.", "model-without-motion")
    model, loops = source.model, Loops(source.model)
    start = loops.settled(model.qpos0)
    if start.left > OPEN:
        raise BadInput(
            f"{source.path}: its equality constraints cannot all hold: {start.left:.3g} (m or rad) is left; correct their anchors.",
            "equalities-contradictory",
        )
    data = at(model, start.qpos)
    builder, links = _builder(model, data)
    motions = {link.number: motion_of(source.path, model, data, link, builder.space) for link in links}
    joints: list[Tie] = [joint for link in links for joint in tie(builder, link, motions[link.number])]
    joints += close(builder, source, loops, data)
    for link in links:
        # A body is drawn by its points, of which it has one at least.
        if not any(builder.fixed[name].weight for name in builder.of[link.number][1:]):
            builder.point(link.number, link.centre, f"{link.name}_centre")
    coordinates = Coordinates(source.path, model, data, builder, motions, Names(model))
    controls = controls_of(model, Names(model))
    forces = [*coordinates.passive(), *coordinates.actuators(controls)]
    joints += coordinates.couplings()
    # Before the points and directions: a body may get some of its own.
    bodies = {link.name: builder.body(link) for link in links}
    mechanism = Mechanism(
        **_placed(builder),
        bodies=bodies,
        angles=coordinates.angles,
        joints=tuple(joints),
        forces=tuple(forces),
        gravity=_gravity(model, builder),
        parameters=dict.fromkeys(controls.values(), 0.0),
    )
    cases, remarks = cases_of(coordinates, mechanism, loops, start, controls)
    return replace(mechanism, cases=cases), remarks


def _builder(model: Any, data: Any) -> tuple[Builder, list[Link]]:
    """Return the names of a model's links, none of which has points yet, and the links."""
    names = Names(model)
    links = links_of(model, data, names)
    space = space_of(model, data, links)
    size = max([float(np.linalg.norm(link.centre - links[0].centre)) for link in links] + [float(model.stat.extent), 1e-3])
    return Builder(space, names, {link.number: link for link in links}, size, of={FIXED: []}), links


def _placed(builder: Builder) -> dict[str, Any]:
    """Return the points and directions of a mechanism, and of its ground."""
    parts: dict[str, dict[str, Any]] = {"ground": {}, "points": {}, "directions": {}, "fixed_directions": {}}
    for name, there in builder.fixed.items():
        part = ("fixed_directions", "ground") if there.link == FIXED else ("directions", "points")
        place: Any = builder.space.vector(there.place, builder.size if there.weight else 1.0)
        if name in builder.guides:
            place = Guided(place, *(builder.space.vector(axis) for axis in builder.guides[name]))
        parts[part[there.weight]][name] = place
    return parts


def _gravity(model: Any, builder: Builder) -> tuple[float, ...] | None:
    """Return the gravity of a model in the mechanism's space; None where there is none."""
    g = model.opt.gravity
    off = model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_GRAVITY)
    pull = builder.space.vector(g, float(np.abs(g).max()))
    return pull if any(pull) and not off else None
