"""Work against precision over many starts: winners of families with known answers, intervals that cover, and a small real run."""

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from refusals import refused, require_refusals
from scipy.stats import binom

from daebench.methods import run as api
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.records.store import opened
from daebench.reference.solution import reference_solution
from daebench.runs.state import CONSTRAINED
from daebench.starts.draw import draw_starts
from daebench.studies.ensemble.references import bounds_of, member_references
from daebench.studies.grid.export import table_of
from daebench.studies.grid.measure import row_of
from daebench.studies.grid.runs import runs_of
from daebench.studies.grid.runs_together import members_of
from daebench.studies.grid.specification import specification_of
from daebench.studies.work_precision.figure import bands
from daebench.studies.work_precision.run import SLOW, without_slow
from daebench.studies.work_precision.starts import Curves, curves_of, output_times, runs_from_starts
from daebench.studies.work_precision.study import interpolated, standard
from daebench.studies.work_precision.winners import level_of, median, sentences, share, winners

H = 0.5 ** np.arange(14)


def family(method, prices, order=4, bound=1e-14, scatter=0.0):
    """Return curves whose error is h^order, at these prices a step, one for each start."""
    prices = np.asarray(prices, dtype=float)
    bounds = np.broadcast_to(bound, prices.shape)
    errors = np.maximum((H**order)[:, None] * np.ones(len(prices)), bounds)
    return Curves(method, "h", H, errors, prices / H[:, None], bounds, np.zeros(len(H), dtype=int), scatter)


def test_a_method_that_is_better_in_exactly_seventy_percent_of_the_starts_is_said_to_be():
    better = np.arange(1000) % 10 < 7
    table = winners([family("one", np.where(better, 1.0, 3.0)), family("two", np.full(1000, 2.0))], [1e-3, 1e-6])
    for row in table[table["method"] == "one"].itertuples():
        assert (row.before, row.cheapest, row.starts) == (0.7, 0.7, 1000)
        assert 0.66 < row.before_low < row.before_high < 0.74
        assert row.ratio == pytest.approx(2.0, rel=1e-12)
        assert row.price == pytest.approx(row.level**-0.25, rel=1e-12)  # h^4 = level at the price of one step over h
    assert sentences(table)[0].startswith("1e-3: one before two in 70 % of 1000 starts [67")


def test_the_winner_changes_with_the_accuracy_where_the_orders_differ():
    cheap, fine = family("cheap", np.ones(20), order=2), family("fine", np.full(20, 10.0), order=4)
    table = winners([cheap, fine], [1e-3, 1e-5])  # level^(-1/2) against 10 level^(-1/4): the same at 1e-4
    assert table.groupby("level", sort=False)["method"].first().tolist() == ["cheap", "fine"]
    assert table["before"].dropna().tolist() == [1.0, 1.0]


@pytest.mark.parametrize("n", [16, 1024])
@pytest.mark.parametrize("p", [0.5, 0.9])
def test_the_interval_of_a_share_covers_at_its_rate(n, p):
    wins = np.arange(n + 1)
    weights = binom.pmf(wins, n, p)
    intervals = {k: share(k, n) for k in wins[weights > 1e-9]}
    covered = sum(weights[k] for k, interval in intervals.items() if interval.low <= p <= interval.high)
    assert covered >= 0.95
    assert n < 1024 or covered <= 0.97


def test_winners_over_draws_of_starts_cover_the_share_of_all_starts():
    rng, covered, draws = np.random.default_rng(5), 0, 300
    other = family("two", np.full(60, 2.0))
    for _ in range(draws):
        first = winners([family("one", np.where(rng.random(60) < 0.7, 1.0, 3.0)), other], [1e-3]).set_index("method").loc["one"]
        covered += first["before_low"] <= 0.7 <= first["before_high"]
    assert 0.91 <= covered / draws <= 0.99


@pytest.mark.parametrize("n", [6, 200])
def test_the_interval_of_a_median_covers_at_its_rate(n):
    rng = np.random.default_rng(3)
    estimates = [median(rng.exponential(size=n)) for _ in range(1500)]
    covered = np.mean([estimate.low <= np.log(2) <= estimate.high for estimate in estimates])
    assert 0.94 <= covered <= 0.985


def test_starts_whose_reference_is_worse_than_the_accuracy_are_not_compared():
    bound = np.where(np.arange(10) < 4, 1e-5, 1e-12)
    curves = [family("one", np.ones(10), bound=bound), family("two", np.full(10, 2.0), bound=bound)]
    fine, coarse = (winners(curves, [level]).iloc[0] for level in (1e-6, 1e-3))
    assert (fine["starts"], fine["left_out"], coarse["starts"], coarse["left_out"]) == (6, 4, 10, 0)
    assert "4 starts are not compared" in sentences(winners(curves, [1e-6]))[-1]


