"""How the joints of MuJoCo between a body and its parent let it move: which directions it slides in, and how it turns."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from daebench.errors import BadInput
from daebench.joints.models.links import Array, Link
from daebench.joints.models.space import ROUNDED, Space, parallel
from daebench.systems.lazily import mujoco


@dataclass(frozen=True)
class Motion:
    """How a body moves against its parent."""

    place: Array
    """Point about which it turns, or where it slides; shape(3,)."""
    slides: tuple[Array, ...]
    """Directions, fixed in the parent, in which the point goes."""
    turns: tuple[Array, ...]
    """Axes about which it turns at the reference position; three if it turns freely."""


def motion_of(path: Path, model: Any, data: Any, link: Link, space: Space) -> Motion:
    """Return how a link moves against its parent; raise BadInput if no joints of ``daebench.joints`` let it move so."""
    kinds = [mujoco.mjtJoint(model.jnt_type[k]).name.removeprefix("mjJNT_").lower() for k in link.joints]
    if kinds == ["free"]:
        return Motion(link.centre, tuple(np.eye(3)), tuple(np.eye(3)))
    axes = {k: data.xaxis[k].copy() for k in link.joints}
    slides = [axes[k] for k, kind in zip(link.joints, kinds, strict=True) if kind == "slide"]
    hinges = [axes[k] for k, kind in zip(link.joints, kinds, strict=True) if kind == "hinge"]
    pivots = [data.xanchor[k].copy() for k, kind in zip(link.joints, kinds, strict=True) if kind != "slide"]
    place = pivots[0] if pivots else data.xpos[link.number].copy()
    turns = list(np.eye(3)) if "ball" in kinds else hinges
    motion = Motion(place, tuple(slides), tuple(turns))
    # A slide after a hinge goes along an axis that turns with it; only where it is the hinge's own axis does that not matter.
    ordered = kinds == sorted(kinds, key=lambda kind: kind != "slide") or _along(slides, hinges)
    if ordered and _together(pivots) and _independent(slides) and _independent(turns) and _known(motion, link.parent == 0, space):
        return motion
    raise BadInput(
        f"{path}: body {link.name} has the joints {', '.join(kinds)}, which are not read in this arrangement. daebench reads one joint, "
        "slides of the ground before a hinge or ball, a hinge along a slide, and two or three hinges at right angles in one point; put "
        "bodies between the others.",
        "joint-arrangement-unread",
    )


def _known(motion: Motion, grounded: bool, space: Space) -> bool:
    """Return whether there are joints for a motion."""
    slides, turns = len(motion.slides), len(motion.turns)
    if space.plane:
        return slides + turns <= 1 or slides == 2 or grounded
    if slides == 0 or slides == 3:
        return turns != 2 or (slides == 0 and abs(float(motion.turns[0] @ motion.turns[1])) < ROUNDED)
    return turns != 2 if grounded else slides == 1 and (turns == 0 or (turns == 1 and parallel(motion.slides[0], motion.turns[0])))


def _along(slides: Sequence[Array], hinges: Sequence[Array]) -> bool:
    return len(slides) == len(hinges) == 1 and parallel(slides[0], hinges[0])


def _together(places: Sequence[Array]) -> bool:
    return all(np.linalg.norm(place - places[0]) < ROUNDED for place in places)


def _independent(directions: Sequence[Array]) -> bool:
    return not directions or int(np.linalg.matrix_rank(np.array(directions), tol=1e-3)) == len(directions)
