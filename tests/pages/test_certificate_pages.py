"""The page of a certificate, and a court of many: it takes what it can verify, and names the rest with why."""

import copy
import json
import re
import shutil

import contestants
import pytest
from refusals import refused

from daebench.pages.certificate.certify import certify
from daebench.pages.certificate.court import court, judged
from daebench.records.seals import checksum
from daebench.studies.certificate import measure, process
from daebench.studies.certificate.record import NAME


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Make two certificates once; return their folder, and the answers of the processes by method."""
    folder = tmp_path_factory.mktemp("codes")
    contestants.write_codes(folder)
    answers = {}

    def remembered(tasks, *given):
        answers[tasks[0]["method"]] = contestants.in_this_process(tasks, *given)
        return answers[tasks[0]["method"]]

    with pytest.MonkeyPatch.context() as patch:
        contestants.measure_briefly(patch)
        patch.setattr(measure, "LONG", 300)
        patch.setattr(measure, "SHORT", 100)
        patch.chdir(folder)
        patch.setattr(process, "measured", remembered)
        for name in ("step", "shake"):
            certify(f"./ball.py:{name}", problems=[contestants.PROBLEM], parameters=contestants.PARAMETERS, out=f"court/{name}")
    return folder / "court", answers


@pytest.fixture
def folder(made, tmp_path, monkeypatch):
    """Return a copy of the folder of certificates; what is measured again is what was measured."""
    monkeypatch.setattr(process, "measured", lambda tasks, *_: copy.deepcopy(made[1][tasks[0]["method"]]))
    return shutil.copytree(made[0], tmp_path / "court")


def text_of(page):
    """Return the words of a page, without markup, style and script."""
    text = re.sub(r"<(style|script|svg).*?</\1>", " ", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    return re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", text))


def test_the_page_says_what_holds_and_has_the_code_beside_it(made):
    right, wrong = (text_of(made[0] / name / "index.html") for name in ("step", "shake"))
    assert ("false:" in right, "false:" in wrong) == (False, True)
    assert json.loads((made[0] / "step" / NAME).read_text())["code"]["hash"] in right
    for name in ("figures/measured.svg", "figures/measured.csv", "code/ball.py", "code/forces.py"):
        assert (made[0] / "step" / name).is_file()


@pytest.mark.slow
def test_both_pages_show_themselves_as_they_should(folder, tmp_path, looks_right):
    looks_right(folder / "shake" / "index.html")
    (folder / "lost").mkdir()
    (folder / "lost" / NAME).write_text("{}")
    looks_right(court(folder, tmp_path / "pages", trust=True))


def rows(page, table):
    """Return the cells of a table of a page, a tuple a row."""
    html = page.read_text(encoding="utf-8")
    body = html[html.index(f'id="table-{table}"') :].partition("<tbody>")[2].partition("</tbody>")[0]
    cells = (re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row) for row in re.findall(r"<tr>(.*?)</tr>", body))
    return [tuple(re.sub(r"<[^>]+>", "", cell) for cell in row) for row in cells]


def changed(folder, source, name, change=None):
    """Put a copy of a certificate into a court, changed, with a checksum that fits."""
    place = shutil.copytree(folder / source, folder / name)
    if change:
        content = json.loads((place / NAME).read_text())
        change(content)
        (place / NAME).write_text(json.dumps(content | {"checksum": checksum(content)}))
    return place


ALTERED = {
    "number": (lambda c: c["problems"][0]["numbers"]["error"].update(value=1e-9), "value of error of spherical_pendulum"),
    "hash": (lambda c: c["code"].update(hash="0" * 64), "other code"),
    "future": (lambda c: c.update(format=2), "newer daebench"),
    "foreign": (lambda c: c.update(schema="<script>alert(1)</script>"), "not a certificate of daebench"),
}
DAMAGED = {
    "garbled": (NAME, '{"schema": "daebench cert', "damaged"),
    "empty": (NAME, "", "damaged"),
    "edited": ("code/ball.py", "raise SystemExit('evil')", "other code"),
}
"""What becomes of copies of a certificate, and why a court leaves them out."""


def test_a_court_takes_what_it_can_verify_and_names_the_rest(folder, tmp_path):
    changed(folder, "step", "_a $x$ of $\\frac$")
    for name, (change, _) in ALTERED.items():
        changed(folder, "step", name, change)
    for name, (file, text, _) in DAMAGED.items():
        (changed(folder, "step", name) / file).write_text(text)
    (changed(folder, "step", "lost") / "code" / "forces.py").unlink()
    (folder / "notes.json").write_text("[1, 2]")
    page = court(folder, tmp_path / "pages", trust=True)
    reasons = {f"{name}/{NAME}": why for name, (*_, why) in (ALTERED | DAMAGED | {"lost": ("is missing",)}).items()}
    reasons["notes.json"] = "not a certificate of daebench"
    told = dict(rows(page, "excluded"))
    assert {name: why for name, why in reasons.items() if why not in told[name]} == {}
    assert told.keys() == reasons.keys()
    assert {name for name, *_ in rows(page, "contestants-1")} == {"_a $x$ of $\\frac$", "shake", "step"}
    assert "<script>alert" not in page.read_text(encoding="utf-8")


def test_a_court_shows_what_was_measured_and_not_what_a_certificate_says(folder, tmp_path):
    changed(folder, "step", "boast", lambda c: c["about"].update(seconds_per_step=[1e-12], machine="the best, 1 logical cores, X on Y"))
    entries, excluded = judged(folder, sorted(folder.glob("*/certificate.json")), 60.0, lambda *_: None, trust=True)
    assert ([entry.name for entry in entries], excluded) == (["boast", "shake", "step"], [])
    assert entries[0].verification.problems[0]["seconds"] > 1e-9
    assert "the best" not in court(folder, tmp_path / "pages", trust=True).read_text(encoding="utf-8")


def test_code_is_executed_with_trust_alone(folder, tmp_path, monkeypatch):
    monkeypatch.setattr(process, "measured", lambda *_: pytest.fail("run"))
    with refused("certificates-not-trusted"):
        court(folder, tmp_path / "pages")
    assert not (tmp_path / "pages").exists()


def test_a_court_of_nothing_that_holds_is_made(folder, tmp_path):
    for name in ("step", "shake"):
        (folder / name / NAME).write_text("{}")
    assert len(rows(court(folder, tmp_path / "pages"), "excluded")) == 2


def test_what_raises_in_a_process_is_no_end_of_a_court(folder, tmp_path, made, monkeypatch):
    def measured(tasks, *_):
        if tasks[0]["method"].endswith("shake"):
            return [{"refused": "./ball.py:shake ends the process in which it runs, by signal 11."}]
        return copy.deepcopy(made[1][tasks[0]["method"]])

    monkeypatch.setattr(process, "measured", measured)
    page = court(folder, tmp_path / "pages", trust=True)
    ((name, why),) = rows(page, "excluded")
    assert (name, "signal 11" in why) == (f"shake/{NAME}", True)