def test_a_method_that_stops_early_does_not_reach_the_accuracy_and_loses():
    two = family("two", np.full(10, 2.0))
    broken = replace(family("stops", np.ones(10)), failed=np.full(len(H), 3))
    broken.errors[:, :3] = np.inf
    first = winners([broken, two], [1e-3]).set_index("method").loc["stops"]
    assert (first["before"], first["starts"]) == (0.7, 10)
    broken.errors[:, :6] = np.inf
    assert winners([broken, two], [1e-3])["method"].tolist() == ["two"]


def test_a_method_with_fewer_starts_is_compared_on_these_alone_and_others_on_all():
    curves = [family("solver", np.ones(8)), family("one", np.full(64, 2.0)), family("two", np.full(64, 3.0))]
    table = winners(curves, [1e-3])
    assert table["method"].tolist() == ["solver", "one", "two"]
    assert table["starts"].tolist()[:2] == [8, 64]
    assert set(table["of"]) == {8}


def test_a_factor_within_the_scatter_of_times_decides_nothing():
    near = [family("one", np.ones(50), scatter=0.1), family("two", np.full(50, 1.05))]
    far = [family("one", np.ones(50), scatter=0.1), family("two", np.full(50, 1.2))]
    assert "undecided, because times scatter by 10 %" in sentences(winners(near, [1e-3]))[0]
    assert "undecided" not in sentences(winners(far, [1e-3]))[0]


def test_runs_without_a_time_or_an_error_are_left_out_of_a_curve():
    errors = np.array([[1e-1, 1e-1], [np.nan, 1e-2], [1e-3, 1e-3]])
    costs = np.array([[1.0, 1.0], [2.0, np.nan], [4.0, 4.0]])
    prices, runs = interpolated(errors, costs, 1e-2)
    assert prices == pytest.approx([2.0, 2.0], rel=1e-12)  # half way in log error, half way in log cost
    assert runs.tolist() == [2, 2]
    assert interpolated(errors, costs, 1e-4)[0].tolist() == [np.inf, np.inf]


def test_errors_are_taken_at_common_multiples_of_the_step_sizes_to_which_the_end_is_moved():
    assert output_times([0.1, 0.025], 10.0) == (10.0, 50)
    assert output_times([0.1, 0.04], 1.0) == (1.0, 5)
    assert output_times([1 / 3, 1 / 6], 2.0) == (2.0, 6)
    assert output_times([], 3.0) == (3.0, 64)
    end, outputs = output_times([0.1], 10.1 + 0.05)
    assert end <= 10.15
    assert outputs <= 64
    assert end / outputs / 0.1 == pytest.approx(round(end / outputs / 0.1), abs=1e-9)


def closed_forms(members, t):
    """Return the exact states (p, q) of members, shape(k, n, c)."""
    rows = []
    for i in range(len(members)):
        exact = reference_solution(members.member(i), t[1:])
        assert exact.kind == "closed form"
        rows.append(np.concatenate([np.concatenate(members.member(i).start)[None], np.hstack([exact.states["p"], exact.states["q"]])]))
    return np.stack(rows, axis=1)


@pytest.mark.sampled(left_out=("planar_pendulum-rotating-heyoka", "spherical_pendulum-fig1.2-composition"))
@pytest.mark.parametrize("heyoka", [True, False], ids=["heyoka", "composition"])
@pytest.mark.parametrize(("problem", "case"), [("planar_pendulum", "rotating"), ("spherical_pendulum", "fig1.2")])
def test_references_are_within_their_bound_of_the_closed_form(problem, case, heyoka, monkeypatch):
    if heyoka:
        pytest.importorskip("heyoka", reason="heyoka, of the extra peers, is not installed")
    else:
        for place in ("methods.ensemble.heyoka_batches", "studies.ensemble.references"):
            monkeypatch.setattr(f"daebench.{place}.refusal", lambda members: "no")
    members = draw_starts(initial_value_problem(problem, case), members=8, h=1.0, size=0.1).members
    found = member_references(members, 4.0, 8, 1 / 64)
    off = np.abs(np.concatenate([found.states["p"], found.states["q"]], axis=2) - closed_forms(members, found.t)).max(axis=0)
    d = members.start[0].shape[1]
    for part, errors in (("p", off[:, :d]), ("q", off[:, d:])):
        assert (errors.max(axis=1) <= found.bound[part]).all()
        assert (found.bound[part] < 1e-9).all()
    assert found.words.startswith("heyoka in batches" if heyoka else "rattle/kahan_li8")


def test_a_bound_is_no_less_than_that_of_the_median_member_and_infinite_where_a_run_ended():
    used = np.zeros((3, 4, 2))
    other = used.copy()
    other[1] = np.array([[1e-9], [3e-9], [0.0], [np.nan]])
    assert bounds_of(used, other) == pytest.approx([1e-8, 3e-8, 1e-8, np.inf])
    assert np.isinf(bounds_of(used, np.full_like(used, np.nan))).all()


@pytest.fixture(scope="module")
def study():
    values = {"h": [1 / 8, 1 / 64], "tol": [1e-5]}
    return standard("planar_pendulum", case="rotating", methods=["rattle", "scipy:DOP853"], **values, t_end=2.0, repeat=1)[0]


