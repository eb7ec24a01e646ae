"""Lessons that live in a page: what they compute holds, they answer mouse, keys and sliders, fit a phone and can stand still."""

import numpy as np
import pytest
from browser import opens_its_details

from daebench.diagnostics.branch import largest_jump
from daebench.diagnostics.energy_verdict import energy_scales, size
from daebench.diagnostics.manifold import residual_scales
from daebench.methods.catalogue import lessons
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.pages.lesson.page import export
from daebench.runs.request import Request
from daebench.studies.grid.outcomes import outcomes_of

pytestmark = pytest.mark.slow

LIVE = sorted(set(lessons()) - {"tolerance"})


@pytest.fixture(scope="module")
def pages(tmp_path_factory, chromium):
    """Return the page of a lesson, made once."""
    folder = tmp_path_factory.mktemp("live")
    return lambda name: folder / name / "index.html" if (folder / name).exists() else export(name, folder / name)


@pytest.mark.sampled(by=lambda case: case == "poisson-maps")  # the words of why-symplectic are held below
@pytest.mark.parametrize("name", LIVE)
def test_a_live_page_fits_a_phone_moves_by_itself_and_answers(name, pages, seen, looks_right):
    looks_right(pages(name))
    require_small(pages(name), seen)
    require_motion(pages(name), seen)
    require_answers(seen(pages(name).as_uri()).page)


def require_small(path, seen):
    """Require that a page is small and that all its numbers are filled in."""
    assert path.stat().st_size < 300_000
    shown = seen(path.as_uri(), width=390, dark=True)
    assert shown.page.locator("canvas").count() >= 2
    assert not {output.text_content().strip() for output in shown.page.locator("[data-fill]").all()} & {"", "not a number"}
    shown.clean()


def require_motion(path, seen):
    """Require that the first screen moves by itself, and stands still where that is asked for."""
    page = seen(path.as_uri()).page
    canvas = "document.querySelector('.screen canvas').toDataURL()"
    for motion, moves in (("no-preference", True), ("reduce", False)):
        page.emulate_media(reduced_motion=motion)
        page.reload()
        page.wait_for_timeout(500)
        before = page.evaluate(canvas)
        page.wait_for_timeout(1500)
        assert (page.evaluate(canvas) != before) == moves


def require_answers(page):
    """Require that sliders and keys answer."""
    for slider in page.locator("input[type=range]").all():
        before = slider.get_attribute("aria-valuetext")
        slider.focus()
        slider.press("ArrowRight")
        assert slider.get_attribute("aria-valuetext") != before
    for canvas in page.locator("canvas[tabindex]").all():
        canvas.focus()
        canvas.press("ArrowLeft")
    assert opens_its_details(page)


def test_what_the_first_lesson_says_holds_in_the_page(pages, seen):
    shown = seen(pages("why-symplectic").as_uri())
    facts = shown.page.evaluate("facts")
    assert facts["complete"]
    assert facts["bound"] == pytest.approx(facts["midpoint"], rel=0.01)
    assert facts["stopped"] < 100 < facts["end"] < 5000
    assert facts["bound"] < 1e-3
    assert facts["one"] < 1e-14 < 1e-6 < facts["several"]
    shown.page.evaluate("{ formula.again(); for (let k = 0; k < 60; k++) formula.tick(0.1) }")
    change, worst = shown.page.evaluate("[formula.change, formula.worst]")
    assert abs(change) > 0.01
    assert worst < 1e-5 * abs(change)
    shown.clean()


@pytest.mark.exhaustive
def test_runs_on_the_torus_in_the_page_are_those_of_the_compiled_kernels(pages, seen):
    from daebench.reports.index_reduction.two_motions import TORUS, measured
    from daebench.reports.lessons.why_symplectic import ON_TORUS

    shown = seen(pages("why-symplectic").as_uri())
    shown.page.evaluate("{ Frames.screens[0].play(false); fair.again(); while (fair.time < 9999) fair.tick(0.1) }")
    peaks = shown.page.evaluate("Object.fromEntries(Object.entries(fair.items).map(([n, { peak, run }]) => [n, [peak, run.t]]))")
    assert set(peaks) == set(ON_TORUS)
    for name, (peak, t) in peaks.items():
        run = measured(TORUS, name)
        assert t == pytest.approx(run.t[-1], abs=0.2)
        assert run.failure or peak == pytest.approx(run.most, rel=1e-3)
    shown.clean()


def test_dragging_the_bob_begins_another_run(pages, seen):
    page = seen(pages("why-symplectic").as_uri()).page
    page.locator("[data-globe=rattle]").scroll_into_view_if_needed()
    box = page.locator("[data-globe=rattle]").bounding_box()
    page.evaluate("Frames.screens[1].play(false)")  # or the bob would be elsewhere by the time that the mouse is there
    before = page.evaluate("start.q.join()")
    bob = "(() => { const g = hero.runs.rattle.globe, [a, b] = g.view.seen(...g.unit()), r = g.radius(); "
    at = page.evaluate(bob + "return [g.width / 2 + r * a, g.height / 2 - r * b] })()")
    page.mouse.move(box["x"] + at[0], box["y"] + at[1])
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] * 0.5, box["y"] + box["height"] * 0.6)
    page.mouse.up()
    q = page.evaluate("start.q")
    assert ",".join(map(str, q)) != before
    assert sum(x * x for x in q) == pytest.approx(1)
    assert abs(page.evaluate("start.p.reduce((sum, x, i) => sum + x * start.q[i], 0)")) < 1e-12


