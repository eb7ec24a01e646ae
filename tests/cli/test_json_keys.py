"""What commands print with ``--json`` has the keys, and types of values, that the page on JSON documents."""

import json
from pathlib import Path

import contestants
import pytest
import typer
from daebench_site.commands import commands
from daebench_site.json_keys import documented
from documented_keys import disagreements

from daebench.cli.app import app
from daebench.errors import BadInput
from daebench.pages import gallery as pages
from daebench.pages.report import gallery
from daebench.pages.report import reports as reports_named
from daebench.pages.report.page import write_page
from daebench.pages.report.reports import Report

DOCUMENTED = documented()
CODES = Path(__file__).parents[1] / "studies" / "planted" / "double_pendulum_codes.py"

RUN = "run planar_pendulum --method rattle --h 0.02 --steps 20"
ORDER = "order planar_pendulum --methods rattle --t-end 1 --h 0.1"
ADVISE = "advise planar_pendulum --case rotating --t-end 2 --ensemble 4 --store kept.db"
WORK = "work-precision planar_pendulum --case rotating --t-end 2 --workers 1 --out out"
STORED = f"{WORK} --methods scipy:RK45 --tol 1e-4,1e-6 --repeat 0"
BENCH = "bench --steps 200 --repeat 1"

FAST = [
    ("list", "list"),
    ("list", "list forms"),
    ("show", "show planar_pendulum"),
    ("run", RUN),
    ("run", f"{RUN} --reactions"),
    ("run", "run lotka_volterra --method strang --h 0.02 --steps 20"),
    ("check", "check lotka_volterra"),
    ("compare", "compare planar_pendulum --methods rattle,ida:index2 --t-end 1 --h 0.02"),
    ("compare", "compare planar_pendulum --q0 0,-2 --v0 1,0 --project --methods rattle --t-end 1 --h 0.02"),
    ("order", f"{ORDER} --halvings 3"),
    ("order", "order lotka_volterra --y0 3,2 --methods strang --t-end 1 --h 0.1 --halvings 3"),
    ("shadow", "shadow planar_pendulum --method rattle --h 0.1 --t-end 2 --orders 2,4"),
    ("lesson", "lesson"),
    ("open", "open gallery"),
    ("generate", "generate planar_pendulum --method rattle --h 0.01 --out code"),
    ("reference list", "reference list"),
    ("reference show", "reference show planar_pendulum-rotating"),
    ("reference at", "reference at planar_pendulum --case rotating --t 1.5"),
    (
        "reference export; reference compare",
        "reference export planar_pendulum-rotating --times 0:1:0.5 --out r.csv; reference compare r.csv --with planar_pendulum-rotating",
    ),
]
"""What is printed, and a command that prints it soon; commands that follow each other are separated by semicolons."""

SLOW = [
    ("show", "show lotka_volterra"),
    ("run", "run planar_pendulum --method ida:index2 --tol 1e-6 --t-end 1 --watch none --sensitivities gravity"),
    ("run", f"{RUN} --param length=2 --project --compensated"),
    ("check", "check spherical_pendulum"),
    ("check --method", "check planar_pendulum --method rattle --steps 20"),
    ("order", f"{ORDER} --halvings 9"),
    ("compare", "compare lotka_volterra --methods strang,rk4 --t-end 1 --h 0.02 --out out"),
    ("advise", f"{ADVISE} --accuracy 1e-3 --methods rattle,rk4"),
    (
        "work-precision; export; archive; reproduce",
        f"{STORED}; export out/studies.db table.csv; archive out/studies.db; reproduce out/studies.zip",
    ),
    ("work-precision --ensemble", f"{WORK} --methods rattle,rattle/suzuki4 --h 0.125,0.03125 --ensemble 4 --repeat 1"),
    (
        "stability",
        "stability planar_pendulum --case rotating --methods rattle --t-end 1 --h 0.5,0.25 --only outcome-map --workers 1 --out out",
    ),
    ("long", "long planar_pendulum --methods rattle --h 0.02 --steps 160 --stride 4 --ensemble 8 --workers 1 --out out"),
    ("ensemble", "ensemble planar_pendulum --method rattle --h 0.1 --t-end 1 --members 4"),
    (
        "chaos",
        "chaos double_pendulum --case horizontal --method rattle --h 0.01 --t-end 5 --plane q2,q4 --cells 3",
    ),
    ("step-for", "step-for planar_pendulum --statistic energy --margin 0.1 --method rattle --h 0.1 --t-end 1 --members 32"),
    ("modes", "modes planar_pendulum --methods rattle"),
    ("animate", "animate planar_pendulum --methods rattle --h 0.02 --t-end 1 --seconds 0.2 --out film.svg"),
    ("reference at", "reference at lotka_volterra --case 4,2 --t 0.55"),
]
"""The same of those that take seconds."""

