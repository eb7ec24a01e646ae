"""The report on problems: facts against the definitions, drawings on the manifold, claims that faults refute, tables, and the page."""

import html
import math
import pickle
import re
from dataclasses import replace
from types import SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest
from pages import standalone
from published import BARI_LAM, BARI_Q
from reported import require_figures, require_refused, stems_of
from said import ROOT
from tampered import changed

from daebench.diagnostics.drift import LAWS, Drift
from daebench.draw.orthographic import projected
from daebench.methods.catalogue import problems as catalogue
from daebench.methods.names import parse
from daebench.pages.docstrings import docstring, meanings
from daebench.pages.report import NONE, TIMES, build
from daebench.pages.report.claims import ClaimRefuted
from daebench.pages.report.tables import write_tables
from daebench.reports import problems
from daebench.reports.problems import Numbers, check, draw, ivps, jobs, problem_rows, rank, runs, tables
from daebench.reports.problems.drawings import FRAMES, HEIGHT, MARGIN, WIDTH, drawing_of, motion
from daebench.reports.problems.facts import facts
from daebench.reports.problems.prose import description
from daebench.reports.problems.rank import check_rank
from daebench.reports.problems.references import entries, published, shortened
from daebench.reports.problems.results import NO_DRIFT, across, draw_heat_map, outcome, per_problem, reason

FEW = ("planar_pendulum", "torus")
CHEAP = ("symplectic_euler", "rattle", "shake", "se", "seproj", "rk4", "rk4+proj", "strang")


def test_every_constrained_problem_is_in_the_report_once():
    assert sorted(ivps.names()) == sorted(catalogue("constrained"))
    assert {job[1][0] for job in jobs()} == set(catalogue())


def test_a_problem_without_a_horizon_is_run_too(monkeypatch):
    monkeypatch.setattr(ivps, "HORIZONS", {})
    assert ivps.step_size("planar_pendulum") == ivps.UNDECLARED.t_end / ivps.STEPS
    assert len(ivps.names()) == len(catalogue("constrained"))


def test_every_job_is_another_one_and_can_be_sent_to_another_process():
    found = jobs()
    assert len(set(found)) == len(found)
    assert pickle.loads(pickle.dumps(found)) == found


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
    assert found.summary == catalogue()[name].summary
    assert next(case["name"] for case in found.cases) == found.case
    assert all(case["about"] for case in found.cases)
    for _, what in found.formulas:
        ElementTree.fromstring(f"<p>{what}</p>")


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


def test_a_certified_reference_is_said_with_its_end():
    ends = {case["name"]: case["reference"].end for case in facts("planar_pendulum").cases}
    assert ends == dict.fromkeys(("horizontal", "near_top", "rotating", "iftomm_a01"), 100.0)
    cases = {case["name"]: case["reference"] for case in facts("torus").cases}
    assert (cases["trough"], cases["inner"]) == (None, None)
    known = cases["through_hole"]
    assert (known.end, known.times, [name for name, _ in known.last]) == (50.0, 401, ["q1", "q2", "q3"])
    q1, q2, q3 = (float(digits.rstrip("…")) for _, digits in known.last)
    assert abs((math.hypot(q1, q2) - 2) ** 2 + q3**2 - 1) < 1e-14


@pytest.mark.parametrize(
    ("digits", "shown"),
    [("-0.0123456789012345678", "-0.01234567890123456…"), ("12345678901234567.5e-3", "1234567890123456…e-3"), ("5.0", "5.0")],
    ids=["zeros do not count", "power", "few"],
)
def test_digits_are_cut_off_where_there_are_more_than_a_double_has(digits, shown):
    assert shortened(digits) == shown


PROBLEMS = sorted((ROOT / "problems").glob("[a-z]*.py"))


def words(text):
    return re.sub(r"[`*]|::", "", text).split()


@pytest.mark.parametrize("file", PROBLEMS, ids=lambda file: file.stem)
def test_no_word_of_a_docstring_is_left_out(file):
    doc = docstring(file.read_text(encoding="utf-8"))
    shown = html.unescape(re.sub("<[^>]*>", "", description(doc)))
    assert [word.lower() for word in words(shown)] == [word.lower() for word in words(doc.partition("\nParameters\n")[0])][1:]
    ElementTree.fromstring(f"<div>{description(doc)}</div>")