def test_what_the_lesson_on_lobatto_says_holds_in_the_page(pages, seen):
    shown = seen(pages("shake-to-lobatto").as_uri())
    facts, slopes = shown.page.evaluate("[facts, orders.finish()]")
    assert facts["positions"] < 1e-12 < 1e-5 < facts["across"]
    assert facts["momenta"] < 1e-12
    for name, order in {"se": 1, "shake": 2, "rattle": 2, "lobatto3": 4, "lobatto4": 6}.items():
        assert slopes[name] == pytest.approx(order, abs=0.3)
    shown.clean()


def test_what_the_lesson_on_poisson_maps_says_holds_in_the_page(pages, seen):
    shown = seen(pages("poisson-maps").as_uri())
    facts = shown.page.evaluate("facts")
    assert max(facts["strang"], facts["symplectic_euler_adjoint"]) < 1e-12
    assert 1e-4 < facts["rk4"] < facts["midpoint"] < 1
    t, y = 0.0, np.array([4.0, 2.0])
    while min(y) > 0:
        t, y = t + 0.2, y + 0.2 * np.array([y[0] * (y[1] - 2), y[1] * (1 - y[0])])
    assert facts["explicit_euler ends"] == pytest.approx(t - 0.2)
    shown.page.evaluate("{ Frames.screens[0].play(false); $('#cat [data-again]').click(); while (cats.time < 24) cats.step(); }")
    assert shown.page.evaluate("cats.items.explicit_euler.orbit.x.length") > 2
    shares = shown.page.evaluate("Object.fromEntries(Object.entries(cats.items).map(([n, i]) => [n, volume(i.tangent) / i.volume]))")
    assert max(abs(shares[name] - 1) for name in ("strang", "symplectic_euler_adjoint")) < 1e-12
    assert min(abs(shares[name] - 1) for name in ("rk4", "midpoint")) > 1e-4
    lengths = shown.page.evaluate(
        "(() => { for (let k = 0; k < 50; k++) for (const b of Object.values(body)) b.run.advance(20); "
        "return Object.fromEntries(Object.entries(body).map(([n, b]) => [n, Math.hypot(...b.run.state())])) })()"
    )
    assert abs(lengths["strang@123"] - 1) < 1e-12 > abs(lengths["midpoint"] - 1)
    assert abs(lengths["rk4"] - 1) > 1e-4
    shown.clean()


@pytest.mark.exhaustive
def test_what_the_lesson_on_nonholonomic_problems_says_holds_in_the_page(pages, seen):
    shown = seen(pages("nonholonomic").as_uri())
    facts = shown.page.evaluate("facts")
    assert facts["even"] < 1e-10 < 1 < facts["uneven"]
    assert facts["left"] < 0.6 < 0.75 < facts["half"] < 0.9 < min(facts["kept"], facts["gni"])
    run = parse("dla").solve(initial_value_problem("variable_transmission", "uneven"), Request(value=0.2, t_end=1000, every=0))
    assert facts["left"] == pytest.approx(np.sum(run.q[-1, [0, 2]] ** 2 + run.p[-1, [0, 2]] ** 2) / 2, rel=1e-9)
    shown.page.evaluate("Frames.screens[0].play(false)")
    errors = "Object.fromEntries(Object.entries(transmission.items).map(([n, { worst }]) => [n, worst]))"
    for asymmetry, push, bounded in ((10, 25, False), (0, 25, True), (10, 10, True)):
        shown.page.evaluate(SET, ["#transmission", {"asymmetry": asymmetry, "push": push}])
        shown.page.evaluate("{ while (transmission.time < 3000) transmission.tick(0.1); }")
        worst = shown.page.evaluate(errors)
        assert (worst["dla"] < 0.05) == bounded
        assert worst["gni"] < 0.15
    shown.clean()


SET = "([part, set]) => { for (const [name, x] of Object.entries(set)) { const input = $(`${part} [name=${name}]`); input.value = x; "
SET += "input.dispatchEvent(new Event('input')); } }"
"""Sets the sliders of a part of a page."""


CELLS = {
    "rattle": {(62, 2): "fine", (62, 18): "coarse", (62, 30): "no solution", (32, 50): "wrong branch"},
    "se": {(62, 2): "no solution", (32, 2): "off the manifold"},
    "se+proj": {(14, 2): "fine", (32, 2): "coarse", (38, 2): "lost"},
    "rk4": {(50, 2): "fine", (62, 2): "off the manifold", (62, 14): "blown up", (62, 30): "singular"},
}
"""Squares of the maps of the lesson on extremes, by row and column, and what becomes of these runs: each ending that there is occurs."""


