"""Lessons: what they compute without marimo, what their notebooks say as scripts, and the static pages made of them."""

import importlib
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from daebench.diagnostics.symplecticity import areas, symplecticity_defect, tangent_path
from daebench.errors import BadInput
from daebench.methods.catalogue import lessons
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import POISSON, parse
from daebench.pages.lesson.control import NO_YES, Control, defaults
from daebench.pages.lesson.live_page import lives_in_a_page
from daebench.pages.lesson.mathml import static_html
from daebench.pages.lesson.page import export
from daebench.pages.lesson.static import static_experiment
from daebench.pages.report.claims import ClaimRefuted
from daebench.reports.lessons._poisson_maps_page import BODY, SPIN
from daebench.runs.request import Request

ROOT = Path(__file__).parents[2]
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
@pytest.mark.parametrize("name", [EVERY[0], *(pytest.param(name, marks=pytest.mark.exhaustive) for name in EVERY[1:])])
def test_a_notebook_is_a_plain_script_too(name):
    file = ROOT / "reports" / "lessons" / f"{name.replace('-', '_')}.py"
    said = subprocess.run([sys.executable, file], capture_output=True, text=True, check=True, cwd=ROOT).stdout
    for each in module_of(name).EXPERIMENTS:
        assert each.show(defaults(each.controls)).says.striptags() in said


def test_a_control_refuses_values_that_do_not_belong_to_it():
    with pytest.raises(BadInput, match=r"control h: 3 is not among its values"):
        Control("h", "h", (1, 2), 3)
    with pytest.raises(BadInput, match="leaves out the default 1"):
        Control("h", "h", (1, 2), 1, offered=(2,))
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


@pytest.fixture(autouse=True)
def short_runs_uncompiled(request, monkeypatch):
    """Have the runs of fast tests uncompiled: they take a few steps, and compiling takes seconds."""
    if "slow" not in request.keywords:
        for name in ("_why_symplectic_run", "_shake_to_lobatto_runs"):
            module = importlib.import_module(f"daebench.reports.lessons.{name}")
            monkeypatch.setattr(module, "parse", lambda *words: replace(parse(*words), compiled=False))
        poisson = "daebench.reports.lessons._poisson_maps_runs.parse"
        monkeypatch.setattr(poisson, lambda name, **more: replace(parse(name, **more), compiled=False))


def run_of(scheme, **changed):
    """Return the run of the first lesson with some values changed."""
    from daebench.reports.lessons._why_symplectic_run import carried

    return carried.__wrapped__(**{"scheme": scheme, "project": False, "start": "wide", "h": 0.1, "t_end": 2.0} | changed)


@pytest.mark.parametrize("scheme", ["se", "rk4", "rattle"])
def test_the_area_of_the_parallelogram_is_what_the_diagnostics_say_of_the_same_map(scheme):
    from daebench.reports.lessons._why_symplectic_run import ivp_of, method_of, sides

    run, ivp = run_of(scheme), ivp_of("wide")
    X = sides(ivp)
    flow = method_of(scheme, False)[0].flow(ivp, 0.1, len(run.t) - 1)
    assert abs(run.area[-1] - 1) == pytest.approx(symplecticity_defect(flow, ivp.p0, ivp.q0, X), abs=1e-12)
    assert run.area[0] == pytest.approx(1, abs=1e-15)


@pytest.mark.parametrize("scheme", ["se", "rattle"])
def test_the_parallelogram_is_carried_as_differences_of_neighbouring_runs_say(scheme):
    from daebench.reports.lessons._why_symplectic_run import ivp_of, method_of, sides

    run, ivp, eps = run_of(scheme), ivp_of("wide"), 1e-6
    flow = method_of(scheme, False)[0].flow(ivp, 0.1, 20)
    for k, side in enumerate(sides(ivp).T):
        ahead, behind = (np.concatenate(flow(ivp.p0 + s * eps * side[:3], ivp.q0 + s * eps * side[3:])).real for s in (1, -1))
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
def test_a_static_page_has_a_frame_for_each_choice_and_they_differ():
    each = module_of("why-symplectic").EXPERIMENTS[0]
    text = static_experiment(each, lambda fraction: None)
    frames = text.split("<template ")[1:]
    expected = np.prod([len(control.offered) for control in each.controls if control.offered])
    assert len(frames) == expected
    drawings = [frame.partition(">")[2] for frame in frames]
    assert len(set(drawings)) > 0.8 * expected
    assert text.count("<fieldset") + text.count('type="range"') == sum(bool(control.offered) for control in each.controls)
    assert "length of the run 10 s" in text


