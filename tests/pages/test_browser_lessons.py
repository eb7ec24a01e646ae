"""The lesson whose pictures were drawn beforehand, in a real browser: a control moves, and the picture changes."""

import pytest
from browser import blank

from daebench.pages.lesson.page import export

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def page_of_tolerance(tmp_path_factory, chromium):
    """Return the page, made once."""
    return export("tolerance", tmp_path_factory.mktemp("lessons") / "tolerance")


@pytest.mark.sampled(left_out=("light",))
@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_a_static_page_turns_its_pictures_and_fits_a_phone(dark, page_of_tolerance, seen, tmp_path):
    shown = seen(page_of_tolerance.as_uri(), width=390, dark=dark)
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
    assert page.locator("main details[open]").count() == 0
    page.locator("main details summary").first.click()
    assert page.locator("main details[open]").count() == 1
    image = shown.screenshot(tmp_path / "page.png", full_page=True)
    assert image.shape[1] == 390
    assert not blank(image)
    shown.clean()


def test_without_scripts_a_static_page_shows_the_default_picture_and_no_controls(page_of_tolerance, chromium):
    context = chromium.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto(page_of_tolerance.as_uri())
    assert page.locator(".film .drawing svg").count() >= 1
    assert page.locator(".film .controls").first.is_hidden()
    context.close()
