"""Animations: what is shown is what was run, to scale, and nothing is hidden between two frames."""

import base64
import json
import re
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from own_files import RING
from refusals import refused

from daebench import animation
from daebench.draw.scene import layout_of
from daebench.errors import InvalidProblem
from daebench.methods.catalogue import find_problem, problems
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.fixed_step.poisson import PoissonStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.pages.animation import film, page, smil
from daebench.pages.animation.animated_runs import AnimatedRuns
from daebench.pages.animation.raster import frames
from daebench.pages.animation.recorded_run import RecordedRun, recorded_run
from daebench.runs.request import Request
from daebench.systems.picture import Picture

SVG = "{http://www.w3.org/2000/svg}"
NAME = "planar_pendulum"
TIMES = np.linspace(0, 2, 21)
H = 0.01


def quiet(fraction):
    assert 0 <= fraction <= 1


def plain(name):
    return FixedStep(name, compiled=False)


@pytest.fixture(scope="module")
def ivp():
    return initial_value_problem(NAME)


@pytest.fixture(scope="module")
def animated(ivp):
    runs = [recorded_run(ivp, plain(name), H, TIMES, quiet) for name in ("se", "rattle")]
    return AnimatedRuns(ivp.problem, ivp.case, ivp.parameters, layout_of(ivp), runs, TIMES, 0.8)


@pytest.fixture(scope="module")
def whole(ivp):
    """Every step of RATTLE."""
    return plain("rattle").solve(ivp, Request(value=H, steps=200, watch=()))


