"""The lesson whose pictures were drawn beforehand, in a real browser: a control moves, and the picture changes."""

import pytest
from browser import opens_its_details

from daebench.pages.lesson.page import export

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def page_of_tolerance(tmp_path_factory, chromium):
    """Return the page, made once."""
    return export("tolerance", tmp_path_factory.mktemp("lessons") / "tolerance")


def test_a_static_page_turns_its_pictures_and_fits_a_phone(page_of_tolerance, seen, looks_right):
    looks_right(page_of_tolerance)
    shown = seen(page_of_tolerance.as_uri(), width=390)
    for film in shown.page.locator(".film").all():
        before = film.locator(".drawing").inner_html()
        slider = film.locator("input[type=range]").first
        slider.focus()
        slider.press("ArrowRight")
        slider.press("ArrowRight")
        assert film.locator(".drawing").inner_html() != before
        assert slider.get_attribute("aria-valuetext")
    assert opens_its_details(shown.page.locator("main"))
    shown.clean()


def test_without_scripts_a_static_page_shows_the_default_picture_and_no_controls(page_of_tolerance, still):
    page = still(page_of_tolerance)
    assert page.locator(".film .drawing svg").count() >= 1
    assert page.locator(".film .controls").first.is_hidden()
