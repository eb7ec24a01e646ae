"""Animations in a real browser: they play, stop, and go to any time."""

import re

import numpy as np
import pytest
from browser import blank

from daebench.draw.scene import layout_of, zigzag
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.pages.animation import page, smil
from daebench.pages.animation.animated_runs import AnimatedRuns
from daebench.pages.animation.panels import scene_panel
from daebench.pages.animation.recorded_run import recorded_run

pytestmark = pytest.mark.slow

TIMES = np.linspace(0, 4, 41)


@pytest.fixture(scope="module")
def animated():
    ivp = initial_value_problem("spherical_pendulum", "fig1.2")
    runs = [recorded_run(ivp, FixedStep(name, compiled=False), 0.02, TIMES, lambda fraction: None) for name in ("shake", "rattle")]
    return AnimatedRuns(ivp.problem, ivp.case, ivp.parameters, layout_of(ivp), runs, TIMES, 2.0)


@pytest.fixture(scope="module")
def address(animated, tmp_path_factory):
    path = tmp_path_factory.mktemp("animation") / "pendulum.html"
    page.write(path, animated)
    return path.as_uri()


def rods(shown):
    return shown.page.eval_on_selector_all("path.rods", "each => each.map(one => one.getAttribute('d'))")


def test_it_plays_to_the_end_stops_and_starts_again(seen, address):
    shown = seen(address)
    shown.page.wait_for_function("document.getElementById('time').value === '40'", timeout=15000)
    end = rods(shown)
    button = shown.page.get_by_role("button")
    assert button.inner_text() == "Play"
    button.click()
    shown.page.wait_for_function("Number(document.getElementById('time').value) < 40", timeout=5000)
    assert button.inner_text() == "Pause"
    assert rods(shown) != end
    button.click()
    still = shown.page.input_value("#time")
    shown.page.wait_for_timeout(300)
    assert shown.page.input_value("#time") == still
    shown.clean()


def test_the_slider_moves_scenes_cursors_and_numbers_by_the_keyboard_too(seen, address, animated):
    shown = seen(address)
    slider = shown.page.get_by_role("slider", name="Time")
    slider.fill("10")
    before = rods(shown)
    assert slider.get_attribute("aria-valuetext") == "t = 1.000"
    width = 380 - 62 - 12
    shifts = shown.page.eval_on_selector_all(".cursor", "each => each.map(one => one.transform.baseVal.getItem(0).matrix.e)")
    assert shifts == pytest.approx([width / 4] * 3, abs=0.5)
    slider.press("ArrowRight")
    assert slider.get_attribute("aria-valuetext") == "t = 1.100"
    assert rods(shown) != before
    told = [float(text) for text in shown.page.locator("dd[data-error=energy_error]").all_inner_texts()]
    assert told == pytest.approx([each.errors["energy_error"][11] for each in animated.runs], rel=0.06)
    shown.clean()


def test_where_less_motion_is_wanted_it_stands_still(seen, address):
    shown = seen(address)
    shown.page.emulate_media(reduced_motion="reduce")
    shown.page.reload()
    shown.page.wait_for_timeout(200)
    assert shown.page.input_value("#time") == "0"
    shown.clean()


@pytest.mark.parametrize(("width", "dark"), [(1200, False), (390, True)], ids=["wide and light", "phone and dark"])
def test_it_fits_and_is_light_or_dark(seen, address, tmp_path, width, dark):
    shown = seen(address, width=width, dark=dark)
    assert shown.page.evaluate("document.documentElement.scrollWidth") <= width
    image = shown.screenshot(tmp_path / "page.png", full_page=True)
    assert not blank(image)
    assert (image[0, 0, :3].mean() < 0.3) == dark


def test_without_scripts_the_start_and_the_whole_curves_are_there(still, animated, tmp_path):
    page.write(tmp_path / "pendulum.html", animated)
    shown = still(tmp_path / "pendulum.html")
    assert not shown.get_by_role("button").is_visible()
    assert (shown.locator("path.rods").count(), shown.locator(".graphs svg").count()) == (2, 3)


def test_the_drawing_moves_by_itself(seen, animated, tmp_path):
    smil.write(tmp_path / "pendulum.svg", animated)
    shown = seen((tmp_path / "pendulum.svg").as_uri())
    first = shown.screenshot(tmp_path / "first.png")
    shown.page.wait_for_timeout(500)
    second = shown.screenshot(tmp_path / "second.png")
    assert not blank(first)
    assert np.abs(first - second).max() > 0.3
    shown.clean()


def test_springs_and_dampers_are_where_their_points_are(seen, tmp_path):
    ivp = initial_value_problem("driven_slider_crank")
    times = np.linspace(0, 0.4, 21)
    run = recorded_run(ivp, FixedStep("rattle", compiled=False), 0.01, times, lambda fraction: None)
    moving = AnimatedRuns(ivp.problem, ivp.case, ivp.parameters, layout_of(ivp), [run], times, 1.0)
    page.write(tmp_path / "crank.html", moving)
    shown = seen((tmp_path / "crank.html").as_uri())
    shown.page.get_by_role("slider", name="Time").fill("13")
    frame = scene_panel(moving, 0).frame(0, 0, *page.SCENE)
    points = moving.flat[0][run.shown(times)[13]]
    lines = {"springs": [zigzag(points[pair], moving.amplitude) for pair in moving.layout.springs]}
    lines["dampers"] = [points[pair] for pair in moving.layout.dampers]
    for kind, expected in lines.items():
        drawn = shown.page.locator(f"path.{kind}").get_attribute("d")
        pixels = np.array([[float(x) for x in re.findall(r"-?[\d.]+", place)] for place in re.split("[ML]", drawn) if place.strip()])
        assert len(expected) > 0
        assert pixels == pytest.approx(np.concatenate([np.stack(frame(*line.T), axis=-1) for line in expected]), abs=0.15)
    shown.clean()
