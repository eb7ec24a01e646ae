"""Lessons: what they compute without marimo, what their notebooks say as scripts, and the static pages made of them."""

import importlib
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from daebench.catalogue import lessons
from daebench.diagnostics.symplecticity import areas, symplecticity_defect, tangent_path
from daebench.errors import BadInput
from daebench.lesson.control import NO_YES, Control, defaults
from daebench.lesson.film import film
from daebench.lesson.mathml import static_html
from daebench.lesson.serve import HOST, command, free_port
from daebench.names import parse

ROOT = Path(__file__).parent.parent
EVERY = sorted(lessons())


def module_of(name):
    """Return the pure functions of a lesson."""
    return importlib.import_module(f"daebench.reports.lessons._{name.replace('-', '_')}")


@pytest.mark.slow
@pytest.mark.parametrize("name", EVERY)
def test_the_controls_of_a_lesson_answer_with_a_picture_and_with_words(name):
    for each in module_of(name).EXPERIMENTS:
        values = defaults(each.controls)
        shown = each.show(values)
        assert shown.picture.count("<svg") >= 1
        assert "nan" not in shown.says.lower()
        assert len(each.table(values)) > 1


@pytest.mark.slow
@pytest.mark.parametrize("name", EVERY)
def test_a_lesson_tells_only_what_holds(name):
    assert vars(module_of(name).facts())


@pytest.mark.slow
@pytest.mark.parametrize("name", EVERY)
def test_a_notebook_is_a_plain_script_too(name):
    file = ROOT / "reports" / "lessons" / f"{name.replace('-', '_')}.py"
    said = subprocess.run([sys.executable, file], capture_output=True, text=True, check=True, cwd=ROOT).stdout
    for each in module_of(name).EXPERIMENTS:
        assert each.show(defaults(each.controls)).says.striptags() in said


def test_a_control_refuses_a_default_or_a_film_that_does_not_belong_to_it():
    with pytest.raises(BadInput, match=r"control h: 3 is not among its values"):
        Control("h", "h", (1, 2), 3)
    with pytest.raises(BadInput, match="leaves out the default 1"):
        Control("h", "h", (1, 2), 1, film=(2,))
    assert Control("on", "on", NO_YES, False).is_switch
    assert not Control("on", "on", NO_YES, False).is_slider


def test_formulas_become_mathml_and_paragraphs_paragraphs():
    text = '<span class="markdown prose"><span class="paragraph">Some <marimo-tex class="arithmatex">||(x^2&lt;1||)</marimo-tex>.</span>\n'
    text += '<marimo-tex class="arithmatex">||[\ny = 1 \\tag{HLW VI.2}||]</marimo-tex></span>'
    found = static_html(text)
    assert found.startswith("<p>Some <math")
    assert "<msup>" in found
    assert "&#x0003C;" in found or "&lt;" in found
    assert '<span class="no">(HLW VI.2)</span>' in found
    assert "marimo" not in found


def test_a_port_that_is_taken_is_refused_and_the_server_is_asked_for_the_loopback_address_alone():
    import socket

    with socket.socket() as taken:
        taken.bind((HOST, 0))
        taken.listen()
        with pytest.raises(BadInput, match="give another --port"):
            free_port(taken.getsockname()[1])
    with pytest.raises(BadInput, match="from 1 to 65535"):
        free_port(70000)
    started = command(EVERY[0], 1234, browser=False)
    assert started[started.index("--host") + 1] == "127.0.0.1"
    assert "--headless" in started
    assert Path(started[started.index("run") + 1]).is_file()


@pytest.fixture(autouse=True)
def short_runs_uncompiled(request, monkeypatch):
    """Have the runs of fast tests uncompiled: they take a few steps, and compiling takes seconds."""
    if "slow" not in request.keywords:
        for name in ("_why_symplectic_run",):
            module = importlib.import_module(f"daebench.reports.lessons.{name}")
            monkeypatch.setattr(module, "parse", lambda *words: replace(parse(*words), compiled=False))


