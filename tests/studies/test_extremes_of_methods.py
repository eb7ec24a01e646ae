"""Methods driven to their extremes: what tables say that were made by hand, which extremes a problem has, and the command."""

import numpy as np
import pandas as pd
import pytest
from refusals import refused, require_refusals

from daebench.errors import Interrupted
from daebench.methods.fixed_step.reasons import ITS_OWN
from daebench.records.store import opened
from daebench.studies.grid.runs import runs_of
from daebench.studies.stability import lost_motion, outcome_map, parameter_range, penalty, round_off, step_limit
from daebench.studies.stability.extreme import Asked
from daebench.studies.stability.study import EXTREMES, chosen


def runs(method, values, **columns):
    """Return rows of one method with a column "failure"."""
    return pd.DataFrame({"method": method, "knob": "h", "value": values, "failure": ""} | columns)


def test_the_largest_step_is_said_of_the_method_that_has_it():
    table = pd.DataFrame(
        {
            "method": ["one", "one", "two", "two"],
            "verdict": ["completes", "keeps the energy"] * 2,
            "h": [0.5, 0.1, 2.0, 0.0],
            "fails": [0.6, 0.2, np.inf, 0.1],
            "why": [f"it stopped; use a smaller h; {ITS_OWN}.", "", "", ""],
            "gaps": [False, False, True, False],
        }
    )
    first, second, none, own, gaps = step_limit.says(table)
    assert own == "Of one this is the limit of the iteration, which omits derivatives, and not necessarily of the equations."
    assert first == "two completes with the largest steps, up to at least h = 2 s; the smallest limit is that of one, 0.5 s."
    assert second == "one keeps the energy with the largest steps, up to h = 0.1 s."
    assert none == "With no step that was tried keeps the energy: two."
    assert gaps.endswith("with two.")


def test_a_map_counts_what_is_fine():
    words, trends = ["fine", "fine", "lost", "lost", "blown up"], ["drifts", "bounded", "drifts", "drifts", ""]
    table = pd.DataFrame({"method": "one", "outcome": words, "trend": trends, "size": [1e-3, 3e-3, 2.0, 3.0, np.nan]})
    told = "2 of 5 runs are fine, with energy errors of 2.0e-03 of the kinetic energy in the median; 1 of them drift"
    assert outcome_map.says(table) == [f"one: {told}; most of the others: lost (2)."]
    none = outcome_map.says(table[table["outcome"] == "lost"])
    assert none == ["one: 0 of 2 runs are fine; most of the others: lost (2)."]


def test_a_map_is_coloured_by_size_and_outcome_and_hatched_by_trend(tmp_path, monkeypatch):
    """A run of rk4+proj 100 times as accurate as one of RATTLE has a lighter colour, and its drift is hatched."""
    colours, hatched = [], []
    monkeypatch.setattr(outcome_map, "fill", lambda axis, x, y, cells, known: colours.extend([known[k] for k in line] for line in cells))
    monkeypatch.setattr(outcome_map, "hatch", lambda axis, across, up, mask, *look: hatched.append((mask.tolist(), look[0])))
    rows = [("rattle", 0.1, "fine", "bounded", 1e-3), ("rattle", 0.2, "lost", "undetermined", 3.0)]
    rows += [("rk4+proj", 0.1, "fine", "drifts", 1e-5), ("rk4+proj", 0.2, "no solution", "", np.nan)]
    table = pd.DataFrame(rows, columns=["method", "value", "outcome", "trend", "size"])
    outcome_map.draw(tmp_path, "map", table.assign(varied=1.0, parameter="gravity", problem="made up", case="one", steps=1))
    size, word, drifts, unknown = outcome_map.SIZE_COLOURS, outcome_map.COLOURS, *outcome_map.HATCHES.values()
    assert colours == [[size[3], size[6]], [size[2], word["no solution"]]]
    assert hatched == [([[False, False]], drifts), ([[False, True]], unknown), ([[True, False]], drifts), ([[False, False]], unknown)]
    assert pd.read_csv(tmp_path / "map.csv")["outcome"].tolist() == [row[2] for row in rows]


