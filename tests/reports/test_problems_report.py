"""The report on problems: facts against the definitions, drawings on the manifold, claims that faults refute, tables, and the page."""

import html
import math
import re
from dataclasses import replace
from types import SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest
from pages import standalone
from published import BARI_LAM, BARI_Q
from reported import require_figure
from said import ROOT
from tampered import changed

from daebench.draw.figures import drawing
from daebench.methods.catalogue import problems as catalogue
from daebench.methods.names import parse
from daebench.pages.docstrings import docstring, meanings
from daebench.pages.report import build
from daebench.pages.report.claims import ClaimRefuted
from daebench.pages.report.tables import write_tables
from daebench.reports.problems import Numbers, check, draw, ivps, jobs, problem_rows, rank, runs, tables
from daebench.reports.problems.drawings import drawing_of
from daebench.reports.problems.facts import facts
from daebench.reports.problems.prose import description
from daebench.reports.problems.references import entries, published
from daebench.reports.problems.results import across, outcome, reason

FEW = ("planar_pendulum", "torus")
CHEAP = ("symplectic_euler", "rattle", "shake", "se", "seproj", "rk4", "rk4+proj", "strang")


def test_every_constrained_problem_is_in_the_report_once():
    assert sorted(ivps.names()) == sorted(catalogue("constrained"))
    assert {job[1][0] for job in jobs()} == set(catalogue())


@pytest.mark.parametrize(
    ("name", "d", "m", "structure", "integrals"),
    [
        ("planar_pendulum", 2, 1, "constant diagonal", []),
        ("slider_crank", 3, 2, "constant", []),
        ("torus", 3, 1, "constant diagonal", ["L3"]),
        ("arevalo", 2, 1, "H(p, q)", []),
    ],
    ids=lambda value: value if isinstance(value, str) and "_" in value else "",
)
def test_the_facts_are_those_of_the_definition(name, d, m, structure, integrals):
    found = facts(name)
    assert (found.d, found.m, found.dof, found.structure, found.integrals) == (d, m, d - m, structure, integrals)
    for _, what in found.formulas:
        ElementTree.fromstring(f"<p>{what}</p>")


@pytest.mark.slow
def test_the_facts_of_other_systems_are_those_of_the_book():
    kepler, body = facts("kepler"), facts("free_rigid_body")
    assert (kepler.d, kepler.m, kepler.dof, kepler.method, kepler.integrals) == (2, 0, 2, "rattle", ["L", "A1", "A2"])
    assert (body.d, body.structure, body.method) == (3, "", "strang")
    assert [name for name, _ in body.formulas][:2] == ["B", "H"]
    assert str(body.formulas[0][1]).count("<mtr>") == 3  # HLW VII.5: B = hat(y)
    assert facts("ablowitz_ladik").formulas == []  # a lattice is written in its docstring


def test_the_picture_of_a_poisson_system_has_its_coordinates():
    drawing = drawing_of("lotka_volterra")
    u, v = np.asarray(drawing.points[:, drawing.masses[0]]).T
    H = u - np.log(u) + v - 2 * np.log(v)  # HLW (2.13) with a = 1, b = 2
    assert np.ptp(H) < 1e-3
    assert drawing.axes == ("predators u", "prey v")
    assert drawing.off == 0


PROBLEMS = sorted((ROOT / "problems").glob("[a-z]*.py"))


def words(text):
    return re.sub(r"[`*]|::", "", text).split()


@pytest.mark.parametrize("file", PROBLEMS, ids=lambda file: file.stem)
def test_no_word_of_a_docstring_is_left_out_and_every_parameter_has_its_meaning(file):
    doc, problem = docstring(file.read_text(encoding="utf-8")), catalogue()[file.stem]
    shown = html.unescape(re.sub("<[^>]*>", "", description(doc)))
    assert [word.lower() for word in words(shown)] == [word.lower() for word in words(doc.partition("\nParameters\n")[0])][1:]
    ElementTree.fromstring(f"<div>{description(doc)}</div>")
    assert set(meanings(doc)) == {*problem.parameters, *problem.structure}
    assert all(text.endswith(".") for text in meanings(doc).values())


