"""Keyframes as the cases of a mechanism, on its constraints."""

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import sympy as sp

from daebench.joints.angles import Angle
from daebench.joints.mechanism import Mechanism, valued_in
from daebench.joints.models.forces import Coordinates
from daebench.joints.models.links import Array, at
from daebench.joints.models.positions import Loops, Settled
from daebench.joints.placing import places_of
from daebench.joints.starts import Start
from daebench.systems.lazily import mujoco

OPEN = 1e-9
"""Residual above which a loop is not closed, m or rad."""


def cases_of(
    coordinates: Coordinates, mechanism: Mechanism, loops: Loops, reference: Settled, controls: Mapping[int, sp.Symbol]
) -> tuple[dict[str, Start], list[str]]:
    """Return the reference position and the keyframes as starts, and sentences on how far each was moved to close loops."""
    cases, remarks = {"reference": Start(about=f"released at rest in the reference position of the model{_moved(reference)}")}, []
    if reference.off > OPEN:
        remarks.append(f"the reference position was changed{_moved(reference)}")
    model, unknown = coordinates.model, _unknowns(mechanism)
    for k in range(model.nkey):
        name = re.sub(r"\W+", "_", mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_KEY, k) or f"key{k}")
        settled = loops.settled(model.key_qpos[k])
        if settled.left > OPEN:
            remarks.append(f"the keyframe {name} is left out, because its loops cannot be closed: {settled.left:.3g} is left")
            continue
        if settled.off > OPEN:
            remarks.append(f"the keyframe {name} was changed{_moved(settled)}")
        start = _start(coordinates, at(model, settled.qpos), loops, model.key_qvel[k], unknown, valued_in(mechanism))
        given = {str(u): float(model.key_ctrl[k, number]) for number, u in controls.items() if model.key_ctrl[k, number]}
        cases[name] = replace(start, parameters=given, about=f"a keyframe of the model{_moved(settled)}")
    return cases, remarks


def _moved(settled: Settled) -> str:
    """Return how far a position was moved, as the end of a sentence."""
    far = f"; its loops were open by {settled.off:.3g}, and joints were moved by {settled.moved:.3g} to close them (m or rad)"
    return far if settled.off > OPEN else ""


def _unknowns(mechanism: Mechanism) -> list[str]:
    """Return the points and directions that have unknowns of their own."""
    m = mechanism
    places = places_of(m.ground, m.points, m.directions, m.fixed_directions, {})
    for name, body in m.bodies.items():
        places.body(name, body)
    return list(places.owners)


def _start(coordinates: Coordinates, now: Any, loops: Loops, qvel: Array, unknown: list[str], valued: frozenset[str]) -> Start:
    """Return a position as a start; all digits are kept, so that the constraints hold."""
    builder, axes = coordinates.builder, coordinates.builder.space.axes
    places = {name: axes @ _gone(coordinates, now, name) for name in unknown}
    moving = {name: x for name, x in places.items() if np.abs(x - axes @ builder.fixed[name].place).max() > 1e-13 * builder.size}
    turned = {name: float(now.qpos[coordinates.model.jnt_qposadr[k]]) - coordinates.value(k) for k, name in coordinates.used.items()}
    velocity, spin = _velocities(coordinates, now, loops, qvel)
    return Start(
        at={name: _numbers(x) for name, x in moving.items()},
        # Bodies say how far a joint is turned, up to whole turns.
        angles={name: x for name, x in turned.items() if abs(x) > 3 and name in valued and isinstance(coordinates.angles[name], Angle)},
        velocity=velocity,
        spin=spin,
    )


def _gone(coordinates: Coordinates, now: Any, name: str) -> Array:
    """Return where a point or direction is in another position than the reference."""
    there, was = coordinates.builder.fixed[name], coordinates.data
    turned = now.xmat[there.link].reshape(3, 3) @ was.xmat[there.link].reshape(3, 3).T
    place: Array = now.xpos[there.link] + turned @ (there.place - was.xpos[there.link]) if there.weight else turned @ there.place
    return place


def _velocities(coordinates: Coordinates, now: Any, loops: Loops, qvel: Array) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return velocities of the points that slide, and spins of the bodies that turn; none at rest."""
    velocity: dict[str, Any] = {}
    spin: dict[str, Any] = {}
    if not qvel.any():
        return velocity, spin
    model, builder, six = coordinates.model, coordinates.builder, np.zeros(6)
    J = loops.rows(now.qpos)[0]
    now.qvel[:] = qvel - (np.linalg.lstsq(J, J @ qvel, rcond=1e-10)[0] if len(J) else 0)
    mujoco.mj_comVel(model, now)
    for number, motion in coordinates.motions.items():
        mujoco.mj_objectVelocity(model, now, mujoco.mjtObj.mjOBJ_XBODY, number, six, 0)
        name, space = builder.of[number][0], builder.space
        if motion.slides:
            arm = _gone(coordinates, now, name) - now.xpos[number]
            velocity[name] = _numbers(space.axes @ (six[3:] + np.cross(six[:3], arm)))
        if motion.turns:
            spin[builder.named(number)] = float(space.normal @ six[:3]) if space.plane else _numbers(space.axes @ six[:3])
    return velocity, spin


def _numbers(x: Array) -> tuple[float, ...]:
    return tuple(float(component) + 0.0 for component in x)