@pytest.mark.parametrize("file", PROBLEMS, ids=lambda file: file.stem)
def test_every_parameter_has_its_meaning(file):
    problem = catalogue()[file.stem]
    found = meanings(docstring(file.read_text(encoding="utf-8")))
    assert set(found) == {*problem.parameters, *problem.structure}
    assert all(text.endswith(".") for text in found.values())


def test_prose_is_escaped_its_marks_are_html_and_formulas_stand_as_they_are_written():
    assert description("Return A.\n\n::\n\n    x  = 1\n    y < 2\n\nIf ``x`` < 1, see\n*A Book*.\n\nParameters\n----------\n") == (
        "<p>A.</p>\n<pre><code>x  = 1\ny &lt; 2</code></pre>\n<p>If <code>x</code> &lt; 1, see <cite>A Book</cite>.</p>"
    )


NEAR = {
    "andrews_squeezer": {"q": 1.5e-9, "lam": 1.5e-5},
    "car_axis": {"q": 3e-13},
    "four_bar": {"q": 2e-6},
    "slider_crank_sundials": {"q": 5e-5},
}
"""How far published numbers are from the certified references, by their sources' own digits, see ``published.py``."""


def test_published_numbers_are_as_near_to_the_references_as_they_claim():
    assert {entry["problem"] for entry in entries()} == set(NEAR)
    for problem, bounds in NEAR.items():
        rows = published(problem)
        assert rows
        for row in rows:
            assert row["off"] == abs(row["published"] - row["certified"]) <= bounds[row["name"].rstrip("0123456789")], (problem, row)
    squeezer = {row["name"]: row["published"] for row in published("andrews_squeezer")}
    assert list(squeezer.values()) == [*BARI_Q, *BARI_LAM]


def test_a_residual_that_is_not_a_number_is_not_printed():
    row = {"why": "rk4 on x, case y, stopped at t = 1 (step 2 of 3, h = 4): a value is no longer finite; use a smaller h."}
    assert reason(row) == "a value is no longer finite"


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


def test_the_projection_keeps_lengths_across_the_line_of_sight():
    flat = projected(np.eye(3))
    assert np.allclose(np.sum(flat**2), 2, rtol=0, atol=1e-14)
    assert np.array_equal(projected(np.ones((4, 5, 2))), np.ones((4, 5, 2)))


def test_cards_hold_positions_that_fit_them_and_are_those_of_the_run(drawings):
    crank = drawings["slider_crank"]
    card = motion(crank)
    lengths = {len(places) for places in card["points"]}
    assert lengths == {2, 2 * (FRAMES + 1)}
    assert min(map(min, card["points"])) >= MARGIN - 1
    for axis, size in ((0, WIDTH), (1, HEIGHT)):
        assert max(max(places[axis::2]) for places in card["points"]) <= size - MARGIN + 1
    pivot, pin = (card["points"][k] for k in card["rods"][0])
    x, y = np.array(pin).reshape(-1, 2).T - np.array(pivot)[:, None]
    radius = np.hypot(x, y)
    assert np.ptp(radius) <= 2
    angle = np.arctan2(crank.points[:, crank.rods[0][1], 1], crank.points[:, crank.rods[0][1], 0])
    times = np.linspace(0, len(crank.t) - 1, FRAMES + 1).round().astype(int)
    assert np.abs(np.exp(1j * np.arctan2(-y, x)) - np.exp(1j * angle[times])).max() < 2 / radius.min()


@pytest.fixture(scope="module")
def against():
    return {name: runs.sizes_of(name) for name in FEW}


def test_what_errors_are_compared_with_are_sizes_along_the_run_of_rattle(against):
    ivp = ivps.ivp_of("torus")
    run = runs.solve("torus", ivp, parse("rattle"))
    p, q = np.abs(run.p), np.abs(run.q)
    assert against["torus"].energy == pytest.approx(np.max(np.sum(p**2, axis=1) / 2), rel=1e-14)
    L3 = (p[:, 0] + p[:, 1]) * q.max(axis=1) + (q[:, 0] + q[:, 1]) * p.max(axis=1)
    assert against["torus"].integrals == pytest.approx({"L3": np.max(L3)}, rel=1e-8)
    run = runs.solve("planar_pendulum", ivps.ivp_of("planar_pendulum"), parse("rattle"))
    p, q = np.abs(run.p), np.abs(run.q)
    assert against["planar_pendulum"].g == pytest.approx(np.max(2 * q.sum(axis=1) * q.max(axis=1)), rel=1e-14)
    Gv = 2 * (p.sum(axis=1) * q.max(axis=1) + q.sum(axis=1) * p.max(axis=1))
    assert against["planar_pendulum"].Gv == pytest.approx(np.max(Gv), rel=1e-14)
    assert against["planar_pendulum"].integrals == {}


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