def test_a_map_has_256_by_256_runs_where_these_are_made_together_and_few_where_they_are_not(tmp_path):
    together = outcome_map.specifications(Asked(problem="planar_pendulum", methods=("rattle",)))
    assert (len(together), {some.count for some in together}) == (256, {256})
    assert {some.varied for some in together} == {"gravity"}
    assert [round(10 / some.value) for some in (together[0], together[-1])] == [16, 2048]
    step = tmp_path / "mine.py"
    step.write_text("def step(p, q, h):\n    return p, q\n")
    alone = outcome_map.specifications(Asked(problem="planar_pendulum", methods=(f"{step}:step",)))
    assert (len(alone), {some.count for some in alone}) == (15 * 17, {1})
    given = Asked(problem="planar_pendulum", methods=("rattle", f"{step}:step"), h=(0.1, 0.2), parameters={"gravity": (1.0, 2.0, 3.0)})
    assert [some.count for some in outcome_map.specifications(given)] == [3, 3, *[1] * 6]


@pytest.mark.usefixtures("uncompiled_schemes")
def test_a_map_that_is_interrupted_keeps_its_pieces_and_goes_on_to_the_same_rows(tmp_path):
    asked = Asked(problem="planar_pendulum", methods=("rattle",), t_end=4.0, h=(0.5, 0.25, 0.1), parameters={"gravity": (1.0, 9.0)})
    with opened(tmp_path / "whole.db") as store:
        whole = outcome_map.measure(asked, runs_of(store))

    def stop(done, of, specification):
        if done == 2:
            raise KeyboardInterrupt

    with refused("interrupted", Interrupted, says=("4",)), opened(tmp_path / "s.db") as store:
        outcome_map.measure(asked, runs_of(store, tell=stop))
    made = []
    with opened(tmp_path / "s.db") as store:
        pd.testing.assert_frame_equal(
            outcome_map.measure(asked, runs_of(store, tell=lambda done, of, specification: made.append(specification.value))), whole
        )
    assert made == [0.1]


def test_a_range_tells_where_a_method_is_not_fine():
    table = pd.DataFrame(
        {
            "method": "one",
            "parameter": "mass1",
            "varied": [0.1, 1.0, 10.0],
            "outcome": ["fine", "fine", "blown up"],
            "energy_part": [1e-3, 1e-2, np.nan],
        }
    )
    assert parameter_range.says(table) == [
        "one: fine for 2 of 3 values of mass1 (blown up at 10); energy within 1.0e-02 of its size where it reached its end."
    ]


def test_a_penalty_is_held_against_the_constrained_run_of_the_same_step():
    eps = np.array([0.1, 0.01, 0.001, 0.0001])
    stiff = runs("stiff:gauss2", 0.01, eps=eps, error_q=[1e-1, 1e-3, 5.0, np.nan], evaluations=300.0)
    stiff.loc[3, "failure"] = "stopped"
    coarse = runs("stiff:gauss2", 0.1, eps=eps, error_q=1e-9, evaluations=1.0)
    limit = runs("lobatto3", 0.01, eps=[0.0], error_q=[1e-4], evaluations=100.0)
    other = runs("rattle", 0.01, eps=[0.0], error_q=[1e-2], evaluations=50.0)
    first, _, second = penalty.says(pd.concat([stiff, coarse, limit, other], ignore_index=True))
    assert first == "With h = 0.01 s lobatto3 on the constrained system has an error of 1.0e-04 in q."
    assert "1.0e-03 at best, at eps = 1.0e-02, 10 times that of lobatto3, of the same order, with 3 times its evaluations" in second
    assert second.endswith("1.0e-03, it has 5.0e+00, and 1 of 4 runs fail.")
    (alone,) = penalty.says(pd.concat([stiff, limit.assign(failure="stopped", error_q=np.nan)], ignore_index=True))
    assert alone.startswith("lobatto3 on the constrained system fails with h = 0.01 s")