def run_of(scheme, **changed):
    """Return the run of the first lesson with some values changed."""
    from daebench.reports.lessons._why_symplectic_run import carried

    return carried.__wrapped__(**{"scheme": scheme, "project": False, "start": "wide", "h": 0.1, "t_end": 2.0} | changed)


@pytest.mark.parametrize("scheme", ["se", "rk4", "rattle"])
def test_the_area_of_the_parallelogram_is_what_the_diagnostics_say_of_the_same_map(scheme):
    from daebench.reports.lessons._why_symplectic_run import method_of, scene_of, sides

    run, scene = run_of(scheme), scene_of("wide")
    X = sides(scene)
    flow = method_of(scheme, False)[0].flow(scene, 0.1, len(run.t) - 1)
    assert abs(run.area[-1] - 1) == pytest.approx(symplecticity_defect(flow, scene.p0, scene.q0, X), abs=1e-12)
    assert run.area[0] == pytest.approx(1, abs=1e-15)


@pytest.mark.parametrize("scheme", ["se", "rattle"])
def test_the_parallelogram_is_carried_as_differences_of_neighbouring_runs_say(scheme):
    from daebench.reports.lessons._why_symplectic_run import method_of, scene_of, sides

    run, scene, eps = run_of(scheme), scene_of("wide"), 1e-6
    flow = method_of(scheme, False)[0].flow(scene, 0.1, 20)
    for k, side in enumerate(sides(scene).T):
        ahead, behind = (np.concatenate(flow(scene.p0 + s * eps * side[:3], scene.q0 + s * eps * side[3:])).real for s in (1, -1))
        assert run.X[-1, :, k] == pytest.approx((ahead - behind) / (2 * eps), rel=1e-6, abs=1e-7)


def test_the_area_is_kept_by_symplectic_schemes_and_by_no_other():
    assert {name: run_of(name).kept for name in ("rattle", "symplectic_euler", "lobatto3")} == dict.fromkeys(
        ("rattle", "symplectic_euler", "lobatto3"), True
    )
    assert not any(run_of(name).kept for name in ("se", "rk4", "midpoint", "implicit_euler"))
    assert not run_of("se", project=True).kept
    assert np.max(run_of("se", project=True).g) < 1e-14


def test_areas_are_those_of_the_drawn_parallelograms():
    from daebench.reports.lessons._why_symplectic_picture import corners

    X = np.random.default_rng(7).normal(size=(6, 2))
    for i in range(3):
        q, p = corners(X, i).T
        shoelace = 0.5 * np.sum(q * np.roll(p, -1) - np.roll(q, -1) * p)
        assert areas(X)[i] == pytest.approx(shoelace, abs=1e-14)
    J = np.block([[np.zeros((3, 3)), -np.eye(3)], [np.eye(3), np.zeros((3, 3))]])
    assert areas(X).sum() == pytest.approx(X[:, 0] @ J @ X[:, 1])


def test_a_run_that_ends_early_is_shown_up_to_there():
    run = run_of("rattle", start="fast", h=0.2)
    assert run.failure
    assert len(run.t) == len(run.X) < 11


def test_tangent_vectors_of_a_path_that_ends_at_once_are_those_of_the_start():
    X = np.eye(2)
    x, carried, failure = tangent_path(lambda p, q: (np.concatenate([p, q])[None], "no step"), [1.0], [2.0], X)
    assert x.tolist() == [[1.0, 2.0]]
    assert carried[0] == pytest.approx(X)
    assert failure == "no step"


@pytest.mark.slow
def test_a_film_has_a_frame_for_each_choice_and_they_differ():
    each = module_of("why-symplectic").EXPERIMENTS[0]
    text = film(each, lambda fraction: None)
    frames = text.split("<template ")[1:]
    expected = np.prod([len(control.film) for control in each.controls if control.film])
    assert len(frames) == expected
    drawings = [frame.partition(">")[2] for frame in frames]
    assert len(set(drawings)) > 0.8 * expected
    assert text.count("<fieldset") + text.count('type="range"') == sum(bool(control.film) for control in each.controls)
    assert "length of the run 10 s" in text
