"""The gallery: what is stale is made anew and nothing else, a failing page is told of and not linked, and pages sort and travel."""

import os
import posixpath
import re
import subprocess
import sys
from functools import cache
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory
from zipfile import ZipFile

import pandas as pd
import pytest
from pages import Page, standalone
from refusals import refused

from daebench.draw.figures import STROKES, drawing, grid_of_axes, save
from daebench.errors import BadInput, Interrupted, RunFailed
from daebench.pages import gallery as pages
from daebench.pages.report import build, build_stamp, citation, gallery, number, picture, table, write_page
from daebench.pages.report.archive import write_archive
from daebench.pages.report.gallery import PagesFailed, build_all
from daebench.pages.report.reports import Report, find
from daebench.runs.machine import machine

TEXT = """{% extends "page.html" %}{% block title %}A &lt;page&gt;{% endblock %}{% block content %}{{ drawn }}{{ shown }}
<p>All of it: <a href="figures/line.csv">the <b>table</b></a>; <a href="#more" id="more">more</a>.
<span class="beside">Runs are kept in <code>studies.db</code>.</span></p>{% endblock %}"""


@cache
def line():
    """Draw a figure, and return its files by name."""
    with TemporaryDirectory() as folder:
        with drawing():
            figure, axes = grid_of_axes(1, 1, 2.0)
            axes[0, 0].plot([0, 1], [0, 1], **STROKES[0].line())
        save(figure, Path(folder), "line", {"x": [0.0, 1.0]})
        return {path.name: path.read_bytes() for path in Path(folder).iterdir()}


def quick(name, tmp_path, *, fails=None, kind="report"):
    """A report that takes no time, the file that decides it, and how often it was run."""
    source = tmp_path / f"{name}.txt"
    source.write_text("1", encoding="utf-8")
    calls = []

    def make(out, progress):
        calls.append(name)
        if fails:
            raise fails
        progress(0.5, "half")
        (out / "figures").mkdir(parents=True, exist_ok=True)
        for file, content in line().items():
            (out / "figures" / file).write_bytes(content)
        drawn = picture(out / "figures" / "line.svg", "A line that rises", "A line")
        shown = table("few", pd.DataFrame({"name": ["b", "a", "c"], "size": [2e-9, 1.5, 3.0]}), {"name": str, "size": number}, {}, "Few")
        return write_page(TEXT, out / "index.html", f"make {name}", drawn=drawn, shown=shown)

    return Report(name, f"About {name}", f"make {name}", make, lambda: [source], kind=kind), source, calls


@pytest.fixture
def gallery_of(tmp_path):
    def made(*names, **more):
        return [quick(name, tmp_path, **more) for name in names]

    return made


def built(out, parts, **more):
    told = []
    made = build_all(out, [report for report, _, _ in parts], lambda fraction, doing: told.append(fraction), lambda each: None, **more)
    assert told == sorted(told)
    assert told[-1] == 1.0
    return {each.name: each for each in made}


def counts(parts):
    return [len(calls) for _, _, calls in parts]


def test_what_is_as_it_should_be_is_left_alone(tmp_path, gallery_of):
    parts, out = gallery_of("one", "two"), tmp_path / "out"
    assert all(each.seconds > 0 for each in built(out, parts).values())
    assert {each.seconds for each in built(out, parts).values()} == {0.0}
    assert counts(parts) == [1, 1]
    built(out, parts, anew=True)
    assert counts(parts) == [2, 2]


def test_only_what_is_stale_is_made_anew(tmp_path, gallery_of, monkeypatch):
    parts, out = gallery_of("one", "two"), tmp_path / "out"
    built(out, parts)
    page = out / "two"
    changes = {
        "own file": lambda: parts[1][1].write_text("2", encoding="utf-8"),
        "figure": lambda: (page / "figures" / "line.csv").write_text("x\n7\n", encoding="utf-8"),
        "lost page": lambda: (page / "index.html").unlink(),
        "lost stamp": lambda: (page / build_stamp.STAMP).unlink(),
        "broken stamp": lambda: (page / build_stamp.STAMP).write_text('{"title": ', encoding="utf-8"),
    }
    for made, (change, stale) in enumerate(changes.items(), start=2):
        stale()
        built(out, parts)
        assert counts(parts) == [1, made], change
    monkeypatch.setattr(build_stamp, "_package", lambda: "another package")
    built(out, parts)
    assert counts(parts) == [2, len(changes) + 2]


