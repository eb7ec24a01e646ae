"""Equality constraints of bodies as joints: points that stay together, and welds."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from daebench.errors import BadInput
from daebench.joints.drivers import DrivenAngle, Driver
from daebench.joints.joints import Cylindrical, Fixed, Joint, Spherical
from daebench.joints.models.builder import Builder
from daebench.joints.models.compiled import Compiled
from daebench.joints.models.links import Array
from daebench.joints.models.positions import Loops
from daebench.systems.lazily import mujoco


def close(builder: Builder, source: Compiled, loops: Loops, data: Any) -> Iterator[Joint | Driver]:
    """Yield the joints of the connect and weld constraints of a model, whose loops the data has closed."""
    model = source.model
    idle = [loops.added(seed) for seed in (1, 2)]
    for k in np.flatnonzero(model.eq_active0).tolist():
        kind = mujoco.mjtEq(model.eq_type[k]).name.removeprefix("mjEQ_").lower()
        if kind == "joint":
            continue
        if kind not in ("connect", "weld"):
            raise BadInput(
                f"{source.path}: an equality constraint is a {kind}; connect, weld and joint are read, so remove it or make it one.",
                "equality-kind-unread",
            )
        one, two, place = _ends(model, data, k, kind == "weld")
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_EQUALITY, k) or f"{kind}{k}"
        rank = min((6 if kind == "weld" else 3) - len(rows[k]) for rows in idle)
        yield from _joint(builder, source, (one, two), place, name, rank, kind == "weld")


def _ends(model: Any, data: Any, k: int, weld: bool) -> tuple[int, int, Array]:
    """Return the links of a constraint, that which comes first first, and its place."""
    ends = [model.eq_obj1id[k], model.eq_obj2id[k]]
    if model.eq_objtype[k] == mujoco.mjtObj.mjOBJ_SITE:
        place = data.site_xpos[ends[0]]
        ends = [model.site_bodyid[site] for site in ends]
    else:
        # The anchor of a weld is a point of the second body.
        body, anchor = (ends[1], model.eq_data[k, :3]) if weld else (ends[0], model.eq_data[k, :3])
        place = data.xpos[body] + data.xmat[body].reshape(3, 3) @ anchor
    one, two = sorted(int(model.body_weldid[body]) for body in ends)
    return one, two, place.copy()


def _joint(
    builder: Builder, source: Compiled, ends: tuple[int, int], place: Array, name: str, rank: int, weld: bool
) -> Iterator[Joint | Driver]:
    """Yield the joints with as many equations as a constraint adds."""
    one, two = ends
    first, second = builder.named(one), builder.named(two)
    plane = builder.space.plane
    if rank == 0 or one == two:
        return
    if rank == {(False, False): 3, (False, True): 2, (True, False): 6, (True, True): 3}[weld, plane]:
        if not weld and builder.joined(two, (point := builder.point(one, place, name))):
            return
        at = point if not weld else builder.point(one, place, name)
        yield Fixed(first, second, at) if weld else Spherical(first, second, at)
        return
    common = [x for x in builder.of[one] if x in builder.of[two] and not builder.fixed[x].weight]
    if plane or rank != (3 if weld else 2) or not common:
        raise BadInput(
            f"{source.path}: the equality constraint {name} of {first} and {second} adds {rank} equation{'s' * (rank > 1)} to those before "
            "it, and no joint has just these; leave out what holds anyway.",
            "equality-redundant-in-part",
        )
    yield Cylindrical(first, second, builder.point(one, place, name), axis=common[0])
    if weld:
        yield DrivenAngle(first, second, 0, axis=common[0])