def test_the_error_of_an_integral_is_a_part_of_what_its_terms_amount_to(monkeypatch, against):
    monkeypatch.setattr(runs, "STEPS", 100)
    found = runs.row("torus", "rk4", against["torus"])
    run = runs.solve("torus", ivps.ivp_of("torus"), parse("rk4"))
    L3 = run.q[:, 0] * run.p[:, 1] - run.q[:, 1] * run.p[:, 0]
    assert found["integrals"] == pytest.approx(np.max(np.abs(L3 - L3[0])) / against["torus"].integrals["L3"], rel=1e-10)
    assert found["worst_integral"] == "L3"


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
    assert refused["end"] == "refused"
    assert "needs the flow of the kinetic energy" in reason(refused)
    stopped = runs.row("planar_pendulum", "se", against["planar_pendulum"])
    assert stopped["end"] == "stopped"
    assert reason(stopped) == "the iteration did not converge in 100 iterations"
    assert outcome(stopped) == f"stops at {stopped['t']:.3g}"


def test_a_run_that_is_too_short_for_a_trend_is_made_longer_until_it_has_one(against):
    found = runs.row("torus", "rattle", against["torus"])
    assert (found["end"], found["steps"], found["kind"]) == ("reached", runs.STEPS, "bounded")
    assert found["length"] in runs.LENGTHS[1:]


def test_a_longer_run_that_stops_decides_nothing(monkeypatch, against):
    ivp, solver = ivps.ivp_of("torus"), parse("rk4")
    run = runs.solve("torus", ivp, solver)
    monkeypatch.setattr(runs, "held_verdict", lambda ivp, method, request, run: Drift("failed" if run.failure else "undetermined", "why"))
    found = runs.trend("torus", ivp, solver, run, against["torus"])  # with 25 times the length RK4 leaves the torus
    assert (found["kind"], found["length"]) == ("undetermined", 25)


def test_errors_that_are_not_finite_are_infinite():
    assert runs.largest([1.0, math.nan]) == math.inf
    assert runs.largest([1.0, -2.0]) == 2.0


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


def test_the_story_passes_as_measured(numbers):
    found = check(numbers)
    assert (found.across.problems, found.across.rattle_reached) == (2, 2)
    assert found.across.keeps == ["torus"]
    assert found.rank.told < 5e-4
    assert found.rank.through == found.rank.went == 4
    assert found.across.reached + found.across.stopped + found.across.refused == found.across.runs == len(numbers.runs)


TAMPERED = {
    "rattle leaves the manifold": changed("runs", "g", 1e-9, method="rattle", problem="torus"),
    "its velocities leave it": changed("runs", "Gv", 1e-9, method="rk4+proj", problem="planar_pendulum"),
    "a residual is missing": changed("runs", "g", math.nan, method="rattle", problem="torus"),
    "a picture is missing": lambda numbers: replace(numbers, drawings={}),
    "a path is off": lambda numbers: replace(numbers, drawings={k: replace(each, off=1e-6) for k, each in numbers.drawings.items()}),
    "it does not stop": changed("rank", "end", "reached", mode="stop", problem="four_bar"),
    "it does not say why": changed("rank", "why", "stopped", mode="stop", method="rattle"),
    "it stops within a step after": changed("rank", "t", 0.888, mode="stop", problem="slider_crank"),
    "it is reflected": changed("rank", "branch", "reflected", mode="continue", method="lobatto3"),
    "it does not go on": changed("rank", "end", "stopped", mode="continue", method="rattle"),
}


@pytest.mark.parametrize("tamper", TAMPERED.values(), ids=list(TAMPERED))
def test_a_tampered_number_stops_the_page(numbers, tamper):
    with pytest.raises(ClaimRefuted):
        check(tamper(numbers))


