"""Parts of a model that a mechanism of ``daebench.joints`` has not, with counts."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from daebench.joints.models.forces import controls_of
from daebench.joints.models.names import Names
from daebench.systems.lazily import mujoco


class LeftOut(UserWarning):
    """Parts of a model file that a mechanism has not."""


def left_out(model: Any) -> dict[str, int]:
    """Return the numbers of parts of a model that the mechanism leaves out, by what they are."""
    m = model
    touching = (m.geom_contype | m.geom_conaffinity) != 0
    counts = {
        "geoms with contacts": touching.sum(),
        "joint limits": (m.jnt_limited != 0).sum(),
        "joints with friction": np.unique(m.dof_jntid[m.dof_frictionloss > 0]).size,
        "tendons": m.ntendon,
        "meshes": m.nmesh,
        "flexes": m.nflex,
        "bodies with gravity compensation": (m.body_gravcomp != 0).sum(),
        "control ranges": (m.actuator_ctrllimited != 0).sum(),
        "force ranges": (m.actuator_forcelimited != 0).sum() + (m.jnt_actfrclimited != 0).sum(),
        "actuators with dynamics": (m.actuator_dyntype != mujoco.mjtDyn.mjDYN_NONE).sum(),
        "actuators of other kinds": m.nu - len(controls_of(m, Names(m))),
        "plugins": m.nplugin,
        "fluid forces": int(m.opt.density > 0 or m.opt.viscosity > 0),
        "equality constraints that are switched off": (~m.eq_active0.astype(bool)).sum(),
    }
    return {what: int(count) for what, count in counts.items() if count}


def sentence(counts: Mapping[str, int]) -> str:
    """Return a list of the parts that are left out, as the end of a sentence."""
    return ", ".join(f"{count} {what}" for what, count in counts.items()) or "nothing"