@pytest.fixture(scope="module")
def written(animated, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "pendulum.html"
    page.write(path, animated)
    return path.read_text(encoding="utf-8")


def energy_errors(run):
    energy = (run.p**2).sum(axis=1) / 2 + run.q[:, 1]
    return np.abs(energy - energy[0])


def largest_between(values, step):
    """Return the first value, and the largest of each number of steps after it."""
    return [values[0], *values[1:].reshape(-1, step).max(axis=1)]


# ---- takes -----------------------------------------------------------------------------------------------------------------


def test_what_is_shown_are_states_of_the_run(animated, whole):
    shown = animated.runs[1]
    assert np.array_equal(shown.t, np.arange(21) * 10 * H)
    assert np.array_equal(shown.states, whole.q[::10])
    assert np.array_equal(shown.shown(TIMES), np.arange(21))


def test_no_error_between_two_frames_is_hidden(animated, whole):
    every, g = energy_errors(whole), np.abs((whole.q**2).sum(axis=1) - 1)
    shown = animated.runs[1].errors
    assert shown["energy_error"] == pytest.approx(largest_between(every, 10), abs=1e-15)
    assert every[::10].max() < every.max()
    assert shown["g"] == pytest.approx(largest_between(g, 10), abs=5e-16)


# ---- the picture -----------------------------------------------------------------------------------------------------------


def test_the_scale_is_that_of_the_others_where_one_runs_away(animated):
    wild = replace(animated.runs[0], states=100 * animated.runs[0].states)
    both = replace(animated, runs=[wild, animated.runs[1]])
    assert (both.leaves(0), both.leaves(1)) == (True, False)
    assert both.box[0].high - both.box[0].low < 5


def test_a_picture_that_makes_no_sense_is_refused(ivp):
    definition = ivp.source.define()
    x, y = definition.q
    for picture, code in (
        (Picture(masses=[(x, y, 0)], fixed=[(0, 0)]), "picture-points-mixed"),
        (Picture(), "picture-points-mixed"),
        (Picture(masses=[(x, y)], axes=("x",)), "picture-axes-count"),
        (Picture(masses=[(x, definition.p[0])]), "picture-symbol-undeclared"),
    ):
        with refused(code, InvalidProblem):
            layout_of(initial_value_problem(replace(definition, picture=picture)))


def test_the_vector_of_a_rigid_body_is_on_the_sphere_that_is_drawn():
    body = initial_value_problem("free_rigid_body", "middle")
    layout = layout_of(body)
    assert np.linalg.norm(layout.at(body.y0[None])[0, layout.masses[0]]) == pytest.approx(1, abs=1e-15)
    assert np.linalg.norm(layout.surface, axis=-1) == pytest.approx(np.ones(layout.surface.shape[:2]), abs=1e-15)
    found = recorded_run(body, PoissonStep("strang", compiled=False), 0.5, np.linspace(0, 10, 11), quiet)
    assert set(found.errors) == {"energy_error", "casimir_error"}
    assert found.errors["casimir_error"].max() < 1e-14 < found.errors["energy_error"].max()


@pytest.mark.slow
def test_every_problem_of_the_catalogue_has_a_picture():
    assert [name for name in problems() if find_problem(name).define().picture is None] == []


# ---- the page --------------------------------------------------------------------------------------------------------------


def decoded(text, k, name):
    given = json.loads(re.search(r'id="data">(.*?)</script>', text, re.DOTALL)[1])
    return given, np.frombuffer(base64.b64decode(given["runs"][k][name]), "<i2")


def data_of(text, k, pixels):
    """Return what is at pixels of a panel, by nothing but the attributes that it has."""
    panels = re.findall(r'class="panel" data-frame="([^"]+)" data-x="([^"]+)" data-y="([^"]+)"', text)
    frame, x, y = (np.array(each.split(), dtype=float) for each in panels[k])
    across, down = np.moveaxis((pixels - frame[:2]) / frame[2:], -1, 0)
    return np.stack([x[0] + across * (x[1] - x[0]), y[1] - down * (y[1] - y[0])], axis=-1)


def test_the_page_shows_the_points_where_they_are(written, animated, whole):
    given, values = decoded(written, 1, "points")
    found = data_of(written, 1, values.reshape(-1, given["points"], 2) / given["scale"])[:, animated.layout.masses[0]]
    assert found == pytest.approx(whole.q[::10], abs=1e-3)
    assert decoded(written, 1, "shown")[1].tolist() == list(range(21))


def test_a_page_of_many_points_stays_below_two_megabytes(animated, tmp_path):
    points, methods = 102, 3
    n = page.most_frames(points, methods, 4)
    assert n > 200
    rng = np.random.default_rng(3)
    times = np.linspace(0, 1, n)
    errors = dict.fromkeys(("energy_error", "g", "Gv"), 10 ** rng.uniform(-16, 0, n))
    runs = [RecordedRun(name, "h", 0.1, times, rng.normal(size=(n, points, 2)), errors, "steps", None) for name in ("a", "b", "c")]
    rod = list(range(points))
    layout = replace(animated.layout, rods=[rod], masses=rod[-3:], fixed=[0], at=lambda states: states)
    path = tmp_path / "large.html"
    page.write(path, AnimatedRuns("p", "c", {}, layout, runs, times, 12.0))
    assert 1e6 < path.stat().st_size < 2e6


# ---- drawings, GIFs and films ----------------------------------------------------------------------------------------------


def test_the_drawing_moves_through_all_frames_and_is_the_same_bytes_again(animated, whole, tmp_path):
    for name in ("a.svg", "b.svg"):
        smil.write(tmp_path / name, animated)
    text = (tmp_path / "a.svg").read_text(encoding="utf-8")
    assert text == (tmp_path / "b.svg").read_text(encoding="utf-8")
    assert "<script" not in text
    (_, masses) = (each for each in ET.fromstring(text).iter(f"{SVG}path") if each.get("class") == "masses")
    values = masses.find(f"{SVG}animate").get("values").split(";")
    pixels = np.array([re.findall(r"-?[\d.]+", value)[:2] for value in values], dtype=float)
    assert data_of(text, 1, pixels) == pytest.approx(whole.q[::10], abs=0.005)


def test_the_gif_has_all_frames_and_its_masses_move(animated, tmp_path):
    from PIL import Image

    film.write_gif(tmp_path / "a.gif", animated, quiet)
    with Image.open(tmp_path / "a.gif") as image:
        assert (image.n_frames, image.info["duration"]) == (21, 40)
        shown = []
        for n in (0, 10):
            image.seek(n)
            shown.append(np.asarray(image.convert("RGB"), dtype=int))
    assert np.abs(shown[0] - shown[1]).max() > 100
    assert (tmp_path / "a.gif").stat().st_size < 1e6


def test_pixels_show_the_rod_from_the_pivot_to_the_mass(animated, whole):
    pictures = np.array(list(frames(animated)))
    _, height, width, _ = pictures.shape
    assert (height % 2, width % 2) == (0, 0)
    dark = pictures[:, : height // 2, width // 2 :].max(axis=3) < 60
    rod = dark & ~dark.all(axis=0)
    down, across = np.array([np.argwhere(each).mean(axis=0) for each in rod]).T
    x, y = whole.q[::10].T
    assert np.corrcoef(x, across)[0, 1] > 0.99
    assert np.corrcoef(-y, down)[0, 1] > 0.99
    assert np.polyfit(x, across, 1)[0] == pytest.approx(np.polyfit(-y, down, 1)[0], rel=0.1)


def test_a_film_for_slides_has_the_size_and_the_title_that_were_asked_for(animated):
    asked = replace(animated, size=(960, 540))
    plain_frame, titled_frame = (next(frames(replace(asked, title=title))).astype(int) for title in ("", "What the step keeps"))
    assert plain_frame.shape == titled_frame.shape == (540, 960, 3)
    ink = [int((each[:24, 400:560].min(axis=2) < 100).sum()) for each in (plain_frame, titled_frame)]
    assert ink[0] < 20 < 200 < ink[1]  # letters between the names of the methods, which stand above their scenes
    assert (titled_frame[-200:].min(axis=2) < 100).sum() > 1000  # the curves are there still


def test_the_film_has_all_frames(animated, tmp_path):
    ffmpeg = pytest.importorskip("imageio_ffmpeg", reason="no films: imageio-ffmpeg is not installed")
    film.write_video(tmp_path / "a.mp4", animated, quiet)
    count, seconds = ffmpeg.count_frames_and_secs(str(tmp_path / "a.mp4"))
    assert count == 21
    assert seconds == pytest.approx(0.84, abs=0.05)


def test_without_ffmpeg_a_film_is_refused(monkeypatch, tmp_path):
    monkeypatch.setattr(film, "find_spec", lambda name: None)
    with refused("video-needs-ffmpeg"):
        animation(NAME, methods=["rattle"], h=0.1, t_end=1, out=tmp_path / "a.mp4")
    assert list(tmp_path.iterdir()) == []


# ---- the command -----------------------------------------------------------------------------------------------------------


def test_the_command_writes_a_page_and_its_numbers(daebench, uncompiled_schemes, tmp_path):
    words = f"animate {NAME} --methods se,rattle --h 0.05 --t-end 2 --seconds 1 --fps 10 --out"
    assert daebench(*words.split(), tmp_path / "p.html")[0] == 0
    table = pd.read_csv(tmp_path / "p.frames.csv")
    assert list(table.columns) == ["method", "t", "energy_error", "g", "Gv", "x1", "y1"]
    assert table.groupby("method").size().to_dict() == {"rattle": 11, "se": 11}
    run = plain("rattle").solve(initial_value_problem(NAME), Request(value=0.05, steps=40, every=4, watch=()))
    assert table.query("method == 'rattle'")[["x1", "y1"]].to_numpy() == pytest.approx(run.q, abs=1e-11)


def test_a_run_that_stops_is_told_and_gives_exit_1(daebench, uncompiled_schemes, tmp_path):
    words = "animate slider_crank --case lock_up --methods rattle --h 0.01 --t-end 2 --out"
    status, told, _ = daebench(*words.split(), tmp_path / "p.html")
    assert (status, "t = 0.88" in told, "t = 0.88" in (tmp_path / "p.html").read_text(encoding="utf-8")) == (1, True, True)


def test_a_problem_of_ones_own_is_animated_by_its_picture(daebench, uncompiled_schemes, folder):
    text = RING.replace("import Case,", "import Picture, Case,").replace("closed_form=closed_form", "picture=Picture(masses=[q])")
    (folder / "ring.py").write_text(text)
    assert (
        daebench(*["animate", "ring.py", "--methods", "rattle", "--h", "0.1", "--t-end", "1", "--seconds", "1", "--out", "ring.svg"])[0]
        == 0
    )
    assert ET.parse(folder / "ring.svg").getroot().tag == f"{SVG}svg"


def test_of_a_method_that_chooses_its_steps_the_outputs_are_watched(ivp):
    run = plain("rattle").solve(ivp, Request(value=2 / 160, steps=160, watch=()))

    class Free:
        knob = "tol"
        outcome = run

        def solve(self, ivp, request):
            assert (request.points, request.t_end) == (161, 2.0)
            return self.outcome

    found = recorded_run(ivp, Free(), 1e-6, TIMES, quiet)
    assert found.over == "outputs"
    assert found.t == pytest.approx(TIMES)
    assert np.array_equal(found.states, run.q[::8])
    assert found.errors["energy_error"] == pytest.approx(largest_between(energy_errors(run), 8), abs=1e-15)


def test_a_point_that_is_nowhere_is_told_from_all_places(animated):
    lost = animated.runs[0].states.copy()
    lost[5] = np.nan
    both = replace(animated, runs=[replace(animated.runs[0], states=lost), animated.runs[1]])
    coded = page.places(both, 0)
    assert (coded[5, animated.layout.masses] == page.MISSING).all()
    assert (coded[[4, 6]] > page.MISSING).all()
    assert both.leaves(0)