def test_what_is_counted_follows_the_numbers(numbers):
    numbers = changed("runs", "kind", "bounded", method="rattle")(numbers)
    worse = changed("runs", "kind", "linear", method="rattle", problem="torus")(numbers)
    assert (check(numbers).across.rattle_quiet, check(worse).across.rattle_quiet) == (2, 1)
    assert check(worse).across.rattle_other == ["torus"]
    unknown = changed("runs", "kind", "undetermined", method="rattle", problem="torus")(numbers)
    assert (check(unknown).across.rattle_quiet, check(unknown).across.rattle_other) == (1, [])
    lost = changed("runs", "integrals", 1e-10, method="rattle", problem="torus")(numbers)
    assert (check(numbers).across.loses, check(lost).across.loses) == ([], ["torus"])
    off = changed("runs", "Gv", 1e-9, method="rattle", problem="torus")(numbers)
    for column, tampered in (("bounded", worse), ("bounded", unknown), ("manifold", off)):
        assert [across(each.runs).set_index("method")[column]["rattle"] for each in (numbers, tampered)] == [2, 1]
    assert "rattle" in per_problem(worse.runs)["torus"].drifting
    assert "rattle" not in per_problem(unknown.runs)["torus"].drifting
    wandered = changed("rank", "branch", "other branch", mode="continue")(numbers)
    with pytest.raises(ClaimRefuted, match="goes on through"):
        check_rank(wandered.rank, wandered.losses)


def test_a_pair_that_is_left_out_counts_nowhere_but_is_told(numbers):
    left = changed("runs", "end", "not run", method="rk4", problem="torus")(numbers)
    found = check(replace(left, runs=left.runs.assign(why=left.runs["why"].where(left.runs["end"] != "not run", "it is long"))))
    assert (found.across.left_out, found.across.runs) == (1, len(numbers.runs) - 1)
    assert found.across.table.set_index("method")["asked"]["rk4"] == 1
    assert found.per["torus"].left_out == {"it is long": ["rk4"]}
    assert found.per["planar_pendulum"].left_out == {}


def test_the_tables_have_a_row_each_and_say_why_a_run_is_short(numbers, tmp_path):
    found = write_tables(tmp_path, tables(numbers, SimpleNamespace(across=SimpleNamespace(table=across(numbers.runs)))))
    text = str(found["planar_pendulum"]("Caption"))
    root = ElementTree.fromstring(text)
    assert len(root.findall(".//tbody/tr")) == len(CHEAP)
    assert "stops at" in text
    assert "nan" not in text
    assert sorted(path.stem for path in tmp_path.glob("*.csv")) == sorted(["runs", "rank_loss", "across", "overview", *FEW])
    for name in ("overview", "across", "rank"):
        ElementTree.fromstring(str(found[name]("Caption")))


def test_the_heat_map_has_a_square_for_each_pair_and_a_sign_for_each_end(tmp_path, monkeypatch):
    from matplotlib.axes import Axes

    signs = {}
    monkeypatch.setattr(Axes, "text", lambda self, x, y, text, **look: signs.update({(x, y): (text, look["color"])}))
    ends = [
        ("a", "reached", 1e-3, next(iter(LAWS))),
        ("b", "reached", 1e-9, NO_DRIFT[0]),
        ("c", "stopped", math.nan, ""),
        ("d", "refused", math.nan, ""),
    ]
    rows = [{"problem": "one", "method": method, "end": end, "energy": energy, "kind": kind} for method, end, energy, kind in ends]
    draw_heat_map(pd.DataFrame(rows), tmp_path)
    assert list(signs) == [(0.5, k + 0.5) for k in range(4)]
    assert [text for text, _ in signs.values()] == ["/", "", TIMES, NONE]
    assert signs[0.5, 0.5][1] == "white"
    assert pd.read_csv(tmp_path / "heat_map.csv")["method"].tolist() == ["a", "b", "c", "d"]


@pytest.mark.slow
def test_the_figures_show_numbers_that_are_beside_them(numbers, tmp_path, monkeypatch):
    stems = stems_of(draw(numbers, None, tmp_path))
    assert stems == {*FEW, "scenes", "rank_loss", "heat_map"}
    require_figures(stems - {"heat_map"}, tmp_path)  # of few problems it has few squares
    assert (tmp_path / "heat_map.csv").stat().st_size > 100


def test_a_refuted_claim_leaves_no_page(numbers, tmp_path, monkeypatch):
    require_refused(problems, "problems", TAMPERED["it is reflected"](numbers), "goes on through", tmp_path, monkeypatch)


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
    snippet = html.unescape(
        re.search(r"<pre><code>(import daebench.*?)</code></pre>", (page.parent / f"{own[1]}.html").read_text(), re.DOTALL)[1]
    )
    names = {}
    exec(snippet, names)
    assert names["run"].failure is None
    assert told_of == sorted(told_of)
    assert (told_of[0], told_of[-1]) == (0.0, 1.0)