def test_the_projected_momenta_of_shake_are_those_of_rattle_and_without_the_projection_they_are_not():
    from daebench.reports.lessons import _shake_to_lobatto_runs

    found = _shake_to_lobatto_runs.hidden.__wrapped__(0.01, 0.1)
    assert found.positions < 1e-13
    assert found.momenta < 1e-12
    shake = _shake_to_lobatto_runs.solve("shake", "fast", 0.1, 10, every=1)
    rattle = _shake_to_lobatto_runs.solve("rattle", "fast", 0.1, 10, every=1)
    assert np.max(np.abs(shake.p - rattle.p)) > 1e-5
    tangent = np.einsum("ij,ij->i", _shake_to_lobatto_runs.projected(shake.p, shake.q), shake.q)
    assert np.max(np.abs(tangent)) < 1e-14


def test_errors_of_the_sequence_are_against_the_closed_form_and_a_wrong_one_would_be_seen():
    from daebench.diagnostics.order import fit_order
    from daebench.reports.lessons import _shake_to_lobatto_runs

    frame = _shake_to_lobatto_runs.step_sizes("rattle", "slow", 1.0, 5)
    assert frame["h"].tolist() == [0.5, 0.25, 0.125, 0.0625, 0.03125]
    assert fit_order(frame["h"], frame["q"]).slope == pytest.approx(2, abs=0.1)
    assert not abs(fit_order(frame["h"], frame["q"] + 1e-3).slope - 2) < 0.1


@pytest.mark.parametrize(("scheme", "keeps"), [("strang", True), ("symplectic_euler_adjoint", True), ("rk4", False), ("euler", False)])
def test_the_poisson_volume_along_an_orbit_and_that_of_the_cat_say_the_same(scheme, keeps):
    from daebench.reports.lessons._poisson_maps_runs import carried

    run = carried.__wrapped__(scheme, "4,2", 0.25, 1.5)
    assert (np.max(np.abs(run.volume - 1)) < 1e-12) == keeps
    assert (abs(run.share - 1) < 1e-12) == keeps
    assert (run.share - 1) * (run.volume[-1] - 1) > 0 or keeps


@pytest.mark.parametrize("start", ["4,2", "6,2"])
@pytest.mark.parametrize("scheme", ["strang", "symplectic_euler_adjoint"])
def test_a_poisson_map_has_all_of_the_cat_however_long_and_thin_it_is(scheme, start):
    from daebench.reports.lessons._poisson_maps_runs import carried

    run = carried.__wrapped__(scheme, start, 0.4, 8.0)
    assert abs(run.share - 1) < 1e-9


def polygon(outline):
    """Return the area of an outline in the plane of the logarithms."""
    u, v = np.log(outline).T
    return 0.5 * np.sum(u * np.roll(v, -1) - v * np.roll(u, -1))


@pytest.mark.parametrize(("scheme", "h"), [("rk4", 0.25), ("euler", 0.05)], ids=["rk4", "euler"])
def test_the_volume_of_a_cat_by_tangents_is_that_of_its_outline_in_short_lines(scheme, h, monkeypatch):
    from daebench.reports.lessons import _poisson_maps_runs

    monkeypatch.setattr(_poisson_maps_runs, "FINE", 24)
    run = _poisson_maps_runs.carried.__wrapped__(scheme, "4,2", h, 0.75)
    assert run.share == pytest.approx(polygon(run.cats[-1]) / polygon(run.cats[0]), rel=2e-4)
    assert abs(run.share - 1) > 4e-4


def long_run(level, end, *, g=0.0, failure=None, power=1):
    """Return a run whose energy error oscillates at a level, and grows by a power of the time to another one at the end."""
    from daebench.reports._two_motions import Run

    t = np.linspace(0.0, 1000.0, 20001)
    error = level * np.cos(7 * t) + (end - level) * (t / t[-1]) ** power
    return Run(t, np.zeros((len(t), 3)), error, g, failure)


