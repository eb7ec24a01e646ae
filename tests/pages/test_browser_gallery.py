"""The gallery in a real browser: cards lead to pages and back, tables sort, light, dark, narrow and printed pages show what they have."""

import re
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pandas as pd
import pytest
from browser import blank
from matplotlib.image import imread

from daebench.draw.figures import STROKES, drawing, grid_of_axes, save
from daebench.pages.report import number, picture, table, with_error, write_page
from daebench.pages.report.gallery import build_all
from daebench.pages.report.reports import Report

pytestmark = pytest.mark.slow

TEXT = """{% extends "page.html" %}{% block title %}Sizes of things{% endblock %}
{% block content %}
{% for k in range(5) %}<h2 id="part{{ k }}">Part {{ k }}</h2><p>Words.</p>{% endfor %}{{ drawn }}{{ shown }}
{% endblock %}"""
SIZES = {"b": 2e-9, "a": 1.5, "d": -3.0, "c": float("nan"), "e": 1e7}


def make(out, progress):
    with drawing():
        figure, axes = grid_of_axes(1, 1, 2.0)
        axes[0, 0].plot([0, 1], [0, 1], **STROKES[0].line())
    drawn = picture(save(figure, out / "figures", "line", {"x": [0.0, 1.0]}), "A line that rises", "A line")
    frame = pd.DataFrame({"name": list(SIZES), "size": list(SIZES.values())})
    frame["known"] = [with_error(value, abs(value) / 10) for value in SIZES.values()]
    shown = table("few", frame, {"name": str, "size": number, "known": str}, {}, "Few")
    return write_page(TEXT, out / "index.html", "daebench report sizes", drawn=drawn, shown=shown)


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    folder = tmp_path_factory.mktemp("gallery")
    reports = [Report(name, f"About {name}", f"daebench report {name}", make) for name in ("sizes", "more-sizes")]
    build_all(folder, reports, lambda fraction, doing: None, lambda made: None)
    return folder


def column(page, k):
    return [row.locator("th, td").nth(k).inner_text() for row in page.locator("tbody tr").all()]


def test_cards_lead_to_pages_and_back(out, seen, tmp_path):
    shown = seen((out / "index.html").as_uri())
    assert shown.page.locator("article").count() == 2
    assert all(shown.page.evaluate("[...document.images].map(each => each.complete && each.naturalWidth > 100)"))
    assert not blank(shown.screenshot(tmp_path / "index.png"))
    shown.page.click("article h3 a >> nth=0")
    assert shown.page.url == (out / "more-sizes" / "index.html").as_uri()
    shown.page.click("nav.sections summary")
    shown.page.click("nav.sections a >> nth=3")
    assert shown.page.url.endswith("#part3")
    shown.page.click("nav.up a")
    assert shown.page.url == (out / "index.html").as_uri()
    shown.clean()


def test_a_click_on_a_heading_sorts_by_it_and_the_third_puts_rows_back(out, seen):
    shown = seen((out / "sizes" / "index.html").as_uri())
    size = shown.page.locator("thead button").nth(1)
    orders = []
    for _ in range(3):
        size.focus()
        shown.page.keyboard.press("Enter")
        orders.append(("".join(column(shown.page, 0)), shown.page.locator("thead th").nth(1).get_attribute("aria-sort")))
    assert orders == [("dbaec", "ascending"), ("eabdc", "descending"), ("badce", None)]
    shown.page.locator("thead button").nth(0).click()
    assert column(shown.page, 0) == ["a", "b", "c", "d", "e"]
    shown.clean()


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_a_page_and_its_drawing_are_light_or_dark(out, seen, tmp_path, dark):
    shown = seen((out / "sizes" / "index.html").as_uri(), width=390, dark=dark)
    shown.page.locator(".drawing svg").screenshot(path=tmp_path / "drawing.png")
    for image in (shown.screenshot(tmp_path / "page.png", full_page=True), imread(tmp_path / "drawing.png")):
        assert (np.median(image[..., :3]) < 0.3) == dark


def test_print_leaves_out_what_only_a_screen_needs(out, seen, tmp_path):
    shown = seen((out / "sizes" / "index.html").as_uri(), dark=True)
    pdf = shown.page.pdf(prefer_css_page_size=True)
    assert pdf.startswith(b"%PDF")
    assert len(re.findall(rb"/Type\s*/Page\b", pdf)) in (1, 2)
    shown.page.emulate_media(media="print")
    assert not any(each.is_visible() for each in shown.page.locator(".up, .sections, .files").all())
    assert shown.page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    shown.clean()


def test_without_scripts_a_page_has_all_it_says(out, still):
    text = " ".join(still(out / "sizes" / "index.html").locator("main").inner_text().split())
    assert [word for word in ("Sizes of things", "Part 4", "Few", "size", "known") if word not in text] == []


KEPT = Path(__file__).parents[2] / "reports" / "gallery" / "gallery.zip"


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    folder = tmp_path_factory.mktemp("kept")
    with ZipFile(KEPT) as archive:
        archive.extractall(folder)
    return folder


@pytest.mark.sampled(by=lambda case: case.startswith(("index", "methods", "lesson-extremes")))
@pytest.mark.parametrize("page", sorted(name for name in ZipFile(KEPT).namelist() if name.endswith("index.html")))
def test_every_page_of_the_gallery_that_is_kept_looks_right(page, kept, chromium, looks_right):
    looks_right(kept / page)
