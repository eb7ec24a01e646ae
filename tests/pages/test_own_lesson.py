"""The lesson on a problem of the reader's: what it refuses, and in a browser what its page computes, against steps written by hand."""

import json
import re
import subprocess
import sys

import numpy as np
import pytest
import said
from pages import Page, standalone

WELL = said.block("well.py")  # as the page on lessons has it


def force(q, depth=1.0):
    return -4 * depth * q * (q**2 - 1)


def slope(q, depth=1.0):
    return -4 * depth * (3 * q**2 - 1)


def verlet(p, q, h, steps, depth=1.0):
    """Return states of Störmer-Verlet, and the derivative of its map, from the equations of a step and their derivatives by hand."""
    states, derivative = [(p, q)], np.eye(2)  # rows and columns: p, q
    for _ in range(steps):
        half, first = p + h / 2 * force(q, depth), slope(q, depth)
        q = q + h * half
        p = half + h / 2 * force(q, depth)
        kicks = [np.array([[1, h / 2 * each], [0, 1]]) for each in (first, slope(q, depth))]
        derivative = kicks[1] @ np.array([[1, 0], [h, 1]]) @ kicks[0] @ derivative
        states.append((p, q))
    return np.array(states), derivative


@pytest.fixture
def well(tmp_path, monkeypatch):
    (tmp_path / "well.py").write_text(WELL)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_page_shows_the_positions_that_move(tmp_path, monkeypatch):
    from daebench.pages.gallery import Asked
    from daebench.reports.lessons._own_potential import labels, plane, posed

    (tmp_path / "crane.py").write_text(said.block("crane.py"))  # its tip T is held by two distances, and its load L swings
    monkeypatch.chdir(tmp_path)
    problem = posed(Asked("./crane.py"))
    assert [labels(problem.ivp)[place] for place in plane(problem)] == ["x of L", "y of L"]


@pytest.mark.slow
def test_the_page_of_a_well_stands_alone_and_computes_the_steps_that_are_written_by_hand(well, daebench, seen):
    assert daebench("lesson", "why-symplectic", "--problem", "./well.py", "--h", "0.05", "--no-browser", "--export", "out")[0] == 0
    written = well / "out" / "lesson-why-symplectic-well" / "index.html"
    require_whole(written)
    require_steps(seen(written.as_uri()))
    require_another_case(seen(written.as_uri()))
    require_notebook(written.with_name("why-symplectic.ipynb"))


def require_whole(written):
    """Require that a page stands alone, and is in the index."""
    page = standalone(written)
    assert written.stat().st_size < 150_000
    assert "A particle in a double well." in page.text
    assert "lesson-why-symplectic-well/index.html" in Page((written.parents[1] / "index.html").read_text(encoding="utf-8")).links


def require_steps(shown):
    """Require the steps that are written by hand."""
    shown.page.evaluate("{ Frames.screens[0].play(false); own.again(); for (let k = 0; k < 400; k++) own.advance(); }")
    states, derivative = verlet(0.5, 0.0, 0.05, 400)
    p, q, area, change, peak = shown.page.evaluate(
        "(() => { const { run, area, change, peak } = own.items.rattle; return [run.value(0), run.value(1), area, change, peak]; })()"
    )
    assert [p, q] == pytest.approx(states[-1], abs=1e-11)
    assert np.linalg.det(derivative) == pytest.approx(1, abs=1e-11)
    assert area == pytest.approx(1, abs=1e-11)
    energy = states[:, 0] ** 2 / 2 + (states[:, 1] ** 2 - 1) ** 2
    assert peak == pytest.approx(np.abs(energy - energy[0]).max(), rel=1e-9)
    assert change < 1e-11 < 1e-6 < shown.page.evaluate("own.items.rk4.change") < shown.page.evaluate("own.items.implicit_euler.change")
    assert shown.page.locator("[data-verdicts] tr").count() == 4
    shown.clean()


def require_another_case(shown):
    """Require that another case has its own parameters, and that a click is another start."""
    page = shown.page
    page.evaluate("Frames.screens[0].play(false)")
    page.select_option("[name=case]", "inside")
    page.evaluate("{ own.again(); for (let k = 0; k < 100; k++) own.advance(); }")
    assert page.evaluate("[...own.items.rattle.run.state()]") == pytest.approx(verlet(0.0, 1.5, 0.05, 100, depth=2.0)[0][-1], abs=1e-12)
    box = page.locator("[data-plane=rattle]").bounding_box()
    page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 0.3 * box["height"])
    p, q = page.evaluate("[...own.items.rattle.path[0]]")
    assert (p > 0.5, abs(q) < 0.1) == (True, True)
    shown.clean()


def require_notebook(path):
    """Require that a notebook runs beside its page."""
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    code = "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "code")
    assert re.search(r'"\.\./\.\./well\.py", "over"', code)
    subprocess.run([sys.executable, "-c", f"{code}\nassert run.maxima['energy'] < 0.1"], check=True, cwd=path.parent)


@pytest.mark.slow
def test_a_constrained_problem_has_its_constraint_in_the_page(seen, tmp_path):
    from daebench.pages.gallery import Asked, lesson_page

    page = lesson_page("why-symplectic", Asked("slider_crank")).make(tmp_path / "page", lambda fraction, doing: None)
    shown = seen(page.as_uri())
    shown.page.evaluate("{ Frames.screens[0].play(false); own.again(); for (let k = 0; k < 120; k++) own.advance(); }")
    off = shown.page.evaluate("Object.fromEntries(Object.entries(own.items).map(([name, { off, change }]) => [name, [off, change]]))")
    assert max(off["rattle"]) < 1e-9
    assert off["se"][0] > 1e-3
    assert min(off[name][1] for name in ("midpoint", "se", "rk4")) > 1e-7
    shown.clean()
