"""``daebench open``: which page it finds, where it is asked to look, and that it opens that page; no browser is started."""

import json
from pathlib import Path
from urllib.parse import urlparse
from urllib.request import url2pathname
from zipfile import ZipFile

import pytest


def path_of(address):
    return Path(url2pathname(urlparse(address.strip()).path))


@pytest.fixture
def opened(monkeypatch):
    """Return the addresses that a browser was asked for."""
    addresses = []
    monkeypatch.setattr("webbrowser.open", addresses.append)
    return addresses


@pytest.fixture
def small_gallery(tmp_path, monkeypatch):
    """Let the gallery of the package be one of two pages."""
    (tmp_path / "reports" / "gallery").mkdir(parents=True)
    with ZipFile(tmp_path / "reports" / "gallery" / "gallery.zip", "w") as archive:
        archive.writestr("index.html", "all pages")
        archive.writestr("problems/index.html", "all problems")
    monkeypatch.setattr("daebench.cli.opening.folder", lambda package: tmp_path / "reports")
    monkeypatch.setenv("DAEBENCH_CACHE", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_gallery_of_ones_own_comes_before_that_of_the_sources(daebench, small_gallery, opened):
    assert daebench("open", "gallery")[0] == 0
    assert path_of(opened[-1]).read_text() == "all pages"
    (small_gallery / "output").mkdir()
    (small_gallery / "output" / "index.html").write_text("mine")
    status, out, _ = daebench("open", "gallery")
    assert (status, out) == (0, f"{opened[-1]}\n")
    assert path_of(out) == small_gallery / "output" / "index.html"
    assert len(opened) == 2


def test_without_a_gallery_it_says_what_writes_one(daebench, small_gallery, opened):
    (small_gallery / "reports" / "gallery" / "gallery.zip").unlink()
    status, _, err = daebench("open", "gallery")
    assert (status, err.count("daebench report all --out output"), daebench.error.code, opened) == (2, 1, "no-gallery", [])


def test_a_problem_is_opened_at_its_place(daebench, small_gallery, opened):
    (address,) = daebench("open", "torus", "--no-browser")[1].splitlines()
    assert urlparse(address).fragment == "torus"
    assert path_of(address).read_text() == "all problems"
    page = small_gallery / "pages" / "problems" / "torus.html"
    lesson = small_gallery / "pages" / "lesson-why-symplectic-torus" / "index.html"
    for path in (page, lesson):
        path.parent.mkdir(parents=True)
        for file in (path, path.with_name("index.html"), small_gallery / "pages" / "index.html"):
            file.write_text(file.name)
        assert json.loads(daebench("open", "torus", "--in", "pages", "--json", "--no-browser")[1]) == {"page": path.as_uri()}
    assert opened == []