def test_errors_of_members_are_those_of_their_own_runs(study):
    coarse, fine, solver = runs_from_starts(study, members=6, solver_members=2, settings={"size": 0.1}, seed=4)
    assert (coarse.count, fine.count, solver.count) == (6, 6, 2)
    for run in (coarse, solver):
        row, members = row_of(run), members_of(run)
        exact, d = closed_forms(members, np.linspace(0, run.t_end, run.outputs + 1)), members.start[0].shape[1]
        asked = {"tol": run.value, "points": run.outputs + 1}
        if run is coarse:
            asked = {"h": run.value, "every": round(run.t_end / run.outputs / run.value)}
        for i in range(run.count):
            alone = api.run(members.member(i), method=run.method, t_end=run.t_end, **asked).complete()
            off = np.max(np.abs(np.hstack([alone.p, alone.q]) - exact[:, i]), axis=0)
            assert row["error_q"][i] == pytest.approx(off[d:].max(), rel=1e-6)
            assert row["error_p"][i] == pytest.approx(off[:d].max(), rel=1e-6)
        assert row["failure"] == [""] * run.count
        assert np.all(np.array(row["seconds"]) > 0)
    assert np.array_equal(members_of(solver).start[1], members_of(coarse).start[1][:2])


def test_rows_are_kept_and_exported_a_row_a_start(study, tmp_path):
    specifications, told = runs_from_starts(study, members=4, solver_members=2), []
    with opened(tmp_path / "runs.db") as store:
        table = runs_of(store)(specifications)
        again = runs_of(store, tell=lambda *_: told.append(1))(specifications)
        flat = table_of(store)
    assert (told, again["error_q"].tolist()) == ([], table["error_q"].tolist())
    counts = {("rattle", 1 / 64): 4, ("rattle", 1 / 8): 4, ("scipy:DOP853", 1e-5): 2}
    assert flat.groupby(["method", "value"])["member"].count().to_dict() == counts
    assert [specification_of(specification.plain()) for specification in specifications] == specifications
    curves = curves_of(table, "error_q")
    assert [some.starts for some in curves] == [4, 2]
    quantiles = bands(curves).set_index(["method", "value"])
    assert quantiles.loc[("rattle", 1 / 8), "q50"] == np.sort(table["error_q"].iloc[0])[1]
    assert np.isfinite(level_of(curves, 1e-2).prices["rattle"]).all()


def test_the_command_says_who_is_cheapest_in_how_many_starts(daebench, tmp_path):
    asked = "--case rotating --methods rattle,rattle/suzuki4 --t-end 2 --h 0.125,0.03125,0.0078125 --repeat 1 --ensemble 6 --json"
    status, out, err = daebench("work-precision", "planar_pendulum", *asked.split(), "--out", tmp_path)
    said = json.loads(out)
    assert (status, err, said["members"], said["runs"], said["failed"]) == (0, "", 6, 36, 0)
    first = next(row for row in said["winners"] if row["level"] == 1e-3)
    assert first["starts"] == 6
    assert 0 <= first["before_low"] <= first["before"] <= first["before_high"] <= 1
    assert 0 < said["reference_error"]["median"] < 1e-10
    table = pd.read_csv(tmp_path / "work_precision_starts.csv")
    assert (table["q05"] <= table["q95"]).all()
    assert {"work_precision_starts.png", "work_precision_starts.svg", "winners.csv"} <= {file.name for file in tmp_path.iterdir()}


def test_solvers_in_python_are_left_out_unless_they_are_named():
    study, left_out = standard("planar_pendulum", case="rotating", repeat=1)
    kept = without_slow(study, left_out)
    assert "scipy:Radau" in study.methods
    assert set(study.methods) - set(kept.methods) == {name for name in SLOW if name in study.methods}
    assert "name it in --methods" in left_out["scipy:Radau"]


def test_what_cannot_be_is_refused_in_a_sentence(daebench, tmp_path):
    require_refusals(
        daebench,
        ("work-precision", "planar_pendulum", "--methods", "rattle", "--t-end", 2, "--out", tmp_path),
        ("option-of-many-starts", "--starts energy"),
        ("starts-not-positive", "--ensemble 0"),
        ("ranked-without-repeat", "--ensemble 4 --repeat 0"),
        ("column-of-one-start", "--ensemble 4 --error energy_error"),
        ("few-common-output-times", "--ensemble 4 --h 0.3,0.7"),
        ("setting-of-other-starts", "--ensemble 4 --box q1=0:1"),
        ("option-of-many-starts", "--seed 1 --solver-starts 8"),
    )


def test_of_no_use_is_an_ensemble_where_nothing_gives_references(monkeypatch):
    monkeypatch.setattr("daebench.studies.ensemble.references.refusal", lambda members: "heyoka is not there.")
    monkeypatch.setattr("daebench.studies.ensemble.references.COMPOSITIONS", {CONSTRAINED: ("rk4/kahan_li8",)})
    members = draw_starts(initial_value_problem("planar_pendulum"), members=2, h=1.0).members
    with refused("no-references-for-starts", says=("planar_pendulum",)):
        member_references(members, 1.0, 4, 0.1)
