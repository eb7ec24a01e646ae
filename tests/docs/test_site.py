"""The site is built without a warning and needs nothing from elsewhere; its search answers in an opened file."""

import re
import subprocess
import sys
from html.parser import HTMLParser
from urllib.parse import unquote, urlparse

import pytest
import typer
from said import DOCS

import daebench
from daebench.cli.app import app
from daebench.methods.catalogue import problems, reports, schemes

FETCHED = {"img": "src", "script": "src", "link": "href", "iframe": "src", "source": "srcset", "object": "data"}


FIRST = {
    "bounded": "reference/glossary.html#term-bounded",
    "treatment": "reference/glossary.html#term-treatment",
    "meaning of bounded": "reference/glossary.html",
    "what is suppress": "reference/glossary.html",
    "how long": "how-to/how-long.html",
    "MuJoCo": "how-to/coming-from.html",
    "how to cite": "reference/citing.html",
}
"""Words that a reader looks for, and the page that the search names first."""


class Page(HTMLParser):
    """What a page has: anchors, links, and addresses that a browser fetches."""

    def __init__(self, path):
        super().__init__()
        self.path, self.anchors, self.links, self.fetched = path, set(), [], []
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        given = {name: value for name, value in attributes if value}
        self.anchors |= {given.get("id"), given.get("name")} - {None}
        self.links += [given["href"]] if tag == "a" and "href" in given else []
        self.fetched += [given[FETCHED[tag]]] if FETCHED.get(tag) in given else []


def read(out):
    return {path: Page(path) for path in out.rglob("*.html") if "reports" not in path.relative_to(out).parts}


def dangling(pages):
    """Return the links that lead nowhere, by page."""
    wrong = []
    for page, link in ((each, link) for each in pages.values() for link in each.links):
        parts = urlparse(link)
        target = (page.path.parent / unquote(parts.path)).resolve() if parts.path else page.path
        lost = parts.fragment and target in pages and unquote(parts.fragment) not in pages[target].anchors
        if not (parts.scheme or parts.netloc) and (lost or not target.exists()):
            wrong.append((page.path.name, link))
    return wrong


def from_elsewhere(pages, out):
    """Return addresses of other machines that a browser would fetch."""
    fetched = [address for page in pages.values() for address in page.fetched if urlparse(address).scheme in ("http", "https")]
    foreign = r"(@import|url\()\s*['\"]?(https?:)?//"
    return fetched + [path for path in out.rglob("*.css") if re.search(foreign, path.read_text(encoding="utf-8"))]


@pytest.mark.slow
@pytest.mark.parametrize("cells", ["off", pytest.param("force", marks=pytest.mark.exhaustive)])
def test_the_site_is_whole_and_its_search_works_in_an_opened_file(tmp_path, seen, cells):
    """Its tutorials run in another test; here once more, in the pages, before a release."""
    out = tmp_path.resolve() / "site"
    command = f"-m sphinx -q -W --keep-going -D nb_execution_mode={cells} -b html".split()
    done = subprocess.run([sys.executable, *command, DOCS, out], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    pages = read(out)
    assert len(pages) > 40
    assert dangling(pages) == []
    assert from_elsewhere(pages, out) == []
    search_finds(out, seen)
    has_everything(out)


def search_finds(out, seen):
    shown = seen(f"{(out / 'search.html').as_uri()}?q=symplectic_projection")
    shown.page.wait_for_selector("#search-results ul.search li a")
    assert "symplectic_projection" in shown.page.inner_text("#search-results")
    assert shown.strangers == []
    for words, first in FIRST.items():
        shown.page.goto(f"{(out / 'search.html').as_uri()}?q={words.replace(' ', '+')}")
        shown.page.wait_for_selector("#search-results ul.search li a")
        link = shown.page.locator("#search-results ul.search li a").first
        assert first in link.get_attribute("href"), words


def has_everything(out):
    """Names of the registry and of the command line are on the pages that are written from them."""
    pages = {
        "reference/methods": [f">{name}<" for name in schemes()],
        "reference/problems": [f">{name}<" for name in problems("constrained")],
        "results/index": [f"reports/{name}/index.html" for name in reports()],
        "reference/command-line": [f"daebench {name}" for name in typer.main.get_command(app).commands],
    }
    for page, names in pages.items():
        text = (out / f"{page}.html").read_text(encoding="utf-8")
        assert [name for name in names if name not in text] == []
    api = "".join(path.read_text(encoding="utf-8") for path in (out / "reference" / "api").glob("*.html"))
    assert "daebench.schemes.kernels.language" not in (out / "searchindex.js").read_text(encoding="utf-8")  # H would be all there is
    assert {name for name in daebench.__all__ if f'id="daebench.{name}"' not in api} == {"joints", "methods", "problems"}  # packages


def test_every_chapter_of_the_reference_has_a_page():
    from daebench_site.contents import TASKS

    listed = re.findall(r"^   ([\w-]+)$", (DOCS / "reference" / "api" / "index.rst").read_text(encoding="utf-8"), re.MULTILINE)
    assert set(listed) >= {task.key for task in TASKS}
    for task in TASKS:
        assert f".. api:: {task.key}" in (DOCS / "reference" / "api" / f"{task.key}.rst").read_text(encoding="utf-8")


def test_every_option_of_the_command_line_says_what_it_is_for():
    from daebench_site.commands import commands

    described = commands(typer.main.get_command(app))
    assert len(described) > 25
    assert [(command.name, option.names) for command in described for option in command.options if not option.help] == []
