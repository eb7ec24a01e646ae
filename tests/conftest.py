"""What all tests share: a cache directory of their own, and the scenes that every scheme is swept over."""

import os
import tempfile

import pytest

os.environ.setdefault("DAEBENCH_CACHE", tempfile.mkdtemp(prefix="daebench-tests-"))

from scenes import SCENES, scene


@pytest.fixture(params=SCENES, ids=SCENES)
def each_scene(request):
    return scene(request.param)


@pytest.fixture
def get_scene():
    return scene
