"""Mechanisms read from model files against MuJoCo's accelerations on trees, and against a KKT system with its matrices on loops."""

from dataclasses import replace
from pathlib import Path

import pytest

pytest.importorskip("mujoco")

from model_oracle import Model, compare

from daebench.joints.models.compiled import compiled
from daebench.joints.models.mechanism import mechanism_of

MODELS = Path(__file__).parents[2] / "models"

PLANE = {"gripper.urdf": "yz"} | dict.fromkeys(
    ("cart_pole.xml", "double_pendulum.xml", "five_bar.xml", "geared_plane.xml", "pendulum.xml"), "xz"
)
"""Models whose bodies stay in a plane, and its axes."""

FILES = sorted(path.name for path in MODELS.iterdir() if path.suffix in (".xml", ".urdf"))

LEFT_OUT = ("ball_joint.xml", "delta.xml", "double_pendulum.xml", "free_body.xml", "leg.urdf", "pendulum.xml", "seven_joint_arm.xml")
LEFT_OUT += ("turntable.xml",)
"""Models that are left to the day of a release: others have each of their joints and constraints."""

CLOSENESS = 1e-9

CONTROLS = (0.7, -0.3, 1.1, 0.4)


@pytest.mark.sampled(left_out=LEFT_OUT)
@pytest.mark.parametrize("name", FILES)
def test_points_and_directions_of_bodies_accelerate_as_in_mujoco(random, name):
    source = compiled(MODELS / name)
    mechanism, _ = mechanism_of(source)
    model = Model(source.model)
    mechanism = replace(mechanism, parameters=dict(zip(mechanism.parameters, CONTROLS, strict=False)))
    model.d.ctrl[:] = CONTROLS[: source.model.nu]
    model.random(random)
    difference, largest = compare(model, mechanism, PLANE.get(name, "xyz"))
    assert difference < CLOSENESS * max(1.0, largest)
