"""The page of reference: what is public is on it with a docstring, links lead somewhere, commands are those of the command line."""

import importlib
import inspect
import os
import re
import subprocess
import sys
from html.parser import HTMLParser
from types import SimpleNamespace

import griffe
import pytest
import typer

import daebench
from daebench.cli.app import app
from daebench.pages.api import page as page_of
from daebench.pages.api.commands import commands
from daebench.pages.api.entries import Dangling, Index, entry
from daebench.pages.api.markup import blocks, inline
from daebench.pages.api.public import Undocumented, package, public

COMMAND_LINE = typer.main.get_command(app)
WHOLE = ("testing", "pages.report", "draw.figures", "diagnostics.energy", "diagnostics.order", "diagnostics.symplecticity")


class Reader(HTMLParser):
    """Anchors, links, and the text below each anchor up to the next."""

    def __init__(self):
        super().__init__()
        self.ids, self.links, self.fetched, self.text = [], [], [], {}

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        if "id" in given:
            self.ids.append(given["id"])
        self.links += [given["href"]] if tag == "a" and "href" in given else []
        self.fetched += [value for key, value in attributes if key in ("src", "srcset", "data") or (key == "href" and tag != "a")]

    def handle_data(self, data):
        if self.ids:
            self.text[self.ids[-1]] = self.text.get(self.ids[-1], "") + data


@pytest.fixture(scope="module")
def tree():
    return package()


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    path = page_of.write(tmp_path_factory.mktemp("reference"), COMMAND_LINE)
    reader = Reader()
    reader.feed(path.read_text(encoding="utf-8"))
    return SimpleNamespace(path=path, source=path.read_text(encoding="utf-8"), **vars(reader))


def defined_in(name):
    module = importlib.import_module(f"daebench.{name}")
    public = {key: each for key, each in vars(module).items() if key in getattr(module, "__all__", [key]) and not key.startswith("_")}
    called = {key: each for key, each in public.items() if inspect.isroutine(each) or inspect.isclass(each)}
    return [f"daebench.{name}.{key}" for key, each in called.items() if each.__module__.startswith(module.__name__)]


def test_all_of_daebench_is_on_the_page_with_words(page):
    for name in daebench.__all__:
        assert len(page.text[f"daebench.{name}"].split()) > 10, name


@pytest.mark.parametrize("module", WHOLE)
def test_all_that_a_public_module_defines_is_on_the_page(page, module):
    names = defined_in(module)
    assert names
    assert set(names) <= set(page.ids)


def test_anchors_are_unique_and_every_link_within_the_page_has_one(page):
    assert len(page.ids) == len(set(page.ids))
    inner = {link for link in page.links if link.startswith("#")}
    assert {link[1:] for link in inner} <= set(page.ids)
    assert set(page.links) - inner <= {"../index.html"}


def test_nothing_is_fetched_when_the_page_is_opened(page):
    assert page.fetched == []
    assert not re.search(r"@import|url\(\s*['\"]?http", page.source)


def test_the_parameters_of_a_function_stand_in_its_signature_and_in_its_list(page):
    section = page.source.partition('<section class="api function" id="daebench.compare">')[2].partition("</section>")[0]
    for name in inspect.signature(daebench.compare).parameters:
        assert re.search(rf"^    {name}: ", section, re.MULTILINE), name
        assert f"<dt><code>{name}</code>" in section, name


def test_every_command_and_every_option_of_one_is_on_the_page(page):
    command = [sys.executable, "-m", "daebench", "long", "--help"]
    told = subprocess.run(command, capture_output=True, text=True, check=True, env=os.environ | {"COLUMNS": "200"}).stdout
    options = set(re.findall(r"--[a-z][a-z0-9-]+", told)) - {"--help"}
    assert options
    assert all(option in page.text["command-long"] for option in options)
    own = {each.name or each.callback.__name__.replace("_", "-") for each in app.registered_commands}
    assert {f"command-{name}" for name in own} <= set(page.ids)
    assert "command-reference-build" in page.ids


def test_every_option_says_what_it_is_for(page):
    assert [(command.name, option.names) for command in commands(COMMAND_LINE) for option in command.options if not option.help] == []


def test_the_page_is_the_same_each_time(page, tmp_path):
    assert page_of.write(tmp_path, COMMAND_LINE).read_bytes() == page.path.read_bytes()


def test_something_public_without_a_docstring_is_named(tree, monkeypatch):
    monkeypatch.setattr(tree["testing.references.assert_agrees"], "docstring", None)
    with pytest.raises(Undocumented, match=r"daebench\.testing\.assert_agrees is public and has no docstring"):
        public(tree)


def test_a_method_without_a_docstring_is_named(tree, monkeypatch):
    monkeypatch.setattr(tree["runs.trajectory.Outcome.complete"], "docstring", None)
    with pytest.raises(Undocumented, match=r"Outcome\.complete"):
        public(tree)


def test_a_reference_to_what_the_page_does_not_have_is_refused(tree, monkeypatch):
    found = {path: each for entries in public(tree).values() for path, each in entries.items()}
    each = found["daebench.run"]
    monkeypatch.setattr(each, "docstring", griffe.Docstring("Return what :func:`no_such_thing` returns.", parent=each))
    with pytest.raises(Dangling, match=r"daebench\.methods\.run\.run refers to no_such_thing"):
        entry("daebench.run", each, Index(found))


def test_literal_blocks_lists_and_signs_come_out_as_written():
    text = "The step::\n\n    p1 = p0 - h H_q\n\n      q1 < q0\n\nand *then*:\n\n- ``a`` and 2 * 3 * 4\n- b\n  goes on"
    html = blocks(text, lambda name: "")
    assert "<p>The step:</p>\n<pre><code>p1 = p0 - h H_q\n\n  q1 &lt; q0</code></pre>" in html
    assert "<i>then</i>" in html
    assert "<ul><li><code>a</code> and 2 * 3 * 4</li><li>b goes on</li></ul>" in html


def test_a_reference_becomes_a_link():
    assert inline("See :func:`daebench.methods.run.run`.", lambda name: "there") == 'See <a href="#there"><code>run</code></a>.'