def test_round_off_has_won_where_the_error_grows_again_and_who_gives_up_first_is_named():
    h = 10.0 ** -np.arange(1, 5)
    walk = runs("fixed", h, error_q=[1e-2, 1e-6, 1e-10, 1e-9], bound_q=1e-16)
    ever = runs("other", h, error_q=[1e-2, 1e-4, 1e-6, 1e-8], bound_q=1e-16)
    solvers = [runs(name, h, error_q=h, bound_q=1e-16).assign(knob="tol") for name in ("index3", "index2")]
    for solver, limit in zip(solvers, (1e-2, 1e-3), strict=True):
        solver.loc[solver["value"] < limit, ["error_q", "failure"]] = [np.nan, "gave up"]
    said = round_off.says(pd.concat([walk, ever, *solvers], ignore_index=True))
    assert said[0] == "fixed: least error 1.0e-10, at h = 1.0e-03 s; at h = 1.0e-04 s it is 10 times that: round-off has won."
    assert said[1] == "other: least error 1.0e-08, at h = 1.0e-04 s."
    assert said[-1] == "First to give up: index3, at tol = 1e-03; then index2 at 1e-04."


def test_until_when_a_motion_is_followed():
    both = pd.concat([runs("one", [0.1, 0.01], horizon=[2.0, 5.0]), runs("two", [0.1, 0.01], horizon=[8.0, 8.0])])
    said = lost_motion.says(both.assign(double_horizon=6.5, tenfold=0.5, t_end=8.0, grown=2.0**30))
    assert said[0] == "A rounding on the way may have grown 1.1e+09 times by t = 8 s, from 1.1e-16 to 1.2e-07."
    assert said[1:3] == [
        "A perturbation grows tenfold in 0.5 s, so that each digit of accuracy is worth so much time.",
        "From t = 6.5 s on no run in double precision can be trusted, whatever its method.",
    ]
    assert said[3:] == [
        "one is within 1% until t = 5 s at best, with h = 1.0e-02 s.",
        "two is within 1% to the end at best, with h = 1.0e-01 s.",
    ]


def test_the_rate_of_growth_is_that_of_an_exponential():
    t = np.linspace(0.0, 30.0, 200)
    assert lost_motion._tenfold(t, np.exp(0.7 * t)) == pytest.approx(np.log(10) / 0.7, rel=1e-6)
    assert np.isnan(lost_motion._tenfold(t, np.ones(200)))
    assert np.isnan(lost_motion._tenfold(t, 1e4 * (2 + np.sin(t))))


def test_a_problem_has_the_extremes_that_it_can_have():
    for problem, case, names in [
        ("planar_pendulum", "near_top", {"step-limit", "outcome-map", "penalty", "round-off", "lost-motion"}),
        ("double_pendulum", "swing", {"step-limit", "outcome-map", "parameter-range", "penalty", "round-off"}),
        ("torus", "inner", {"step-limit", "outcome-map"}),
        ("lotka_volterra", None, {"step-limit", "outcome-map", "round-off"}),
    ]:
        found, refused = chosen(Asked(problem=problem, case=case))
        assert set(found) == names
        assert set(refused) == set(EXTREMES) - names
        assert all(why and not why.endswith(".") for why in refused.values())


def test_what_an_extreme_cannot_use_is_refused():
    for name, asked, why in [
        ("outcome-map", {"parameters": {"gravity": [0.0, 1.0]}}, "greater than 0, each once"),
        ("outcome-map", {"h": [0.1, 0.1]}, "greater than 0, each once"),
        ("parameter-range", {"h": [0.1, 0.2], "parameters": {"gravity": [1.0]}}, "one step size"),
        ("round-off", {"t_end": 1e4}, "before t_end = 10000"),
    ]:
        assert why in EXTREMES[name].refusal(Asked(problem="planar_pendulum", case="rotating", **asked))


def test_bad_input_is_one_sentence(daebench, tmp_path):
    require_refusals(
        daebench,
        ("stability", "planar_pendulum", "--out", tmp_path / "new"),
        ("unknown-name", "--only map"),
        ("varied-values-malformed", "--param gravity"),
        ("unknown-name", "--param weight=1"),
        ("not-positive", "--h -1"),
        ("unknown-name", "--methods rattel"),
    )