@pytest.mark.parametrize("change", ["code", "template", "certified reference", "versions"])
def test_every_page_stands_on_the_whole_package_and_on_the_versions(tmp_path, monkeypatch, change):
    names = {
        "code": "compiler/link.py",
        "template": "reports/methods/page.html",
        "certified reference": "reference/data/torus-through_hole/torus-through_hole.csv",
    }
    files = build_stamp.package.files(*build_stamp.SOURCES)
    before = build_stamp._package.__wrapped__()
    if change == "versions":
        monkeypatch.setattr(build_stamp, "versions", lambda: {"numpy": "0"})
    else:
        (tmp_path / "edited").write_bytes(files[names[change]].read_bytes() + b"\n")
        monkeypatch.setattr(build_stamp.package, "files", lambda *endings: files | {names[change]: tmp_path / "edited"})
    assert build_stamp._package.__wrapped__() != before


@pytest.mark.sampled(left_out=("key",))
@pytest.mark.parametrize("stop", [KeyboardInterrupt(), Interrupted("interrupted; 2 runs are kept.")], ids=["key", "with what is kept"])
def test_an_interrupted_gallery_goes_on_where_it_stopped(tmp_path, gallery_of, monkeypatch, daebench, stop):
    (first, stopped, last), out = gallery_of("one", "two", "three"), tmp_path / "out"
    interrupted = quick("two", tmp_path, fails=stop)
    monkeypatch.setattr(pages, "pages", lambda: [report for report, _, _ in (first, interrupted, last)])
    status, _, told = daebench("report", "all", "--out", out)
    assert (status, told.count("\n"), counts([first, last])) == (130, 1, [1, 0])
    assert "one/index.html" in Page((out / "index.html").read_text(encoding="utf-8")).links
    built(out, [first, stopped, last])
    assert counts([first, stopped, last]) == [1, 1, 1]


def test_a_page_that_fails_is_told_of_and_the_others_are_made(tmp_path, gallery_of):
    (good,), out = gallery_of("good"), tmp_path / "out"
    bad = quick("bad", tmp_path, fails=RunFailed("the report would say that pigs fly, but 0 was measured."))
    with pytest.raises(PagesFailed, match="bad: the report would say that pigs fly"):
        built(out, [bad, good])
    page = Page((out / "index.html").read_text(encoding="utf-8"))
    assert ("pigs fly" in page.text, {"good/index.html", "bad/index.html"} & {*page.links}) == (True, {"good/index.html"})
    with pytest.raises(PagesFailed):
        built(out, [bad, good])
    assert counts([bad, good]) == [2, 1]


def test_the_index_has_a_card_with_title_and_picture_for_each_page(tmp_path, gallery_of):
    built(tmp_path, [*gallery_of("one", "two"), *gallery_of("play", kind="lesson")])
    page = standalone(tmp_path / "index.html")
    assert {"one/index.html", "two/figures/line.png", "play/index.html"} <= set(page.links)
    assert page.text.count("A <page>") == 3


def test_all_own_reports_are_in_the_gallery_in_their_order():
    names = [each.name for each in pages.pages() if each.kind == "report"]
    assert sorted([*names, *pages.BY_HAND]) == sorted(pages.reports())
    assert names[: len(gallery.SECONDS)] == [name for name in gallery.SECONDS if name in names]


def test_an_archive_has_pages_that_stand_alone_and_is_the_same_for_the_same_pages(tmp_path, gallery_of):
    out = tmp_path / "out"
    built(out, gallery_of("one", "two"))
    first, second = (write_archive(out, tmp_path / name).read_bytes() for name in ("a.zip", "b.zip"))
    assert first == second
    with ZipFile(tmp_path / "a.zip") as archive:
        archive.extractall(tmp_path / "read")
    found = {path.relative_to(tmp_path / "read").as_posix() for path in (tmp_path / "read").rglob("*.*")}
    beside = [*(f"figures/line.{ending}" for ending in ("png", "svg", "csv")), f"code/{__name__}.py"]
    assert found == {"index.html", *(f"{name}/{file}" for name in ("one", "two") for file in ("index.html", *beside))}
    assert (tmp_path / "read" / "one" / "code" / f"{__name__}.py").read_bytes() == Path(__file__).read_bytes()
    for name in ("one", "two"):
        assert "studies.db" in standalone(out / name / "index.html").text
        assert "All of it: the table ; more ." in standalone(tmp_path / "read" / name / "index.html").text
    assert unknown_files(tmp_path / "a.zip") == []


