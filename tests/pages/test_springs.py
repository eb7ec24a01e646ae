"""Springs and dampers of a mechanism are drawn, between the points that they are between."""

from dataclasses import replace

import numpy as np
import pytest

from daebench.compiler.definition import source_of
from daebench.draw.scene import END, ZIGZAG, layout_of, zigzag
from daebench.draw.trajectory import figure
from daebench.joints import Damper, Mechanism, Rod, Spring
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.pages.animation.animated_runs import AnimatedRuns
from daebench.pages.animation.panels import lines_at
from daebench.pages.animation.raster import frames
from daebench.pages.animation.recorded_run import recorded_run
from daebench.runs.make_ivp import make_ivp
from daebench.runs.request import Request

TIMES = np.linspace(0, 0.5, 6)


@pytest.fixture(scope="module")
def ivp():
    """A rod on a hinge, that a spring holds up and a damper slows down; the two are on different pins."""
    pendulum = Mechanism(
        ground={"O": (0, 0), "S": (0, "1.5"), "D": ("1.5", 0)},
        points={"A": (1, 0)},
        bodies={"arm": Rod("O", "A", mass=1)},
        forces=[Spring("S", "A", stiffness=10, length=1), Damper("D", "A", "0.5")],
        gravity=(0, "-9.81"),
    )
    return make_ivp(source_of(pendulum.problem(), "pendulum"), "rest")


@pytest.fixture(scope="module")
def method():
    return FixedStep("rattle", compiled=False)


@pytest.fixture(scope="module")
def animated(ivp, method):
    run = recorded_run(ivp, method, 0.05, TIMES, lambda fraction: None)
    return AnimatedRuns("pendulum", ivp.case, ivp.parameters, layout_of(ivp), [run], TIMES, 0.2)


def test_a_zigzag_goes_from_end_to_end_and_is_as_wide_however_long_it_is():
    for length in (2.0, 3.0):
        line = zigzag(np.array([[1.0, 1.0], [1.0, 1.0 + length]]), 0.1)
        assert len(line) == ZIGZAG + 4
        assert np.allclose(line[[0, -1]], [[1, 1], [1, 1 + length]], rtol=0, atol=1e-15)
        assert np.allclose(line[[1, -2], 1], [1 + END * length, 1 + (1 - END) * length], rtol=0, atol=1e-15)
        assert np.allclose(sorted({*np.round(line[:, 0], 12)}), [0.9, 1.0, 1.1], rtol=0, atol=1e-12)
    assert np.ptp(zigzag(np.array([[0.0, 0.0], [0.4, 0.0]]), 0.1)[:, 1]) == pytest.approx(0.1)  # a short one is narrower


def test_a_frame_has_them_where_their_points_are_and_its_pixels_too(animated):
    a = animated.points[0][-1, animated.layout.rods[0][1]]
    lines = lines_at(animated, 0, len(animated.points[0]) - 1)
    assert list(lines) == ["trail", "springs", "dampers", "rods", "masses"]
    (spring,), (damper,) = lines["springs"], lines["dampers"]
    assert np.array_equal(spring[[0, -1]], [[0, 1.5], a])
    assert np.array_equal(damper, [[1.5, 0], a])
    without = replace(animated, layout=replace(animated.layout, springs=[], dampers=[]))
    assert np.any(next(frames(animated)) != next(frames(without)), axis=2).sum() > 100


def test_a_still_picture_has_them_too(ivp, method):
    run = replace(method.solve(ivp, Request(value=0.05, steps=10, watch=("energy",))), ivp=ivp)
    lines = figure(run).axes[0].lines
    points = layout_of(ivp).at(run.q)[-1]
    a = points[layout_of(ivp).rods[0][1]]
    zigzags = [line.get_xydata() for line in lines if len(line.get_xdata()) == ZIGZAG + 4]
    dashed = [line.get_xydata() for line in lines if line.get_linestyle() == "--"]
    assert np.allclose(zigzags[0][[0, -1]], [[0, 1.5], a])
    assert np.allclose(dashed[0], [[1.5, 0], a])