@np.errstate(all="ignore")
def compiled_outcome(name, row, column):
    """Return the outcome of a run of the compiled kernel, the size of its energy error, and its steps."""
    from daebench.reports.lessons.extremes import END, GRAVITIES, STEPS, mapped_ivp

    ivp, h = mapped_ivp(GRAVITIES[row]), STEPS[column]
    run = parse(name).solve(ivp, Request(value=h, steps=round(END / h), every=1, watch=("energy", "manifold")))
    part = float(size(run.maxima["energy"], energy_scales(ivp, run)))
    jump = float(largest_jump(run.t, run.q, ivp.along("H_p", run.p, run.q))) if run.steps else 0.0
    columns = {"failure": run.failure or "", "energy_size": part, "energy_error": np.nan, "energy_scale": np.nan, "g": run.maxima["g"]}
    rows = {key: [value] for key, value in {**columns, "jump": jump}.items()}
    return outcomes_of(rows, np.array([residual_scales(ivp, ivp.p0, ivp.q0)[0]]))[0], part, run.steps


def test_squares_of_the_maps_have_the_outcomes_of_the_compiled_kernels(pages, seen):
    shown = seen(pages("extremes").as_uri())
    judge = "([name, row, column]) => { const cell = outcomes.judged(name, row, column); return [cell.word, cell.size, cell.steps]; }"
    for name, cells in CELLS.items():
        for (row, column), word in cells.items():
            outcome, part, steps = compiled_outcome(name, row, column)
            found = shown.page.evaluate(judge, [name, row, column])
            assert (found[0], found[2]) == (outcome, steps) == (word, steps)
            assert found[0] not in ("fine", "coarse") or found[1] == pytest.approx(part, rel=1e-9)
    assert len({word for cells in CELLS.values() for word in cells.values()}) == 8
    shown.clean()


def test_a_click_and_the_arrow_keys_choose_a_run_of_the_maps(pages, seen):
    page = seen(pages("extremes").as_uri()).page
    canvas, told = page.locator("[data-map=rk4]"), page.locator("[data-told]")
    box = canvas.bounding_box()
    page.mouse.click(box["x"] + 0.8 * box["width"], box["y"] + 0.2 * box["height"])
    assert page.evaluate("chosen.name") == "rk4"
    before, column = told.inner_text(), page.evaluate("chosen.column")
    assert "off the manifold" in before
    canvas.press("ArrowLeft")
    assert page.evaluate("chosen.column") == column - 1
    assert told.inner_text() != before


@pytest.mark.exhaustive
def test_what_the_lesson_on_extremes_says_holds_in_the_page(pages, seen):
    shown = seen(pages("extremes").as_uri())
    page = shown.page
    while not page.evaluate("outcomes.finished"):
        page.evaluate("outcomes.compute(500)")
    assert page.evaluate("outcomes.done") == 4 * 64**2
    assert page.evaluate("outcomes.edgeShare()") > 0.97
    large = "outcomes.maps.rk4.cells.filter((cell) => cell.h > 0.3 && cell.gravity > 1)"
    assert page.evaluate(f"{large}.filter((cell) => !cell.status).length / {large}.length") > 0.75
    assert page.evaluate("outcomes.maps.se.cells.every((cell) => cell.word !== 'fine' && cell.word !== 'coarse')")
    for speed, angle, nearer in ((10, 60, True), (40, 0, True), (3, 150, False)):
        page.evaluate(SET, ["#solution", {"speed": speed, "angle": angle, "h": 90}])
        formula, measured, step = page.evaluate("[line_.formula, line_.measured, line_.step()]")
        # up to the limit there is a solution; within 1e-4 of it, where two of them meet, the branch from h = 0 can no longer be told
        assert formula * (1 - 1e-4) < measured <= formula * (1 + 1e-9)
        assert step["beside"] < 1e-14
        end, free = step["end"][1], step["free"][1]
        assert end > 0  # of the two points the one that goes to q0 with h
        assert (abs(end - free) < abs(-end - free)) == nearer  # which is not always the one nearer to the end of the free motion
    chaos, lock, stiff, rounding = page.evaluate("[chaos, lock, stiff, rounding]")
    assert max(chaos["rattle"], chaos["lobatto3"]) < 40
    assert 0 < chaos["later"] < 10
    assert chaos["energy"] < 0.1 < 0.5 < chaos["gap"]
    assert lock["short"] > 10 * lock["long"]
    assert (lock["status"], lock["locks"] < 1) == (7, True)
    assert stiff["failed"] > 0 == stiff["works"]
    assert stiff["away"] < 0.02
    assert stiff["unresolved"] == 0
    assert stiff["turns"] > 0.9  # the rod turns from longer to shorter at nearly every step
    assert rounding["compensated"] < 0.5 * rounding["plain"]
    shown.clean()