def test_an_archive_has_the_pages_that_a_page_leads_to_and_their_files_but_those_that_are_larger_than_is_wanted(tmp_path, gallery_of):
    out = tmp_path / "out"
    built(out, gallery_of("one"))
    page, table = out / "one" / "index.html", out / "one" / "figures" / "line.csv"
    page.write_text(page.read_text(encoding="utf-8").replace("<h1>", '<a href="part.html">part</a><h1>', 1), encoding="utf-8")
    page.with_name("part.html").write_text('<a href="n.csv">n</a> <a href="lost.csv">lost</a>', encoding="utf-8")
    page.with_name("n.csv").write_text("n\n1\n", encoding="utf-8")
    for largest, there in ((table.stat().st_size, True), (table.stat().st_size - 1, False)):
        with ZipFile(write_archive(out, tmp_path / "a.zip", largest=largest)) as archive:
            assert ("one/figures/line.csv" in archive.namelist()) == there
            assert ('href="figures/line.csv"' in archive.read("one/index.html").decode()) == there
            assert archive.read("one/part.html").decode() == '<a href="n.csv">n</a> lost'
            assert archive.read("one/n.csv") == b"n\n1\n"


def unknown_files(path):
    """Return the files that pages of an archive name, in links or in words, and that are not in it."""
    with ZipFile(path) as archive:
        names = set(archive.namelist())
        pages = {name: Page(archive.read(name).decode()) for name in names if name.endswith("index.html") and not name.startswith(APART)}
    linked = {
        posixpath.normpath(posixpath.join(posixpath.dirname(name), link.partition("#")[0]))
        for name, page in pages.items()
        for link in page.links
        if not re.match("[a-z]+:|#", link)
    }
    named = {word for page in pages.values() for word in re.findall(r"[\w-]+\.(?:csv|db|svg|png|parquet|html|npz)\b", page.text)}
    return sorted((linked - names) | (named - {Path(name).name for name in names}))


APART = ("lesson-", "reference/")
"""Pages that quote commands, whose files are the reader's."""


def test_a_page_says_what_a_reader_needs_to_cite_it_and_to_make_it_again(tmp_path, gallery_of):
    ((report, _, _),) = gallery_of("one")
    text = Page(report.make(tmp_path / "out", lambda *told: None).read_text(encoding="utf-8")).text
    authors = re.findall(r"(?m)^  - name: (.*)$", (Path(__file__).parents[2] / "CITATION.cff").read_text(encoding="utf-8"))
    assert authors[0] == citation.AUTHORS
    assert [words for words in (version("daebench"), machine(), "BSD-3-Clause", f"{authors[0]}, “A <page>”") if words not in text] == []
    assert not citation.commit() or f"(commit {citation.commit()})" in text


def test_a_commit_is_that_of_the_checkout_or_of_the_installation_or_not_known(tmp_path, monkeypatch):
    monkeypatch.setattr(citation.package, "folder", lambda name: tmp_path)
    monkeypatch.setattr(citation, "_installed", lambda: "not in a checkout")
    assert citation.commit() == "not in a checkout"
    for arguments in (["init", "-q"], ["add", "."], ["-c", "user.name=a", "-c", "user.email=a@b", "commit", "-qm", "first"]):
        (tmp_path / "__init__.py").write_text("1", encoding="utf-8")
        subprocess.run(["git", "-C", str(tmp_path), *arguments], check=True)
    assert re.fullmatch("[0-9a-f]{12}", citation.commit())
    (tmp_path / "__init__.py").write_text("2", encoding="utf-8")
    assert re.fullmatch("[0-9a-f]{12} with changes", citation.commit())


OWN = '''"""How far a pendulum falls."""

from pathlib import Path

from beside import LABEL

from daebench.pages.report import Progress, write_page

TEMPLATE = """{% extends "page.html" %}
{% block title %}A fall{% endblock %}
{% block content %}<p>It falls {{ depth | number }} m, {{ label }}.</p>{% endblock %}"""


def make(out: Path, progress: Progress) -> Path:
    progress(0.5, "falling")
    return write_page(TEMPLATE, out / "index.html", "daebench report ./my_fall.py", depth=1 / 4, label=LABEL)
'''


@pytest.fixture
def own(tmp_path):
    def written(text=OWN, beside="LABEL = 'at least'\n"):
        (tmp_path / "my_fall.py").write_text(text, encoding="utf-8")
        (tmp_path / "beside.py").write_text(beside, encoding="utf-8")
        return str(tmp_path / "my_fall.py")

    return written