EXHAUSTIVE = [
    ("show", "show bricard"),
    ("run", "run rssr_four_bar --method rattle --h 0.001 --steps 20 --reactions"),
    ("run", "run car_axis --method rattle --h 0.001 --steps 5"),
    ("advise", f"{ADVISE} --accuracy 1e-30 --methods rattle"),
    ("work-precision", f"{WORK} --methods rattle,rk4 --h 0.125,0.0625 --repeat 1"),
    ("precision", "precision planar_pendulum --case rotating --t-end 2 --methods rattle --repeat 0 --h 0.125,0.0625 --workers 1 --out out"),
    ("long", "long planar_pendulum --methods rattle --h 0.02 --steps 400 --workers 1 --out out"),
    ("tolerance-for", "tolerance-for rigid_water --case tumbling --drift 1e-3 --h 0.01 --t-end 1"),
    ("reference verify", "reference verify planar_pendulum-rotating"),
    ("bench", f"{BENCH} --problem planar_pendulum --methods rattle"),
    *((f"bench --{what}", f"{BENCH} --{what}") for what in ("solvers", "gradients", "ensemble", "rows", "generated")),
]
"""The same of those that compile for minutes, or whose keys are those of the command for another problem."""


def calls():
    marks = {"fast": (), "slow": pytest.mark.slow, "exhaustive": pytest.mark.exhaustive}
    for marker, some in (("fast", FAST), ("slow", SLOW), ("exhaustive", EXHAUSTIVE)):
        yield from (pytest.param(*call, marks=marks[marker], id=call[1]) for call in some)


def assert_documented(name, words, daebench):
    _, out, err = daebench(*words, "--json")
    assert out, err
    shown = json.loads(out)
    assert disagreements(shown, DOCUMENTED[name].keys) == []
    return shown


@pytest.mark.parametrize(("names", "words"), list(calls()))
def test_a_command_prints_the_documented_keys(names, words, daebench, tmp_path, monkeypatch, request):
    monkeypatch.chdir(tmp_path)
    if not {"bench", "chaos", "ensemble"} & {*words.split()} and "ida:" not in words:  # they need the compiler, or many steps
        request.getfixturevalue("uncompiled_schemes")
        request.getfixturevalue("uncompiled_poisson_schemes")
        request.getfixturevalue("plain_functions")
    for name, command in zip(names.split("; "), words.split("; "), strict=True):
        assert_documented(name, command.split(), daebench)


@pytest.mark.usefixtures("plain_functions")
def test_a_diagnosis_has_the_documented_keys_and_what_is_found(daebench):
    words = ("diagnose", f"{CODES}:full_kick_1", "--problem", "double_pendulum", "--param", "mass2=3")
    shown = assert_documented("diagnose", words, daebench)
    assert (shown["verdict"], shown["faults"], shown["parameters"]["mass2"]) == ("fault", ["full_kick"], 3)
    assert shown["evidence"]
    assert abs(shown["measured"]["order"]) < 0.1  # it solves another problem