def test_prose_is_escaped_its_marks_are_html_and_formulas_stand_as_they_are_written():
    shown = description("Return A.\n\n::\n\n    x  = 1\n    y < 2\n\nIf ``x`` < 1, see\n*A Book*.\n\nParameters\n----------\n")
    parts = ["<p>A.</p>", "<pre><code>x  = 1\ny &lt; 2</code></pre>", "<p>If <code>x</code> &lt; 1, see <cite>A Book</cite>.</p>"]
    assert shown == "\n".join(parts)


NEAR = {
    "andrews_squeezer": {"q": 1.5e-9, "lam": 1.5e-5},
    "car_axis": {"q": 3e-13},
    "four_bar": {"q": 2e-6},
    "slider_crank_sundials": {"q": 5e-5},
}
"""How far published numbers are from the certified references, by their sources' own digits, see ``published.py``."""


@pytest.mark.sampled(left_out=("andrews_squeezer", "slider_crank_sundials"))
@pytest.mark.parametrize("problem", NEAR)
def test_published_numbers_are_as_near_to_the_references_as_they_claim(problem):
    rows = published(problem)
    assert rows
    for row in rows:
        assert row["off"] == abs(row["published"] - row["certified"]) <= NEAR[problem][row["name"].rstrip("0123456789")], row
    if problem == "andrews_squeezer":
        assert [row["published"] for row in rows] == [*BARI_Q, *BARI_LAM]


def test_published_numbers_are_of_these_problems():
    assert {entry["problem"] for entry in entries()} == set(NEAR)


@pytest.fixture(scope="module")
def drawings():
    return {name: drawing_of(name) for name in (*FEW, "slider_crank")}


def test_a_drawing_starts_at_the_start_and_its_rods_keep_their_lengths(drawings):
    crank = drawings["slider_crank"]
    assert crank.dimension == 2
    assert crank.off < 1e-12
    assert np.allclose(crank.points[0, crank.rods[0]], [[0, 0], [1, 0]], rtol=0, atol=1e-15)
    for rod, length in zip(crank.rods, (1.0, 2.0), strict=True):
        assert np.allclose(np.linalg.norm(np.diff(crank.points[:, rod], axis=1)[:, 0], axis=1), length, rtol=0, atol=1e-12)


def test_points_and_lines_are_on_the_torus(drawings):
    torus = drawings["torus"]
    for points in (torus.points[:, torus.masses[0]], torus.surface.reshape(-1, 3)):
        assert np.max(np.abs((np.hypot(points[:, 0], points[:, 1]) - 2) ** 2 + points[:, 2] ** 2 - 1)) < 1e-11
    assert torus.dimension == 3
    assert list(torus.table().columns) == ["t", "x1", "y1", "z1"]


@pytest.fixture(scope="module")
def against():
    return {name: runs.sizes_of(name) for name in FEW}


def test_a_row_has_the_errors_of_the_run(monkeypatch, against):
    monkeypatch.setattr(runs, "STEPS", 50)
    found = runs.row("planar_pendulum", "rattle", against["planar_pendulum"])
    ivp = ivps.ivp_of("planar_pendulum")
    run = runs.solve("planar_pendulum", ivp, parse("rattle"))
    H = np.sum(run.p**2, axis=1) / 2 + run.q[:, 1]
    T = against["planar_pendulum"].energy
    assert found["energy"] == pytest.approx(np.max(np.abs(H - H[0])) / T, rel=1e-12)
    assert found["g"] == pytest.approx(np.max(np.abs(np.sum(run.q**2, axis=1) - 1)), abs=4 * np.finfo(float).eps)
    assert (found["end"], found["steps"]) == ("reached", 50)
    assert found["solves"] == run.work["solve"]


