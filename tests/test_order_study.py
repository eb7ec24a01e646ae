"""Orders of methods, measured: the reference, the ladder of step sizes, what is fitted, and the command."""

import json
import math
import sys
from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import definitions
import numpy as np
import pandas as pd
import pytest
import sympy as sp
import uncompiled
from scenes import scene
from scipy.integrate import solve_ivp

import daebench.pose
from daebench.cli import main
from daebench.errors import BadInput, RunFailed
from daebench.fixed_step import FixedStep
from daebench.names import several
from daebench.order_bench import Bench
from daebench.order_figure import write
from daebench.order_ladder import COMMON, ladder
from daebench.order_study import order, study
from daebench.scene import make_scene, source_of
from daebench.truth import EPS, integrated, multipliers_between, reach, truth

TIMES = np.arange(1, 9) / 4
COMMAND = ("order", "planar_pendulum", "--case", "rotating", "--methods", "rattle")
plain = partial(FixedStep, compiled=False)


@pytest.fixture(autouse=True)
def no_compiler(monkeypatch):
    """Integrate the references by uncompiled functions."""
    monkeypatch.setattr(daebench.pose, "_module", uncompiled.kept_module)


@pytest.fixture(scope="module")
def rattle_on_planar():
    """Three series and those of raw multipliers on a problem with a closed form: h = 1/32 ... 1/512."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(daebench.pose, "_module", uncompiled.kept_module)
        return study(scene("planar"), [plain("rattle")], t_end=1.0, h=1 / 32, halvings=4)


@pytest.fixture
def daebench_(monkeypatch, capsys):
    """Run the command line in this process, uncompiled; return exit status, standard output and standard error."""

    def uncompiled_methods(methods, options=None):
        return [replace(each, compiled=False) if isinstance(each, FixedStep) else each for each in several(methods, options)]

    monkeypatch.setattr("daebench.order_study.several", uncompiled_methods)

    def call(*words):
        monkeypatch.setattr(sys, "argv", ["daebench", *map(str, words)])
        with pytest.raises(SystemExit) as stop:
            main()
        printed = capsys.readouterr()
        return stop.value.code, printed.out, printed.err

    return call


def by_component(found):
    return {series.component: series for series in found.series}


def double_pendulum_in_angles(times):
    """States of ``definitions.double_pendulum``, case bent, from its equations in angles: no constraint, no multiplier."""

    def field(_, y):
        a, b, da, db = y
        mass = np.array([[3, 2 * np.cos(a - b)], [2 * np.cos(a - b), 2]])
        force = [-2 * db**2 * np.sin(a - b) - 3 * np.sin(a), 2 * da**2 * np.sin(a - b) - 2 * np.sin(b)]
        return [da, db, *np.linalg.solve(mass, force)]

    a, b, da, db = solve_ivp(field, (0, times[-1]), [0, np.pi / 2, 1, 0.75], "DOP853", times, rtol=1e-13, atol=1e-14, max_step=0.01).y
    q = np.array([np.sin(a), -np.cos(a), np.sin(a) + np.sin(b), -np.cos(a) - np.cos(b)])
    v = np.array([da * np.cos(a), da * np.sin(a), da * np.cos(a) + db * np.cos(b), da * np.sin(a) + db * np.sin(b)])
    return q.T, v.T * [1, 1, 2, 2]


# ---- reference -----------------------------------------------------------------------------------------------------------


def test_both_kinds_of_reference_agree_within_the_bound_of_the_worse():
    exact, steps = truth(scene("planar"), TIMES), integrated(scene("planar"), TIMES)
    assert (exact.kind, steps.kind) == ("closed form", "DOP853")
    for name in ("q", "p", "lam"):
        difference = np.linalg.norm(getattr(exact, name) - getattr(steps, name), axis=1)
        assert np.max(difference) <= steps.bound[name] < 1e-8
        assert exact.bound[name] < 1e-14


def test_the_reference_is_the_motion_in_angles():
    found = truth(scene("double-pendulum"), TIMES)
    q, p = double_pendulum_in_angles(TIMES)
    assert found.kind == "DOP853"
    assert 0 < np.max(np.linalg.norm(found.q - q, axis=1)) <= found.bound["q"] < 1e-10
    assert np.max(np.linalg.norm(found.p - p, axis=1)) <= found.bound["p"] < 1e-9


def test_multipliers_between_known_times_are_those_of_the_motion_itself():
    fine = np.arange(1, 33) / 16
    known, all_ = truth(scene("planar"), fine[3::4]), truth(scene("planar"), fine)
    times = [0.0, 1.0, *fine[[30, 0, 17, 5]]]
    lam, bound = multipliers_between(scene("planar"), known, times)
    assert np.max(np.abs(lam[1:, 0] - all_.lam[[15, 30, 0, 17, 5], 0])) <= bound < 1e-10
    q, p = scene("planar").q0, scene("planar").p0
    assert lam[0, 0] == pytest.approx((p @ p - q[1]) / 2, rel=1e-14)


def test_a_reference_that_breaks_down_is_an_error_that_says_when():
    q = sp.symbols("q1:3", real=True)
    sheet = replace(definitions.stretched(), M=sp.eye(2), U=1 / (q[0] - sp.Rational(1, 5)), cases={}, parameters={})
    bad = make_scene(source_of(sheet, "pole"), "", p0=[1.0, 0.0], q0=_lowest(sheet))
    with pytest.raises(RunFailed, match=r"the reference solution of pole, case , stopped at t = .*; choose a shorter end time"):
        truth(bad, [50.0])


def _lowest(sheet):
    case = definitions.stretched().cases["swing"]
    return [float(x) for x in case.q]


def test_the_default_end_time_follows_the_motion():
    slow, fast = (reach(scene(name), 64) for name in ("spherical-slow", "spherical-fast"))
    assert 5 * fast < slow < 20 * fast
    assert study(scene("spherical-fast"), [plain("rattle")], h=1 / 32, halvings=2).t_end == 4.0


# ---- step sizes ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("claimed", range(1, 11), ids=str)
def test_every_ladder_begins_coarse_has_many_steps_and_never_one_twice(claimed):
    counts = ladder(1.0, claimed)
    assert counts == sorted(set(counts))
    assert len(counts) >= 11
    assert claimed < 3 or counts[0] == 1
    assert claimed < 5 or {3, 5, 7} < set(counts)


def test_given_step_sizes_are_halved_and_no_others_are_taken():
    assert ladder(2.0, 8, 0.1, 3) == [3, 6, 12, 24]
    assert ladder(2.0, 1, 0.25, 2) == [1, 2, 4]


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"t_end": 0.0}, "t_end = 0 must be greater than 0"),
        ({"t_end": -1.0}, "t_end = -1 must be greater than 0"),
        ({"t_end": math.nan}, "must be a finite number"),
        ({"t_end": 1.0, "halvings": 1}, "halvings = 1 must be at least 2"),
        ({"t_end": 1.0, "halvings": 2.5}, "halvings = 2.5 must be a whole number"),
        ({"t_end": 1.0, "halvings": 40}, "makes more than 2"),
        ({"t_end": 1.0, "h": -0.1}, "h = -0.1 must be greater than 0"),
        ({"t_end": 1.0, "h": 1e-300}, "makes more than 2"),
        ({"t_end": 1.0, "h": 0.2}, r"h = 0.2 is larger than t_end/8 = 0.125.*give a smaller h or a larger end time"),
    ],
    ids=str,
)
def test_numbers_out_of_range_are_refused(settings, says):
    with pytest.raises(BadInput, match=says):
        study(scene("planar"), [plain("rattle")], **settings)


@pytest.mark.parametrize(
    ("methods", "says"),
    [
        (["rattel"], "unknown method 'rattel'; did you mean rattle"),
        (["rattle", "ida:index2"], "ida:index2 chooses its own steps.*give a fixed-step method, for example rattle"),
        ([], "at least one method"),
    ],
    ids=["unknown", "tolerance-driven", "none"],
)
def test_methods_without_an_order_are_refused(methods, says):
    with pytest.raises(BadInput, match=says):
        order("planar_pendulum", methods=methods)


def test_a_method_that_refuses_the_problem_is_refused_before_any_run():
    with pytest.raises(BadInput, match="shake needs H = "):
        study(scene("stretched-M"), [plain("rattle"), plain("shake")], t_end=1.0, halvings=2)


# ---- orders --------------------------------------------------------------------------------------------------------------


def test_rattle_has_order_two_and_its_multipliers_order_one_each_and_two_in_the_mean(rattle_on_planar):
    found = by_component(rattle_on_planar)
    assert list(found) == ["q", "p", "lam", "lam_n", "mu_n", "mean"]
    for name, expected in {"q": 2, "p": 2, "lam": 2, "lam_n": 1, "mu_n": 1, "mean": 2}.items():
        assert abs(found[name].fit.slope - expected) < 0.1, name
        assert all(found[name].fit.used), name
    assert [found[name].claimed for name in found] == [2, 2, 2, None, None, None]


def test_errors_are_the_largest_over_the_common_times_in_the_euclidean_norm(rattle_on_planar):
    series = by_component(rattle_on_planar)
    point = series["q"].points[1]
    assert (point.h, point.steps) == (1 / 64, 64)
    q, p = _rattle_by_hand(scene("planar"), point.h, point.steps)
    exact = truth(scene("planar"), np.arange(1, COMMON + 1) / COMMON)
    assert point.errors["q"] == pytest.approx(np.max(np.linalg.norm(q - exact.q, axis=1)), rel=1e-9)
    assert point.errors["p"] == pytest.approx(np.max(np.linalg.norm(p - exact.p, axis=1)), rel=1e-9)
    lam = (np.sum(p**2, axis=1) - q[:, 1]) / (2 * np.sum(q**2, axis=1))
    assert point.errors["lam"] == pytest.approx(np.max(np.abs(lam - exact.lam[:, 0])), rel=1e-9)


def _rattle_by_hand(pendulum, h, steps):
    """RATTLE on the unit circle: the multiplier of a step is the root of a quadratic. States at the common times."""
    q, p, kept = pendulum.q0, pendulum.p0, []
    weight = np.array([0.0, 1.0])
    for k in range(steps):
        free = q + h * (p - h / 2 * weight)
        # |free - x q|^2 = 1 for x = h^2 lam, the smaller root
        x = free @ q - math.sqrt((free @ q) ** 2 - free @ free + 1)
        p_half, q = p - h / 2 * weight - x / h * q, free - x * q
        p = p_half - h / 2 * weight
        p = p - (p @ q) * q
        if (k + 1) % (steps // COMMON) == 0:
            kept.append((q, p))
    return tuple(np.array(part) for part in zip(*kept, strict=True))


def test_the_order_is_found_without_a_closed_form():
    found = study(scene("double-pendulum"), [plain("rattle"), plain("symplectic_euler")], t_end=1.0, h=1 / 64, halvings=4)
    slopes = {(series.method, series.component): series.fit.slope for series in found.series}
    for name in ("q", "p", "lam"):
        assert abs(slopes["rattle", name] - 2) < 0.1
        assert not slopes["symplectic_euler", name] > 1.3
    assert found.truth.kind == "DOP853"


def test_an_order_that_looks_like_two_at_large_steps_is_found_to_be_one_or_not_at_all():
    # three halvings from h = 1/32: the errors of q and p fall by factors from 4 to 9 each time
    coarse = by_component(study(scene("spherical-fast"), [plain("symplectic_euler")], t_end=1.0, h=1 / 32, halvings=3))
    for name in ("q", "p"):
        errors = coarse[name].errors
        assert errors[0] > 50 * errors[-1]
        assert math.isnan(coarse[name].fit.slope)
        assert coarse[name].fit.note


@pytest.mark.slow
def test_symplectic_euler_has_order_one_where_it_looks_like_two():
    found = study(scene("spherical-fast"), ["symplectic_euler"])
    for series in found.series[:3]:
        assert abs(series.fit.slope - 1) < 0.06
        assert sum(series.fit.used) >= 8


HIGH_ORDERS = {"rattle/suzuki4": 4, "rattle/yoshida6": 6, "rattle/kahan_li8": 8, "rattle/sofroniou_spaletta10": 10}
# a reference by DOP853 is not good enough for order 10: too few points are left
FOUND = [(case, name) for case in ("spherical-slow", "spherical-fast", "planar", "stretched-M") for name in HIGH_ORDERS]
FOUND.remove(("stretched-M", "rattle/sofroniou_spaletta10"))


@pytest.mark.slow
@pytest.mark.parametrize(("case", "name"), FOUND, ids=[f"{case}-{name}" for case, name in FOUND])
def test_high_orders_are_found_with_the_default_step_sizes(case, name):
    found, claimed = study(scene(case), [name]), HIGH_ORDERS[name]
    for series in found.series:
        assert series.claimed == claimed
        assert abs(series.fit.slope - claimed) < 0.3, series


def test_steps_that_fail_are_points_that_failed():
    found = study(scene("spherical-fast"), [plain("rattle")], t_end=8.0, h=1.0, halvings=6)
    for series in found.series:
        assert series.fit.reasons[0] == "failed"
        assert math.isnan(series.errors[0])
        assert "rattle on spherical_pendulum, case fig1.2b, stopped at t = 0" in series.points[0].failure
        assert series.reasons.startswith("1 failed") or "failed" in series.dropped
    rows = found.points()
    assert rows[rows["reason"] == "failed"]["failure"].str.startswith("rattle on").all()


def test_a_method_that_fails_at_every_step_size_has_its_rows():
    found = study(scene("spherical-fast"), [plain("rattle")], t_end=32.0, h=4.0, halvings=2)
    assert [series.component for series in found.series] == ["q", "p", "lam"]
    assert [series.dropped for series in found.series] == [{"failed": 3}] * 3
    assert math.isnan(found.table()["order"].max())


def test_points_below_what_the_reference_is_good_for_are_round_off(monkeypatch):
    def vague(scene_, times):
        found = truth(scene_, times)
        return replace(found, kind="vague", bound={"q": 1e-3, "p": 1e-4, "lam": 1e-9})

    monkeypatch.setattr("daebench.order_study.truth", vague)
    found = by_component(study(scene("planar"), [plain("rattle")], t_end=1.0, h=1 / 32, halvings=4))
    for name, bound in (("q", 1e-3), ("p", 1e-4)):
        assert found[name].floor == bound
        assert [reason == "round-off" for reason in found[name].fit.reasons] == [error <= bound for error in found[name].errors]
    assert any(reason == "round-off" for reason in found["q"].fit.reasons)
    assert all(found["lam"].fit.used)


def test_refinement_ends_at_round_off():
    found = by_component(study(scene("planar"), [plain("rattle", composition="kahan_li8")], t_end=4.0))
    assert len(found["q"].points) < len(ladder(4.0, 8))
    assert found["q"].errors[-1] < 1000 * EPS
    assert found["q"].dropped["round-off"] >= 2
    assert abs(found["q"].fit.slope - 8) < 0.3


def test_multipliers_inside_of_a_step_are_taken_where_steps_begin_at_common_times():
    n, times = 4, np.arange(1, COMMON + 1) / COMMON
    pendulum, h = scene("planar"), 1 / 32
    inside = (np.arange(COMMON * n) + 0.3) * h
    values = truth(pendulum, inside).lam.copy()
    values[::n] += 1e-3
    values[1::n] += 1.0
    values[3 * n] += 2e-3
    run = SimpleNamespace(raw={"lam_1": (inside, values)}, value=h)
    errors, bound = Bench(pendulum, plain("rattle"), truth(pendulum, times))._raw_errors(run, n)
    assert errors == {"lam_1": pytest.approx(3e-3, abs=bound)}
    assert bound < 1e-10


def test_the_second_multiplier_of_ggl_is_held_against_zero():
    found = by_component(study(scene("planar"), [plain("radau2_ggl")], t_end=1.0, h=1 / 16, halvings=4))
    assert abs(found["mu_2"].fit.slope - 2) < 0.1


def test_what_converges_to_something_else_is_no_round_off():
    soft = FixedStep("gauss2", form="stiff", options={"eps": 0.05}, compiled=False)
    found = by_component(study(scene("planar"), [soft], t_end=1.0, h=1 / 128, halvings=3))
    assert found["q"].dropped == {"plateau": 4}
    assert "not to 0" in found["q"].fit.note


def test_the_python_interface_gives_the_table():
    table = order("planar_pendulum", case="rotating", methods=[plain("rattle")], t_end=1.0, h=1 / 32, halvings=2)
    assert list(table.columns) == ["method", "component", "claimed", "order", "order_error", "used", "points", "dropped", "note"]
    assert table["claimed"].tolist()[:3] == [2, 2, 2]
    assert table["claimed"].isna().tolist() == [False] * 3 + [True] * 3
    assert (table["points"] == 3).all()


# ---- picture and command -------------------------------------------------------------------------------------------------


def test_picture_and_tables_are_written(rattle_on_planar, tmp_path):
    assert write(tmp_path, rattle_on_planar) == [tmp_path / "orders.csv", tmp_path / "order.svg"]
    assert (tmp_path / "order.png").read_bytes()[:4] == b"\x89PNG"
    assert "<svg" in (tmp_path / "order.svg").read_text(encoding="utf-8")
    rows, fits = pd.read_csv(tmp_path / "order.csv"), pd.read_csv(tmp_path / "orders.csv")
    assert len(rows) == 30
    assert list(rows.columns) == ["method", "component", "h", "steps", "error", "used", "reason", "failure"]
    assert fits["order"].tolist() == pytest.approx([series.fit.slope for series in rattle_on_planar.series], rel=1e-10)


def test_a_picture_of_nothing_but_failures_is_drawn(tmp_path):
    write(tmp_path, study(scene("spherical-fast"), [plain("rattle")], t_end=32.0, h=4.0, halvings=2))
    assert (tmp_path / "order.png").stat().st_size > 10000


def test_the_command_prints_a_row_for_each_component_and_writes_its_files(daebench_, tmp_path):
    status, out, err = daebench_(*COMMAND, "--t-end", 1, "--h", 0.03125, "--halvings", 4, "--out", tmp_path / "deep" / "er")
    assert (status, err) == (0, "")
    assert [line.split()[1] for line in out.splitlines() if line.startswith(" rattle")] == ["q", "p", "lam", "lam_n", "mu_n", "mean"]
    assert "5/5" in out
    assert "t = T k/8" in out
    assert {path.name for path in (tmp_path / "deep" / "er").iterdir()} == {"orders.csv", "order.csv", "order.svg", "order.png"}


def test_the_command_gives_everything_as_one_json_object(daebench_):
    status, out, err = daebench_(*COMMAND, "--t-end", 4, "--h", 0.5, "--halvings", 6, "--param", "gravity=3", "--json")
    found = json.loads(out)
    assert (status, err) == (0, "")
    assert found["parameters"]["gravity"] == 3
    assert found["times"] == [0.5 * k for k in range(1, 9)]
    assert found["reference"]["kind"] == "closed form"
    series = found["series"][0]
    assert (series["method"], series["component"], series["claimed"], len(series["points"])) == ("rattle", "q", 2, 7)
    for point in series["points"]:
        assert point["steps"] * point["h"] == 4
        assert point["used"] == (point["reason"] == "")
        assert (point["error"] is None) == (point["reason"] == "failed") == bool(point["failure"])
    assert abs(series["order"] - 2) < 0.1


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["--methods", "rattel"], "unknown method 'rattel'"),
        (["--methods", "ida:index1"], "ida:index1 chooses its own steps"),
        (["--methods", ","], "--methods names no method"),
        (["--t-end", "0"], "t_end = 0 must be greater than 0"),
        (["--halvings", "1", "--t-end", "1"], "halvings = 1 must be at least 2"),
        (["--case", "none"], "unknown case"),
        (["--param", "gravity"], "must be of the form name=value"),
        (["--out", "/dev/null/there"], "cannot write to that folder"),
    ],
    ids=lambda x: " ".join(x) if isinstance(x, list) else "",
)
def test_the_command_refuses_in_one_sentence(daebench_, words, says):
    status, out, err = daebench_(*COMMAND, *words)
    assert (status, out) == (2, "")
    assert says in err
    assert len(err.splitlines()) == 1


def test_the_command_exits_with_1_where_nothing_could_be_run(daebench_):
    status, out, _ = daebench_("order", "spherical_pendulum", "--case", "fig1.2b", *COMMAND[4:], "--t-end", 32, "--h", 4, "--halvings", 2)
    assert status == 1
    assert "3 failed" in out
    assert "rattle on spherical_pendulum, case fig1.2b, stopped at t = 0" in out