@pytest.mark.slow
def test_a_certificate_and_its_verification_have_the_documented_keys(daebench, tmp_path, monkeypatch):
    contestants.write_codes(tmp_path)
    contestants.measure_briefly(monkeypatch)
    monkeypatch.chdir(tmp_path)
    assert_documented("certify", ("certify", "./ball.py:step", "--problem", contestants.PROBLEM, "--out", "made"), daebench)
    assert_documented("certificate verify", ("certificate", "verify", "made", "--trust"), daebench)


def test_reports_and_lessons_have_the_documented_keys(daebench, tmp_path, monkeypatch):
    def make(out, progress):
        return write_page("{% extends 'page.html' %}", out / "index.html", "make it")

    def fail(out, progress):
        raise BadInput("it cannot be made.")

    reports = [Report(name, "About it", "make it", how, lambda: [tmp_path / "a.txt"]) for name, how in (("good", make), ("bad", fail))]
    (tmp_path / "a.txt").write_text("1")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(reports_named, "find", lambda name: reports[0])
    monkeypatch.setattr(gallery, "find", lambda name: reports[0])
    monkeypatch.setattr(pages, "lesson_page", lambda name, asked: reports[0])
    monkeypatch.setattr(pages, "pages", lambda: reports)
    assert_documented("report", ("report", "good"), daebench)
    assert_documented("lesson --export", ("lesson", "good", "--export", "lessons"), daebench)
    status, out, err = daebench("report", "all", "--json")
    assert (status, err.count("\n")) == (1, 1)
    assert [page["status"] for page in json.loads(out)["pages"]] == ["fresh", "failed"]
    assert_documented("report all", ("report", "all"), daebench)


@pytest.mark.filterwarnings("ignore::daebench.joints.models.left_out.LeftOut")
def test_the_keys_of_an_imported_model_are_documented(daebench, tmp_path, monkeypatch):
    pytest.importorskip("mujoco")
    monkeypatch.chdir(tmp_path)
    model = Path(__file__).parents[1] / "models" / "pendulum.xml"
    assert_documented("import", ("import", str(model), "--out", "pendulum.py"), daebench)


def test_every_documented_command_is_run_here():
    elsewhere = {"diagnose", "certify", "certificate verify", "report", "report all", "lesson --export", "import", "reference build"}
    elsewhere |= {"baumgarte"}
    assert {name for names, _ in (*FAST, *SLOW, *EXHAUSTIVE) for name in names.split("; ")} | elsewhere == set(DOCUMENTED)


def test_every_command_takes_json_and_is_documented():
    named = {command.name: command for command in commands(typer.main.get_command(app))}
    assert [name for name, command in named.items() if not any("--json" in option.names for option in command.options)] == []
    assert [name for name in named if not any(f"{title} ".startswith(f"{name} ") for title in DOCUMENTED)] == []
    assert [title for title in DOCUMENTED if not any(f"{title} ".startswith(f"{name} ") for name in named)] == []


def test_a_key_is_documented_once_and_below_one_that_is():
    for name, printed in DOCUMENTED.items():
        paths = [key.path for key in printed.keys]
        above = {path.rpartition(".")[0].removesuffix("[]").removesuffix(".*") for path in paths}
        assert (name, len(paths)) == (name, len(set(paths)))
        assert (name, above - set(paths) - {""}) == (name, set())


WRONG = {
    ".ok is not printed": {},
    ".more is not documented": {"ok": True, "more": 1},
    ".ok: '1' is no boolean": {"ok": 1},
    ".checks[].note is not printed": {"ok": True, "checks": [{"case": "b", "what": "c", "fault": ""}]},
    ".checks[].what: '1' is no string": {"ok": True, "checks": [{"case": "b", "what": 1, "fault": "", "note": ""}]},
    ".checks: \"['b']\" is no list of objects": {"ok": True, "checks": ["b"]},
}


@pytest.mark.parametrize(("said", "printed"), WRONG.items())
def test_a_key_that_is_missing_or_new_or_of_another_type_is_found(said, printed):
    assert disagreements({"problem": "a", "checks": []} | printed, DOCUMENTED["check"].keys) == [said]