@pytest.mark.slow
def test_every_method_is_asked_on_every_problem_and_what_is_left_out_has_its_reason(monkeypatch, against):
    assert {problem for problem, _ in runs.LEFT_OUT} <= set(catalogue("constrained"))
    assert {name for _, name in runs.LEFT_OUT} <= set(runs.METHODS)
    for (problem, name), why in runs.LEFT_OUT.items():
        found = runs.row(problem, name, against["torus"])
        assert (found["end"], found["why"], outcome(found)) == ("not run", why, "not run")
    monkeypatch.setattr(runs, "sizes_of", against.get)
    monkeypatch.setattr(runs, "row", lambda problem, name, sizes: (problem, name, sizes))
    assert problem_rows("torus") == [("torus", name, against["torus"]) for name in runs.METHODS]


def test_what_is_refused_or_stops_is_a_row_that_says_why(against):
    refused = runs.row("slider_crank", "strang", against["torus"])
    stopped = runs.row("planar_pendulum", "se", against["planar_pendulum"])
    assert (refused["end"], stopped["end"]) == ("refused", "stopped")
    assert "kinetic" in reason(refused)
    assert stopped["why"].count(reason(stopped)) == 1
    assert outcome(stopped) == f"stops at {stopped['t']:.3g}"


def test_a_run_that_is_too_short_for_a_trend_is_made_longer_until_it_has_one(against):
    found = runs.row("torus", "rattle", against["torus"])
    assert (found["end"], found["steps"], found["kind"]) == ("reached", runs.STEPS, "bounded")
    assert found["length"] in runs.LENGTHS[1:]


def test_the_times_of_rank_loss_are_those_of_the_definitions():
    assert rank.loss("four_bar") == pytest.approx(0.71435553, abs=1e-8)
    assert rank.loss("slider_crank") == pytest.approx(0.88743236848, abs=1e-8)
    assert rank.told_in("x stopped: G loses rank at about t = 0.714, within the next steps") == 0.714
    assert math.isnan(rank.told_in("x stopped"))


@pytest.fixture(scope="module")
def numbers(drawings, against):
    """Return numbers of two problems, measured with the methods that need no compiling, and of rank loss with two of them."""
    rows, paths = [], []
    for problem, case in rank.IVPS:
        for name in ("rattle", "lobatto3"):
            for mode in rank.MODES:
                row, path = rank.behaviour(problem, case, name, mode)
                rows.append(row)
                paths.append(path)
    return Numbers(
        facts=[facts(name) for name in FEW],
        others={"free": [facts("kepler")], "poisson": [facts("free_rigid_body")]},
        drawings={name: drawings[name] for name in FEW},
        runs=pd.DataFrame([runs.row(problem, name, against[problem]) for problem in FEW for name in CHEAP]),
        rank=pd.DataFrame(rows),
        rank_paths=pd.concat(paths, ignore_index=True),
        losses={problem: rank.loss(problem) for problem, _ in rank.IVPS},
    )


TAMPERED = {
    "rattle leaves the manifold": changed("runs", "g", 1e-9, "method == 'rattle' and problem == 'torus'"),
    "its velocities leave it": changed("runs", "Gv", 1e-9, "method == 'rk4+proj' and problem == 'planar_pendulum'"),
    "a residual is missing": changed("runs", "g", math.nan, "method == 'rattle' and problem == 'torus'"),
    "a picture is missing": lambda numbers: replace(numbers, drawings={}),
    "a path is off": lambda numbers: replace(numbers, drawings={k: replace(each, off=1e-6) for k, each in numbers.drawings.items()}),
    "it does not stop": changed("rank", "end", "reached", "mode == 'stop' and problem == 'four_bar'"),
    "it does not say why": changed("rank", "why", "stopped", "mode == 'stop' and method == 'rattle'"),
    "it stops within a step after": changed("rank", "t", 0.888, "mode == 'stop' and problem == 'slider_crank'"),
    "it is reflected": changed("rank", "branch", "reflected", "mode == 'continue' and method == 'lobatto3'"),
    "it does not go on": changed("rank", "end", "stopped", "mode == 'continue' and method == 'rattle'"),
}