def test_a_report_of_ones_own_is_a_file_with_the_same_helpers(own, tmp_path):
    page = build(own(), tmp_path / "out")
    assert page == tmp_path / "out" / "my-fall" / "index.html"
    assert "It falls 0.25 m, at least." in standalone(page).text
    assert "How far a pendulum falls." in standalone(tmp_path / "out" / "index.html").text
    assert "at most" in Page(build(own(beside="LABEL = 'at most'\n"), tmp_path / "out").read_text(encoding="utf-8")).text


MISTAKES = {
    "not Python": (OWN + "\n(", "not Python"),
    "a name that is not there": (OWN.replace("depth=1 / 4", "depth=falls"), "line 16: NameError"),
    "a division by zero": (OWN.replace("1 / 4", "1 / 0"), "line 16: ZeroDivisionError"),
    "no page": (OWN.replace("return write_page", "return print"), "TypeError|index.html"),
    "a placeholder that nothing fills": (OWN.replace("{{ label }}", "{{ lable }}"), "UndefinedError: 'lable'"),
}


@pytest.mark.parametrize(("text", "sentence"), MISTAKES.values(), ids=list(MISTAKES))
def test_a_mistake_in_ones_own_report_is_named(own, tmp_path, text, sentence):
    with pytest.raises(BadInput, match=sentence):
        build(own(text), tmp_path / "out")


def test_a_refuted_claim_of_ones_own_report_is_no_mistake_in_the_file(own, tmp_path):
    text = OWN.replace("from beside", "from daebench.errors import RunFailed\nfrom beside")
    with pytest.raises(RunFailed, match=r"^it does not fall\.$"):
        build(own(text.replace("    progress(0.5", "    raise RunFailed('it does not fall.')\n    progress(0.5")), tmp_path / "out")


def test_the_command_makes_the_gallery_and_its_archive(tmp_path, gallery_of, monkeypatch, daebench):
    parts = gallery_of("one", "two")
    monkeypatch.setattr(pages, "pages", lambda: [report for report, _, _ in parts])
    words = ("report", "all", "--out", tmp_path / "out")
    assert daebench(*words, "--archive", tmp_path / "all.zip")[0] == daebench(*words)[0] == 0
    assert (counts(parts), (tmp_path / "all.zip").is_file()) == ([1, 1], True)


def test_without_what_lessons_need_the_gallery_is_made_without_them_and_says_so(tmp_path, monkeypatch, daebench):
    assert sum(each.kind == "lesson" for each in pages.pages()) == len(pages.lessons()) > 0
    monkeypatch.setattr("daebench.pages.lesson.installed.find_spec", lambda name: None)
    assert not [each for each in pages.pages() if each.kind == "lesson"]
    monkeypatch.setattr(pages, "pages", list)
    assert "daebench[lessons]" in daebench("report", "all", "--out", tmp_path / "out")[2]


def test_digests_are_the_same_in_every_process():
    code = "from daebench.pages.report.build_stamp import digest; print(digest())"
    environments = [os.environ | {"PYTHONHASHSEED": seed} for seed in "01"]
    assert len({subprocess.check_output([sys.executable, "-c", code], env=environment) for environment in environments}) == 1


def test_the_gallery_that_is_kept_has_every_page_and_each_stands_alone(tmp_path):
    kept = Path(__file__).parents[2] / "reports" / "gallery" / "gallery.zip"
    with ZipFile(kept) as archive:
        archive.extractall(tmp_path)
    assert {path.parent.name for path in tmp_path.glob("*/index.html")} == {each.name for each in pages.pages()} | pages.BY_HAND
    for path in tmp_path.rglob("index.html"):
        standalone(path, quotes=path.parent.name == "engines")


def test_a_report_of_ones_own_depends_on_its_file_and_on_what_that_imports(tmp_path):
    (tmp_path / "mine.py").write_text("import beside\n", encoding="utf-8")
    for name in ("beside", "other"):
        (tmp_path / f"{name}.py").write_text("", encoding="utf-8")
    assert [path.name for path in find(str(tmp_path / "mine.py")).files()] == ["mine.py", "beside.py"]


def test_a_report_of_ones_own_does_not_take_the_name_of_another(own, tmp_path):
    path = Path(own()).rename(tmp_path / "poisson.py")
    with refused("report-name-taken"):
        build(str(path), tmp_path / "out")
