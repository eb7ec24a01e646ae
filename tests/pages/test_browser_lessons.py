"""Lessons in a real browser: each opens, a control moves, the picture changes, and nothing is asked of another machine."""

import re
import select
import subprocess
import sys
from pathlib import Path

import pytest
from browser import blank

from daebench.methods.catalogue import lessons
from daebench.pages.lesson.live_page import lives_in_a_page
from daebench.pages.lesson.page import export

pytestmark = pytest.mark.slow

EVERY = sorted(lessons())
DRAWN = [name for name in EVERY if not lives_in_a_page(name)]
"""Lessons whose page has pictures that were drawn beforehand."""

ROOT = Path(__file__).parents[2]
FEW = ("poisson-maps",)
"""Lessons that are served in every run of the tests."""

STARTED = 180.0
"""Seconds in which a lesson has compiled what it needs, on a machine that has nothing of it."""


@pytest.fixture(scope="module")
def pages(tmp_path_factory, chromium):
    """Return the static page of a lesson, made once."""
    folder = tmp_path_factory.mktemp("lessons")
    return lambda name: folder / name / "index.html" if (folder / name).exists() else export(name, folder / name)


@pytest.fixture
def live(chromium):
    """Return the address of a lesson that is served; the server ends with the test."""
    started = []

    def address(name):
        words = [sys.executable, "-m", "daebench", "lesson", name, "--no-browser"]
        process = subprocess.Popen(words, cwd=ROOT, stdout=subprocess.PIPE, text=True, start_new_session=True)
        started.append(process)
        assert select.select([process.stdout], [], [], 60)[0], f"lesson {name} does not listen"
        return re.search(r"http://127\.0\.0\.1:\d+/[\w-]+/", process.stdout.readline())[0]

    yield address
    for process in started:
        process.terminate()
        process.wait(timeout=20)
        process.stdout.close()


@pytest.mark.parametrize("name", [name if name in FEW else pytest.param(name, marks=pytest.mark.exhaustive) for name in EVERY])
def test_a_live_lesson_answers_a_control_with_another_picture(name, live, seen, tmp_path):
    shown = seen(live(name))
    page = shown.page
    page.wait_for_selector(".shown svg.panels", timeout=1000 * STARTED)
    page.wait_for_selector("summary, marimo-accordion, details", timeout=20_000)
    drawing = page.locator(".shown").first
    before = drawing.inner_html()
    slider = page.locator("[role=slider]").first
    slider.focus()
    slider.press("ArrowRight")
    page.wait_for_function("before => document.querySelector('.shown').innerHTML !== before", arg=before, timeout=10_000)
    assert drawing.locator("svg.panels").count() >= 1
    assert not blank(shown.screenshot(tmp_path / "live.png"))
    assert lessons()[name]
    shown.clean()


@pytest.mark.parametrize("name", DRAWN)
@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_a_static_page_turns_its_pictures_and_fits_a_phone(name, dark, pages, seen, tmp_path):
    shown = seen(pages(name).as_uri(), width=390, dark=dark)
    page = shown.page
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    for film in page.locator(".film").all():
        drawing = film.locator(".drawing")
        before = drawing.inner_html()
        slider = film.locator("input[type=range]").first
        slider.focus()
        slider.press("ArrowRight")
        slider.press("ArrowRight")
        assert drawing.inner_html() != before
        assert slider.get_attribute("aria-valuetext")
    assert page.locator("main > details[open]").count() == 0
    page.locator("main > details summary").first.click()
    assert page.locator("main > details[open]").count() == 1
    image = shown.screenshot(tmp_path / "page.png", full_page=True)
    assert image.shape[1] == 390
    assert not blank(image)
    shown.clean()


def test_without_scripts_a_static_page_shows_the_default_picture_and_no_controls(pages, chromium):
    context = chromium.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto(pages(DRAWN[0]).as_uri())
    assert page.locator(".film .drawing svg").count() >= 1
    assert page.locator(".film .knobs").first.is_hidden()
    context.close()
