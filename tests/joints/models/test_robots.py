"""Robots of example-robot-data, where that is installed, against MuJoCo's accelerations."""

from importlib import metadata

import numpy as np
import pytest

pytest.importorskip("mujoco")

from model_oracle import Model, compare

from daebench.joints.models.compiled import compiled
from daebench.joints.models.mechanism import mechanism_of

ROBOTS = {
    "panda": "panda_description/urdf/panda.urdf",
    "z1": "z1_description/urdf/z1.urdf",
    "ur5": "ur_description/urdf/ur5_robot.urdf",
    "kinova": "kinova_description/robots/kinova.urdf",
    "solo12": "solo_description/robots/solo12.urdf",
}


def installed():
    """Return the files of the package by the end of their names."""
    try:
        return [file.locate() for file in metadata.files("example-robot-data") or ()]
    except metadata.PackageNotFoundError:
        return []


@pytest.mark.slow
@pytest.mark.parametrize("name", ROBOTS)
def test_a_robot_accelerates_as_in_mujoco(name):
    paths = [path for path in installed() if path.as_posix().endswith(ROBOTS[name])]
    if not paths:
        pytest.skip("example-robot-data is not installed")
    source = compiled(paths[0])
    model = Model(source.model)
    model.random(np.random.default_rng(5))
    difference, largest = compare(model, mechanism_of(source)[0], "xyz")
    assert difference < 1e-9 * max(1.0, largest)
