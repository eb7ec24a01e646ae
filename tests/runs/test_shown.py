"""Results in a notebook: they show themselves, go to tables and files and come back, and have states between outputs."""

import json
import pickle
from dataclasses import replace

import numpy as np
import pytest
from refusals import refused

import daebench
from daebench.errors import BadInput
from daebench.runs.interpolant import Interpolant
from daebench.runs.result import Result


@pytest.fixture(scope="module")
def swing():
    run = daebench.run("planar_pendulum", case="horizontal", method="rattle", h=0.02, t_end=2, raw=True)
    by_gravity, by_start = np.random.default_rng(1).normal(size=(2, 101, 2)), np.random.default_rng(2).normal(size=(2, 101, 2, 2))
    derivatives = {"gravity": dict(zip("qp", by_gravity, strict=True)), "q0": dict(zip("qp", by_start, strict=True))}
    return replace(run, sensitivities=derivatives)  # any numbers: to differentiate a run takes a kernel of its own


@pytest.fixture(scope="module")
def orbit():
    return daebench.run("lotka_volterra", case="6,2", method="strang", h=0.1, t_end=2)


def test_a_run_shows_what_was_run_how_far_it_came_and_its_picture(swing):
    html = swing._repr_html_()
    for words in ("planar_pendulum", "rattle", "largest error of energy", "data:image/png;base64,", "<td"):
        assert words in html


def test_results_of_studies_and_pictures_show_themselves():
    assert "frequencies" in daebench.modes("planar_pendulum", methods=["rattle"])._repr_html_()
    members = daebench.ensemble("planar_pendulum", method="rattle", members=8, h=0.05, t_end=1)
    assert "data:image/png" in members._repr_html_()
    assert members.plot()._repr_html_().startswith("<img")


def test_a_run_that_stopped_says_why_and_its_markup_is_escaped():
    stopped = daebench.run("spherical_pendulum", case="fig1.2", method="se", h=0.01, t_end=10)
    assert "did not converge" in stopped._repr_html_()

    class Odd(Result):
        def summary(self):
            return {"name": "<script>alert(1)</script>"}

        def plot(self):
            raise BadInput("nothing <b>to</b> draw.")

    html = Odd()._repr_html_()
    assert "<script" not in html
    assert "&lt;b&gt;" in html


def test_a_picture_has_the_motion_and_the_largest_errors_of_thinned_curves(swing):
    motion, errors = swing.plot().axes
    assert motion.lines
    energy = next(line for line in errors.lines if line.get_label() == "|energy error|")
    assert np.max(energy.get_ydata()) == pytest.approx(swing.maxima["energy"], rel=1e-12)


@pytest.mark.parametrize("run", ["swing", "orbit"])
def test_a_saved_run_comes_back_with_all_it_had(run, request, tmp_path):
    run = request.getfixturevalue(run)
    assert run.save(tmp_path / "run.npz") == [tmp_path / "run.npz"]
    again = daebench.load(tmp_path / "run.npz")
    assert again.about() == json.loads(json.dumps(run.about()))
    assert again.to_frame().equals(run.to_frame())
    assert again.ivp.facts.FINGERPRINT == run.ivp.facts.FINGERPRINT
    assert {k: v[1].tolist() for k, v in again.stage_multipliers.items()} == {k: v[1].tolist() for k, v in run.stage_multipliers.items()}


def test_a_copy_in_another_process_has_its_numbers_and_no_functions(swing):
    copy = pickle.loads(pickle.dumps(swing))
    assert copy.to_frame().equals(swing.to_frame())
    with pytest.raises(BadInput, match="without the functions of planar_pendulum"):
        copy.plot()


def test_files_that_are_no_runs_are_named(swing, tmp_path):
    swing.save(tmp_path / "run.npz")
    content = (tmp_path / "run.npz").read_bytes()
    (tmp_path / "cut.npz").write_bytes(content[: len(content) // 2])
    np.savez(tmp_path / "other.npz", t=np.zeros(3))
    np.savez(tmp_path / "objects.npz", about=np.array([object()]))
    arrays = dict(np.load(tmp_path / "run.npz"))
    np.savez(tmp_path / "short.npz", **arrays | {"q": arrays["q"][:-1]})
    for name in ("cut", "other", "objects", "short", "none"):
        with pytest.raises(BadInput, match=name):
            daebench.load(tmp_path / f"{name}.npz")
    for place, code in (("run.txt", "save-file-ending"), ("nowhere/run.npz", "save-no-such-folder")):
        with refused(code):
            swing.save(tmp_path / place)


def test_a_run_of_other_equations_is_not_given_the_problem_of_that_name(swing, tmp_path):
    swing.save(tmp_path / "run.npz")
    arrays = dict(np.load(tmp_path / "run.npz"))
    about = json.loads(str(arrays["about"])) | {"definition": "0" * 64}
    np.savez(tmp_path / "older.npz", **arrays | {"about": np.array(json.dumps(about))})
    assert daebench.load(tmp_path / "older.npz").ivp is None
    with pytest.raises(BadInput, match="other equations"):
        daebench.load(tmp_path / "older.npz", problem="planar_pendulum")


def test_a_dataset_has_states_over_time_and_what_was_run(swing, orbit):
    data = swing.to_xarray()
    assert data["q"].dims == ("t", "q_component")
    assert data["dq_dq0"].shape == (101, 2, 2)
    assert data.attrs["method"] == "rattle"
    assert float(orbit.to_xarray()["y"].sel(t=2.0, method="nearest")[0]) == orbit.y[-1, 0]


@pytest.mark.parametrize(("outputs", "degree"), [(201, 5), (6, 5), (5, 3), (4, 3), (3, 1), (2, 1)])
def test_states_between_outputs_are_as_far_off_as_is_said(outputs, degree):
    t, fine = np.linspace(0, 2, outputs), np.linspace(0, 2, 4001)
    sol = Interpolant(t, {"q": np.stack([np.cos(t), np.sin(3 * t)], axis=1)})
    true = np.max(np.abs(sol(fine)["q"] - np.stack([np.cos(fine), np.sin(3 * fine)], axis=1)))
    assert sol._splines["q"].k == degree
    if outputs > 100:
        assert true / 10 < sol.error < 10 * true
    assert sol(2.0)["q"].shape == (2,)


def test_times_outside_of_a_run_and_runs_of_one_state_are_refused(swing):
    for times in ([0.1, 2.5], float("nan")):
        with refused("time-outside-run"):
            swing.sol(times)
    with pytest.raises(BadInput):
        Interpolant(np.zeros(1), {"q": np.zeros((1, 2))})