@pytest.mark.slow
def test_the_story_passes_as_measured_and_is_drawn_and_tampered_numbers_stop_it(numbers, tmp_path):
    found = check(numbers)
    assert (found.across.problems, found.across.rattle_reached) == (2, 2)
    assert found.across.keeps == ["torus"]
    assert found.rank.told < 5e-4
    assert found.rank.through == found.rank.went == 4
    assert found.across.reached + found.across.stopped + found.across.refused == found.across.runs == len(numbers.runs)
    for tamper in TAMPERED.values():
        with pytest.raises(ClaimRefuted):
            check(tamper(numbers))
    require_tables(numbers, tmp_path / "tables")
    with drawing():
        svgs = {path.stem: path for path in draw(numbers, None, tmp_path)}
    assert svgs.keys() >= {*FEW, "scenes", "rank_loss", "heat_map"}
    for name in (*FEW, "scenes", "rank_loss"):  # of few problems the map has few squares
        require_figure(svgs[name], 100)


def require_tables(numbers, folder):
    """Require that tables have a row each, and say why a run is short."""
    found = write_tables(folder, tables(numbers, SimpleNamespace(across=SimpleNamespace(table=across(numbers.runs)))))
    assert {path.stem for path in folder.glob("*.csv")} == {"runs", "rank_loss", "across", "overview", *FEW}
    parsed = {name: ElementTree.fromstring(str(found[name]("Caption"))) for name in ("overview", "across", "rank", "planar_pendulum")}
    assert len(parsed["planar_pendulum"].findall(".//tbody/tr")) == len(CHEAP)


def require_moving(page, own):
    """Require a canvas a problem, drawn, that moves while it is seen, and stops when that is asked for."""
    canvases = page.locator("canvas[data-scene]")
    assert {each.get_attribute("data-scene") for each in canvases.all()} == set(own)
    canvases.first.scroll_into_view_if_needed()
    frame = "document.querySelector('canvas[data-scene]').dataset.frame"
    page.wait_for_function(f"Number({frame}) > 0.5")
    page.click("#play-scenes")
    before = page.evaluate(frame)
    page.wait_for_timeout(300)
    assert page.evaluate(frame) == before


@pytest.mark.slow
@pytest.mark.parametrize("own", [FEW, pytest.param(catalogue("constrained"), marks=pytest.mark.exhaustive)], ids=["few", "all"])
def test_the_whole_report_is_made_and_its_page_loads_nothing(tmp_path, looks_right, seen, monkeypatch, own):
    others = {"nonholonomic": ["knife_edge"], "free": ["kepler"], "poisson": ["lotka_volterra"]}
    everything = (*own, *(name for names in others.values() for name in names))
    monkeypatch.setattr("daebench.reports.problems.names", lambda: own)
    monkeypatch.setattr("daebench.reports.problems.problems", others.get)
    told_of = []
    page = build("problems", tmp_path, lambda fraction, label: told_of.append(fraction))
    source = page.read_text(encoding="utf-8")
    standalone(page)
    looks_right(page)
    for name in everything:
        assert f'href="{name}.html"' in source
        standalone(page.parent / f"{name}.html")
    looks_right(page.parent / f"{own[0]}.html")
    require_moving(seen(page.as_uri()).page, everything)
    require_moving(seen((page.parent / f"{own[1]}.html").as_uri()).page, own[1:2])
    shown = (page.parent / f"{own[1]}.html").read_text()
    names = {}
    exec(html.unescape(re.search(r"<pre><code>(import daebench.*?)</code></pre>", shown, re.DOTALL)[1]), names)
    assert names["run"].failure is None
    assert told_of == sorted(told_of)
    assert (told_of[0], told_of[-1]) == (0.0, 1.0)