TORUS = {
    "rattle": long_run(1e-2, 1e-2),
    "lobatto3": long_run(1e-5, 1e-5),
    "canonical:gauss2": long_run(1e-6, 1e-6),
    "local:gauss2": long_run(1e-6, 1e-3),
    "gauss2": long_run(1e-6, 1.0, g=0.1, power=2),
    "rk4": long_run(1e-3, 1.0, failure="it stopped"),
}
PENDULUM = {
    **{name: long_run(1e-4, 1e-4, g=g) for name, g in (("rattle", 0.0), ("midpoint", 1e-3), ("gauss2", 1e-8))},
    **{name: long_run(1e-3, 1.0, failure="it stopped") for name in ("se", "rk4")},
}
FALSE_TORUS = {
    "rattle drifts": {"rattle": long_run(1e-2, 0.1)},
    "lobatto3 drifts": {"lobatto3": long_run(1e-5, 1e-4)},
    "canonical drifts": {"canonical:gauss2": long_run(1e-6, 1e-4)},
    "gauss2 is level": {"gauss2": TORUS["canonical:gauss2"]},
    "gauss2 stays below rattle": {"gauss2": long_run(1e-6, 1e-3, g=0.1, power=2)},
    "gauss2 stops": {"gauss2": long_run(1e-6, 1.0, g=0.1, failure="it stopped", power=2)},
    "gauss2 stays on the torus": {"gauss2": long_run(1e-6, 1.0, power=2)},
    "local is level": {"local:gauss2": TORUS["canonical:gauss2"]},
    "local grows like a square": {"local:gauss2": long_run(1e-6, 1e-3, power=2)},
    "rk4 reaches the end": {"rk4": long_run(1e-3, 1.0)},
}
FALSE_PENDULUM = {
    "midpoint drifts": {"midpoint": long_run(1e-4, 1e-2, g=1e-3)},
    "midpoint is twice as bad": {"midpoint": long_run(2e-4, 2e-4, g=1e-3)},
    "midpoint keeps the rod": {"midpoint": long_run(1e-4, 1e-4)},
    "gauss2 drifts": {"gauss2": long_run(1e-8, 1e-6, g=1e-8)},
    "se reaches the end": {"se": long_run(1e-3, 1.0)},
}


@pytest.mark.parametrize("changed", FALSE_TORUS.values(), ids=FALSE_TORUS)
def test_the_first_lesson_is_not_written_if_the_torus_says_something_else(changed):
    from daebench.reports.lessons._why_symplectic_fair import check_torus

    check_torus(TORUS)
    with pytest.raises(ClaimRefuted):
        check_torus(TORUS | changed)


@pytest.mark.parametrize("changed", FALSE_PENDULUM.values(), ids=FALSE_PENDULUM)
def test_the_first_lesson_is_not_written_if_the_pendulum_says_something_else(changed):
    from daebench.reports.lessons._why_symplectic_fair import check_pendulum

    check_pendulum(PENDULUM)
    with pytest.raises(ClaimRefuted):
        check_pendulum(PENDULUM | changed)


def test_means_over_the_cat_are_exact_for_what_is_known():
    from daebench.reports.lessons._poisson_maps_runs import CORNERS, inside

    points, weights = inside()
    a, b = CORNERS, np.roll(CORNERS, -1, axis=0)
    twice = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    assert min(twice) > 0  # every point of the outline is seen from the middle
    assert weights.sum() == pytest.approx(1, rel=1e-14)
    assert weights @ points == pytest.approx((a + b).T @ twice / (3 * twice.sum()), abs=1e-14)
    squares = (a**2 + a * b + b**2).T @ twice / (6 * twice.sum())
    assert weights @ points**2 == pytest.approx(squares, rel=1e-13)


def test_the_explicit_euler_method_by_hand_ends_where_a_population_dies_out():
    from daebench.reports.lessons._poisson_maps_runs import carried, prey

    run = carried.__wrapped__("euler", "4,2", 0.5, 5.0)
    assert "no longer positive" in run.failure
    one = carried.__wrapped__("euler", "4,2", 0.01, 0.01)
    a, b = prey("4,2").par
    assert one.y[1] == pytest.approx([4 + 0.01 * 4 * (2 - b), 2 + 0.01 * 2 * (a - 4)], rel=1e-15)


def test_two_pendulums_have_parted_when_they_are_a_tenth_of_an_arm_apart():
    from daebench.reports.lessons._extremes_runs import parted

    t = np.array([0.0, 1.0, 2.0])
    assert parted(t, np.array([0.0, 0.05, 0.2])) == 2.0
    assert np.isnan(parted(t, np.zeros(3)))


