"""A headless Chromium for tests: no request leaves this machine, and every error of the console is kept."""

import shutil
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import urlparse

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome")
QUIET = ("--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking")
QUIET += ("--disable-component-update", "--disable-sync")
OWN = ("127.0.0.1", "localhost")


@pytest.fixture(scope="session")
def chromium():
    """A browser, started once; the tests that ask for it are skipped where there is none."""
    playwright = pytest.importorskip("playwright.sync_api", reason="no browser tests: playwright is not installed")
    found = next(filter(None, map(shutil.which, NAMES)), None)
    if found is None:
        pytest.skip(f"no browser tests: none of {', '.join(NAMES)} is installed")
    with playwright.sync_playwright() as started:
        browser = started.chromium.launch(executable_path=found, args=list(QUIET))
        yield browser
        browser.close()


@dataclass
class Seen:
    """A page, and what must not have happened in it.

    Parameters
    ----------
    page : playwright.sync_api.Page
        The page.
    errors : list of str
        Errors of the console and of scripts.
    strangers : list of str
        Addresses of other machines that were asked for; none was reached.
    """

    page: Any
    errors: list[str] = field(default_factory=list)
    strangers: list[str] = field(default_factory=list)

    def screenshot(self, path, **options):
        """Return a picture of the page as an array, shape(height, width, channels), and keep it as a file."""
        from matplotlib.image import imread

        self.page.screenshot(path=path, **options)
        return imread(path)

    def clean(self):
        """Assert that there was no error and no request to another machine."""
        assert self.errors == []
        assert self.strangers == []


@pytest.fixture
def seen(chromium):
    """Return what opens an address in a page of its own: ``seen(address, width=1200, dark=False)``."""
    contexts = []

    def opened(address, *, width=1200, height=900, dark=False, wait_until="load"):
        context = chromium.new_context(viewport={"width": width, "height": height}, color_scheme="dark" if dark else "light")
        contexts.append(context)
        found = Seen(context.new_page())

        def route(asked):
            where = urlparse(asked.request.url)
            if where.scheme in ("http", "https", "ws", "wss") and where.hostname not in OWN:
                found.strangers.append(asked.request.url)
                asked.abort()
            else:
                asked.continue_()

        context.route("**/*", route)
        found.page.on("console", lambda message: found.errors.append(message.text) if message.type == "error" else None)
        found.page.on("pageerror", lambda error: found.errors.append(str(error)))
        found.page.goto(address, wait_until=wait_until)
        return found

    yield opened
    for context in contexts:
        context.close()


@pytest.fixture
def looks_right(request, tmp_path):
    """Return what opens the file of a page, wide and narrow, and asserts that it shows itself as it should.

    It fits, is not blank, shows its title and its pictures, its tables sort, and nothing goes wrong. Where no browser can be had it is
    not looked at, for tests that have more to say of the page; those that have not are skipped, and say why.
    """
    try:
        opened = request.getfixturevalue("seen")
    except pytest.skip.Exception:
        return lambda path: None

    def looked(path):
        for width, dark in ((1200, False), (390, True)):
            shown = opened(path.as_uri(), width=width, dark=dark)
            assert shown.page.evaluate("document.documentElement.scrollWidth") <= width
            assert not blank(shown.screenshot(tmp_path / f"seen-{width}.png"))
            assert len(shown.page.locator("h1").inner_text()) > 5
            drawn = shown.page.locator(".drawing svg:visible")
            sizes = drawn.evaluate_all("each => each.map(svg => svg.getBoundingClientRect()).map(box => [box.width, box.height])")
            assert all(w > 250 and h > 40 for w, h in sizes), sizes
            if (heading := shown.page.locator("thead button:visible").first).count():
                heading.click()
                assert shown.page.locator("thead th[aria-sort]").count() == 1
            shown.clean()

    return looked


@pytest.fixture
def still(chromium):
    """Return what opens the file of a page without scripts."""
    context = chromium.new_context(java_script_enabled=False)

    def opened(path):
        page = context.new_page()
        page.goto(path.as_uri())
        return page

    yield opened
    context.close()


def opens_its_details(part):
    """Return whether a page, or a part of it, opens what is folded at a click, and only then."""
    closed = part.locator("details[open]").count() == 0
    part.locator("details summary").first.click()
    return closed and part.locator("details[open]").count() == 1


def blank(image):
    """Return whether a picture is of one colour, but for a part in a thousand."""
    import numpy as np

    colors = np.round(image[..., :3] * 255).astype(int) @ [1 << 16, 1 << 8, 1]  # one number a colour: rows take twenty times as long
    counts = np.unique(colors, return_counts=True)[1]
    return counts.max() > 0.999 * counts.sum() or len(counts) < 3
