"""What README and documentation quote is what is said, their report is written, and what they ask to be cited is this version."""

import json
import math
import re
import sys
import tomllib
import warnings
from types import SimpleNamespace

import pandas as pd
import pytest
import said
from said import README

import daebench as library
from daebench.compiler import cache, sealed
from daebench.methods.catalogue import problems
from daebench.pages.report import build
from daebench.records.store import opened
from daebench.studies.grid.archive import write_archive
from daebench.studies.grid.study import Study

ROOT = README.parent
DOCS = said.DOCS


@pytest.fixture
def files(tmp_path, monkeypatch):
    """A folder with the files that the documentation shows, and with what its commands make of them."""
    said.write_files(tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def archived(files, uncompiled_schemes):
    """Have an archive of a study of the bead with the integrator that the documentation shows."""
    with opened(files / "mine.db") as store:
        Study(problem="./bead.py", methods=["./mine.py:step"], values={"h": [0.1]}, metrics=("energy",), t_end=1.0).table(store)
        write_archive(store, files / "mine.zip")


@pytest.fixture
def heyoka_missing(monkeypatch):
    monkeypatch.setitem(sys.modules, "heyoka", None)


@pytest.fixture
def refuted(monkeypatch):
    """Have the report on index reduction measure that the first step of ``se`` is not symplectic."""
    from daebench.reports import index_reduction
    from daebench.reports.index_reduction.schemes import check_symplecticity

    numbers = SimpleNamespace(defects=pd.DataFrame({"se": [3.1e-5] + 19 * [1e-3]}))
    claims = pd.DataFrame({"claimed_symplectic": {"se": False}})
    monkeypatch.setattr(index_reduction, "everything", lambda progress: numbers)
    monkeypatch.setattr(index_reduction, "check_everything", lambda numbers: check_symplecticity(numbers, claims))


def what_is_said(daebench, words):
    """Return the sentences that a command says: of a run that stops why, of many steps the verdict, else what is on standard error."""
    status, out, err = daebench(*words, *["--json"] * (words[0] == "run"))
    if words[0] == "long":
        return status, next(line for line in out.splitlines() if ": " in line)
    stopped = json.loads(out)["failure"] if words[0] == "run" and out else None
    return status, stopped or err.removeprefix("daebench: ").rstrip("\n")


@pytest.fixture
def cache_named(monkeypatch, trouble):
    """Have kernels be kept where a row says, and the warning of it said as it is at the command line."""
    monkeypatch.setenv("DAEBENCH_CACHE", trouble.cache)
    cache.warn.cache_clear()
    with warnings.catch_warnings():
        warnings.simplefilter("default", sealed.CacheWarning)
        yield
    cache.warn.cache_clear()


@pytest.mark.parametrize("trouble", said.troubles(), ids=lambda trouble: " ".join(trouble.words[:2]))
def test_a_message_of_the_documentation_is_what_the_command_says(
    daebench, files, heyoka_missing, refuted, plain_functions, uncompiled_schemes, request, record_property, trouble
):
    if trouble.cache:
        request.getfixturevalue("cache_named")
    if "mine.zip" in trouble.words:
        request.getfixturevalue("archived")
    status, message = what_is_said(daebench, trouble.words)
    if not trouble.is_said_in(message):
        record_property(trouble.message, message)
        pytest.fail(f"the command says: {message}; python tests/support/said.py takes it into the page")
    no_error, failure = ("compiling in memory", "undetermined"), ("stopped at", "the report would")
    assert status == (0 if any(word in message for word in no_error) else 1 if any(word in message for word in failure) else 2)


def test_all_messages_of_the_page_are_provoked():
    text = said.MESSAGES.read_text(encoding="utf-8")
    assert len(said.troubles()) == len(re.findall(r"^: ", text, re.MULTILINE)) >= 12


def test_the_report_of_the_documentation_is_written(files, plain_functions, uncompiled_schemes):
    page = build("./my_report.py", files / "out")
    energy = pd.read_csv(page.parent / "figures" / "energy.csv")["energy_error"]
    assert list(energy / energy.shift(-1))[:-1] == pytest.approx([4, 4], rel=0.05)
    assert page.read_text(encoding="utf-8").count('<th scope="row"') == 3


@pytest.fixture
def errors():
    """Return the errors of the picture of tolerances: medians of formulations on the five systems, all lengths being 1 m."""
    return pd.read_csv(ROOT / "reports" / "gallery" / "tolerances.csv").query("done > 0.5")


def test_the_digits_that_ida_is_said_to_reach_are_those_of_the_picture_below(errors):
    tightest = errors.query("tol == 1e-14")["error"]
    assert len(tightest) >= 16
    page = (DOCS / "explanation" / "certification.md").read_text(encoding="utf-8")
    said_digits = re.search(r"At a tolerance of 1e-14 IDA reaches (\d+) to (\d+) digits", page).groups()
    assert [int(-math.log10(each)) for each in (tightest.max(), tightest.min())] == [int(each) for each in said_digits]


def test_the_errors_at_a_tolerance_in_the_glossary_are_those_of_the_picture(errors):
    """Medians over the systems at 1e-8, and the loosest tolerances whose median error is at most 1e-3."""
    medians = errors.groupby(["formulation", "tol"])["error"].median()
    entry = (DOCS / "reference" / "glossary.md").read_text(encoding="utf-8").partition("\ntolerance\n")[2].partition("\n\n")[0]
    entry = " ".join(entry.split())
    said_errors = re.search(r"it is (\S+) m at index 3, (\S+) m at index 1, (\S+) m with GGL and (\S+) m at index 2", entry).groups()
    rounded = [float(f"{medians[name, 1e-8]:.0e}") for name in ("index3", "index1", "ggl", "index2")]
    assert [float(each) for each in said_errors] == rounded
    said_tolerances = re.search(r"index 3 needs a tolerance of (\S+), index 2 one of (\S+)\.", entry).groups()
    loosest = [medians[name][medians[name] <= 1e-3].index.max() for name in ("index3", "index2")]
    assert [float(each) for each in said_tolerances] == pytest.approx(loosest)


def test_se_with_half_the_step_ends_as_said(uncompiled_schemes):
    run = library.run("spherical_pendulum", case="fig1.2", method="se", h=0.005, steps=1000)
    text = (DOCS / "how-to" / "messages.md").read_text(encoding="utf-8")
    assert f"With h halved this run reaches t = {run.t[-1]:.2f} and ends in the same way, with |g| = {run.maxima['g']:.2f}" in text
    assert "did not converge" in run.failure


def test_there_are_as_many_drawings_as_problems():
    assert len(problems("constrained")) == 25
    assert "![Twenty-five small drawings" in (DOCS / "results" / "index.md").read_text(encoding="utf-8")


def test_what_is_to_be_cited_is_this_version():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert re.search(r"^version: (.*)$", citation, re.MULTILINE)[1] == project["version"]
    year = re.search(r"Copyright \(c\) (\d{4})", (ROOT / "LICENSE").read_text(encoding="utf-8"))[1]
    for page in (README, DOCS / "reference" / "citing.md"):
        entry = page.read_text(encoding="utf-8").partition("@software{daebench,")[2].partition("\n}")[0]
        assert re.search(r"version = \{(.*?)\}", entry)[1] == project["version"]
        assert re.search(r"year    = \{(.*?)\}", entry)[1] == year


def test_links_of_the_readme_lead_to_files():
    links = re.findall(r"\]\(([^)]+)\)", README.read_text(encoding="utf-8"))
    assert len(links) > 10
    assert [link for link in links if not (ROOT / link).exists()] == []


def test_what_is_installed_as_a_page_says_is_what_the_gate_installs():
    marked = re.findall(r"^<!-- [^>]* -->\n```sh\n(.*?)^```", README.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    console = [line for text in said.blocks("{code-block} console") for line in text.splitlines()]
    assert len(marked) == 2
    assert console
    assert all(any(command.startswith(line.removeprefix("$ ")) for command in marked) for line in console)