@pytest.mark.usefixtures("uncompiled_schemes")
def test_an_arm_turns_over_when_the_angle_of_a_run_by_itself_passes_the_top(monkeypatch):
    from daebench.reports.lessons import _extremes_runs

    monkeypatch.setattr(_extremes_runs, "SIDE", 4)
    when, energy = _extremes_runs.turned.__wrapped__("rattle", 0.02, 2.0)
    angles = _extremes_runs.releases()[1]
    for row, column in ((0, 1), (0, 3), (1, 1)):
        one = np.array([np.sin(angles[column]), -np.cos(angles[column])])
        two = one + np.array([np.sin(angles[row]), -np.cos(angles[row])])
        ivp = initial_value_problem("double_pendulum", "horizontal", p0=np.zeros(4), q0=[*one, *two])
        run = parse("rattle").solve(ivp, Request(value=0.02, t_end=2.0, every=1)).complete()
        winding = np.unwrap(np.arctan2(run.q[:, 2] - run.q[:, 0], run.q[:, 1] - run.q[:, 3]))
        over = np.flatnonzero(np.abs(winding) > np.pi)
        first = run.t[over[0]] if len(over) else np.inf
        assert when[row, column] == first or 0 <= when[row, column] - first <= 0.06
        assert energy[row, column] == pytest.approx(run.maxima["energy"], rel=1e-12)
    assert np.isfinite(when).any()
    assert np.isinf(when).any()
    assert not np.isfinite(when[_extremes_runs.cannot_turn()]).any()


def test_neighbours_are_alike_that_turn_over_within_a_tenth_of_a_second_of_each_other():
    from daebench.reports.lessons._extremes_runs import alike

    when = np.array([[1.0, 1.1, 1.3], [1.0, np.inf, 5.0], [6.0, 6.0, np.inf]])
    assert alike(when, 0.0, 2.0) == 4 / 10
    assert alike(when, 4.0, 10.0) == 2 / 8
    assert alike(when, 5.0, 10.0) == 2 / 5


def test_asking_for_a_lesson_that_there_is_not_is_one_sentence(daebench, tmp_path):
    for words in (("--no-browser",), ("--export", tmp_path)):
        code, _, said = daebench("lesson", "why-symplectick", *words)
        assert code == 2
        assert said == "daebench: unknown lesson 'why-symplectick'; did you mean why-symplectic?\n"
    assert not list(tmp_path.iterdir())


def test_without_marimo_there_is_a_sentence_that_says_what_to_install(daebench, monkeypatch):
    monkeypatch.setattr("daebench.pages.lesson.installed.find_spec", lambda name: None)
    code, _, said = daebench("lesson", EVERY[0], "--no-browser")
    assert code == 2
    assert "pip install 'daebench[lessons]'" in said


def test_lessons_are_listed_and_listing_imports_no_marimo(daebench):
    assert all(name in daebench("lesson")[1] for name in EVERY)
    code = "import sys; sys.argv[1:] = ['list', 'lessons']; from daebench.cli.app import main\n"
    code += "try: main()\nexcept SystemExit: pass\nprint([name for name in ('marimo', 'pandas', 'sympy') if name in sys.modules])"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT).stdout
    assert said.strip().endswith("[]")


@pytest.mark.parametrize("h", [0.1, 0.5, 1.0])
def test_the_energy_error_of_the_body_oscillates_with_the_splitting_and_grows_with_rk4(h):
    body = initial_value_problem(BODY, "hlw", y0=[float(np.cos(SPIN)), 0.0, float(np.sin(SPIN))])
    most = {}
    for name in ("strang@123", "rk4"):
        run = parse(name, kind=POISSON, anyway=True).solve(body, Request(value=h, steps=2000, every=1, watch=()))
        error = np.abs(body.along("H", run.y) - body.along("H", run.y[:1]))
        most[name] = error[1000:].max() / error[:1000].max()
    assert most["strang@123"] == pytest.approx(1.0, abs=0.01)
    assert most["rk4"] > 1.5


@pytest.mark.slow
@pytest.mark.parametrize("name", EVERY)
def test_a_static_page_stands_alone(name, tmp_path):
    told = []
    page = export(name, tmp_path / name, lambda fraction, doing: told.append(fraction))
    text = page.read_text(encoding="utf-8")
    assert page == tmp_path / name / "index.html"
    assert not re.findall(r"""(?:src|href|url\()=?["']?(?:https?:)?//""", text)
    assert "marimo-" not in text
    assert "<math" in text
    assert text.count("<details>") >= 3
    assert told == sorted(told)
    with Image.open(page.parent / "figures" / "thumbnail.png") as thumbnail:
        assert thumbnail.width > 500
        assert np.ptp(np.asarray(thumbnail.convert("L"))) > 200
    if lives_in_a_page(name):
        assert len(text.encode()) < 300_000
        return
    assert "<details open" not in text
    assert len(text) < 2_500_000
    for each in module_of(name).EXPERIMENTS:
        assert f'id="film-{each.name}"' in text
        assert (page.parent / f"{each.name}.csv").stat().st_size > 100
