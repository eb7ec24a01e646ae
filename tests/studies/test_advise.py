"""Advice: the search finds the cheapest value of methods with known errors, and what it says holds where it is measured apart."""

import itertools
import json
import math
import re
import shlex
from dataclasses import replace

import numpy as np
import pytest
from refusals import refused
from scipy.integrate import solve_ivp
from scipy.stats import binomtest, norm

import daebench
from daebench.errors import BadInput, RunFailed
from daebench.methods.ensemble.run import run_members
from daebench.runs.request import Request
from daebench.starts.draw import draw_starts
from daebench.studies.advise.choice import Work, _longest, _settled, chosen_of, why_nothing
from daebench.studies.advise.evidence import changes, keeps
from daebench.studies.advise.question import Question
from daebench.studies.advise.search import error_of, search
from daebench.studies.grid.measure import row_of
from daebench.studies.grid.run_specification import StartRuns
from daebench.studies.work_precision.winners import fewest_wins

QUESTION = {"problem": "planar_pendulum", "case": "rotating", "accuracy": 1e-6, "t_end": 10.0}


def made_up_row(run, error, seconds):
    """Return the row of a run, or of one from many starts, with this error, or these, and this time."""
    failure = "" if np.all(np.isfinite(error)) else "it stopped"
    row = {"method": run.method, "value": run.value, "seconds": seconds, "steps": 1, "error_q": error, "bound_q": 1e-15, "failure": failure}
    many = ("error_q", "bound_q", "failure") if isinstance(run, StartRuns) else ()
    return row | {name: np.broadcast_to(row[name], run.members).tolist() for name in many}


def made_up(of_error, of_price, calls):
    """Return what makes rows of a method whose error and price are given functions of its step size or tolerance."""

    def make(run):
        calls.append(run.value)
        return made_up_row(run, of_error(run.value), of_price(run.value))

    return make


@pytest.mark.parametrize("accuracy", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize(("order", "method"), [(1, "symplectic_euler"), (2, "rattle"), (4, "rattle/suzuki4"), (8, "rattle/kahan_li8")])
def test_the_step_found_is_near_the_largest_that_reaches_an_accuracy(order, method, accuracy):
    """Over constants of the error: laws C h^p that end in round-off and are lost, or of no use, at large steps."""
    question = Question(**{**QUESTION, "accuracy": accuracy})
    for constant, lost in itertools.product(10.0 ** np.arange(-2, 5, 0.7), (0.05, math.inf)):
        largest, calls = min((accuracy / constant) ** (1 / order), lost, question.t_end / 8), []
        make = made_up(lambda h, c=constant, lost=lost: c * h**order if h <= lost else math.inf, lambda h: 1e-6 / h, calls)
        row = search(question, method, make).row
        if question.t_end / largest > 2**22 / 2:
            assert row is None or row["error_q"] <= accuracy
        else:
            assert row["error_q"] <= accuracy
            assert largest / row["value"] <= 1.4
            assert len(calls) <= 20


@pytest.mark.parametrize("accuracy", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize("power", [0.7, 0.9, 1.0])
def test_the_tolerance_found_is_within_a_quarter_of_a_decade(power, accuracy):
    question = Question(**{**QUESTION, "accuracy": accuracy})
    for constant in 10.0 ** np.arange(-1, 3, 0.6):
        calls = []
        found = search(question, "ida:index1", made_up(lambda tol, c=constant: c * tol**power, lambda tol: tol**-0.2, calls))
        largest = (accuracy / constant) ** (1 / power)
        if largest < 2e-14:
            continue
        assert found.row["error_q"] <= accuracy
        assert largest / found.row["value"] < 1.9
        assert len(calls) <= 12


@pytest.mark.parametrize(("order", "method"), [(2, "strang"), (4, "rk4")])
def test_errors_of_steps_longer_than_the_motion_do_not_end_a_search(order, method):
    """Over a long horizon the first steps are so long that errors are as large as the motion, and do not fall for some refinements."""
    question = Question(**{**QUESTION, "t_end": 1000.0, "accuracy": 1e-3})
    for size in (0.3, 2.0, 1e30):
        found = search(question, method, made_up(lambda h, size=size: min(size, h**order), lambda h: 1e-6 / h, []))
        assert found.row["error_q"] <= 1e-3
        assert 1e-3 ** (1 / order) / found.row["value"] <= 1.4


def test_a_search_does_not_depend_on_the_unit_of_length(monkeypatch):
    """A mechanism in millimetres is as large as one in metres: what is small is small beside the motion."""
    values = []
    for size in (1.0, 1e-3):
        monkeypatch.setattr(Question, "size", size)
        question = Question(**{**QUESTION, "t_end": 1000.0, "accuracy": 1e-3 * size})
        make = made_up(lambda h, size=size: size * min(2.0, h**4), lambda h: 1e-6 / h, [])
        values.append(search(question, "rk4", make).row["value"])
    assert values[0] == values[1]


def test_a_method_at_its_round_off_is_given_up_and_says_so():
    question = Question(**{**QUESTION, "accuracy": 1e-12})
    calls = []
    found = search(question, "rattle/kahan_li8", made_up(lambda h: max(h**8, 1e-11), lambda h: 1e-6 / h, calls))
    assert found.row is None
    assert "stays at 1.0e-11" in found.why
    assert len(calls) < 10


def test_a_method_that_takes_longer_than_those_that_are_named_is_not_followed():
    question, calls = Question(**QUESTION), []
    found = search(question, "rattle", made_up(lambda h: h**2, lambda h: 1e-6 / h, calls), longest=1e-5)
    assert found.row is None
    assert "takes longer than others" in found.why
    assert min(calls) > 1e-3 / 3  # the accuracy takes h = 1e-3


@pytest.mark.slow
def test_a_start_moves_onto_the_manifold_that_other_parameters_make():
    question = Question(**{**QUESTION, "t_end": 1.0})
    row = row_of(question.changed("rattle", 1 / 64, parameters={"length": 1.2}))
    assert row["failure"] == [""]
    assert max(row["error_q"]) < 1e-2
    assert row["bound_q"][0] < 1e-9


def spread_out(spread, order):
    """Return what makes rows of a method whose errors are h^order times numbers that are lognormal over the starts."""

    def make(run):
        many = np.random.default_rng(run.seed).normal(size=run.members) if isinstance(run, StartRuns) else 0.0
        return made_up_row(run, run.value**order * np.exp(spread * many), 1e-6 / run.value)

    return make


def settled(question, make, found=None):
    """Return the choice that a method is, from rows that are made up, and why others are left out."""
    work, left_out = Work(question, None, None), {}
    work.make = make
    return _settled(work, found or search(question, "rk4", make), left_out), left_out


@pytest.mark.sampled(by=lambda case: case == "0.95-0.5")
@pytest.mark.parametrize(("share", "spread"), [(0.5, 1.5), (0.8, 0.5), (0.95, 0.1), (0.95, 0.5), (0.95, 1.5)])
def test_the_share_of_all_starts_within_the_accuracy_is_the_one_asked_for_but_for_few_samples(share, spread):
    """The share of all starts is known: from 40 samples of starts it is less than said for 2.5 % of them; by one start it is less."""
    make = spread_out(spread, 4)
    question = Question(**{**QUESTION, "accuracy": 1e-4})
    found, shares = search(question, "rk4", make), []
    for seed in range(-1, 40):
        choice, _ = settled(replace(question, share=share if seed >= 0 else 0, seed=abs(seed)), make, found)
        shares.append(float(norm.cdf(math.log(1e-4 / choice.value**4) / spread)))
    from_one_start, *others = shares
    assert binomtest(sum(some < share for some in others), len(others), 0.025, alternative="greater").pvalue > 1e-3
    assert from_one_start <= min(others)
    assert from_one_start < share or spread < 0.5 or share < 0.8
    assert min(others) < 1 - (1 - share) / 50 or spread < 0.5  # no more is paid than needed


def test_too_few_starts_confirm_nothing_and_all_of_them_have_to_be_within():
    for starts, wins in ((4, 4), (16, 16), (71, 71), (72, 72), (110, 109), (128, 127)):
        assert fewest_wins(0.95, starts) == wins
        assert (binomtest(wins, starts).proportion_ci().low >= 0.95) == (starts >= 72)


def test_a_method_whose_other_starts_cannot_be_reached_or_known_is_left_out_and_says_why():
    question, make = Question(**{**QUESTION, "accuracy": 1e-4}), spread_out(0.1, 4)

    def stops(run):
        row = make(run)
        return row | {"error_q": [math.nan] * 20 + row["error_q"][20:]} if isinstance(run, StartRuns) else row

    def unknown(run):
        if isinstance(run, StartRuns):
            raise BadInput("there are no references.")
        return make(run)

    for rows, words in ((stops, "108 of 128"), (unknown, "there are no references")):
        choice, left_out = settled(question, rows)
        assert choice is None
        assert words in left_out["rk4"]
        assert words in why_nothing(question, [search(question, "rk4", rows)], left_out)


def pendulum_motion(q, v, t):
    """Return the positions of pendulums of length and mass 1 in gravity 1 by DOP853, shape(len(t), n, d): the force along q is known."""
    down = np.zeros(q.shape[1])
    down[-1] = -1.0

    def rates(_, flat):
        x, u = flat.reshape(2, *q.shape)
        pull = np.sum(u * u, axis=1) + x @ down
        return np.concatenate([u, down - pull[:, None] * x / np.sum(x * x, axis=1)[:, None]]).ravel()

    run = solve_ivp(rates, (0, t[-1]), np.concatenate([q, v]).ravel(), "DOP853", t_eval=t, rtol=1e-11, atol=1e-12)
    return run.y.T.reshape(len(t), 2, *q.shape)[:, 0]


@pytest.mark.slow
@pytest.mark.sampled(left_out=("plane",))
@pytest.mark.parametrize(("problem", "case"), [("planar_pendulum", "rotating"), ("spherical_pendulum", "fig1.1")], ids=["plane", "sphere"])
def test_of_starts_from_other_seeds_the_share_asked_for_is_within_the_accuracy(problem, case, tmp_path):
    """Of 512 starts that advice has not seen; what they are measured against is made here."""
    accuracy, seed = 1e-5, 0
    fixed = {"case": case, "t_end": 3.0, "methods": ("rk4", "rattle"), "store": tmp_path / "s.db"}
    advice = daebench.advise(problem, accuracy=accuracy, seed=seed, **fixed)
    ivp, choice = advice.question.ivp, advice.choice
    steps, some = round(3.0 / choice.value), draw_starts(ivp, members=512, h=choice.value, seed=seed + 100).members
    asked = Request(value=choice.value, steps=steps, every=1, watch=(), count=False)
    _, q = ivp.vectors(run_members(advice.question.solver(choice.method), some, asked, lanes=1).states)
    p0, q0 = some.start
    off = np.max(np.abs(q - pendulum_motion(q0, p0, 3.0 / steps * np.arange(steps + 1))), axis=(0, 2))
    assert np.mean(off <= accuracy) >= 0.95
    assert advice.starts.within(accuracy).low >= 0.95
    coarse = daebench.run(problem, case=case, method=choice.method, h=6.0 / steps, steps=steps // 2)
    exact = pendulum_motion(ivp.start[1][None], ivp.start[0][None], coarse.t)[:, 0]
    as_is, *changed = advice.changes
    assert (as_is.what, as_is.factor(accuracy)) == ("nothing changed", pytest.approx(choice.error / accuracy, rel=0.01))
    doubled = {change.what: change.factor(accuracy) for change in changed}["step doubled"]
    assert steps % 2 or doubled == pytest.approx(np.max(np.abs(coarse.q - exact)) / accuracy, rel=0.01)


@pytest.fixture(scope="module")
def asked(tmp_path_factory):
    store = tmp_path_factory.mktemp("advice") / "runs.db"
    methods = ("rattle", "rattle/suzuki4", "rk4")
    return {"case": "rotating", "t_end": 2.0, "methods": methods, "starts": 4, "store": store}


def test_what_is_advised_reaches_the_accuracy_from_the_closed_form_and_is_the_cheapest_by_work(asked):
    advice = daebench.advise("planar_pendulum", accuracy=1e-5, share=0, **asked)
    run = daebench.run("planar_pendulum", case="rotating", method=advice.choice.method, h=advice.choice.value, t_end=2.0)
    fine = pendulum_motion(run.q[:1], run.p[:1], np.array([0.0, 2.0]))[-1, 0]
    assert np.max(np.abs(run.q[-1] - fine)) <= 1e-5
    assert advice.choice.error <= 1e-5
    found = {some.method: some for some in advice.found}
    assert set(found) == set(asked["methods"])
    reaching = {name: some for name, some in found.items() if some.row}
    assert all(some.row or "takes longer" in some.why for some in found.values())
    for name, some in reaching.items():
        fewer = int(some.row["steps"] / 1.5)  # no step half as large again would have done
        coarse = daebench.run("planar_pendulum", case="rotating", method=name, h=2.0 / fewer, steps=fewer)
        assert fewer < 8 or np.max(np.abs(coarse.q[-1] - fine)) > 1e-5


def test_the_command_and_the_python_line_make_the_run(asked, daebench):
    import daebench as package

    fractions = []
    settings = {**asked, "methods": ["rattle"], "parameters": {"gravity": 1.234567890123}}
    advice = package.advise("planar_pendulum", accuracy=1e-2, progress=lambda fraction, _: fractions.append(fraction), **settings)
    status, out, _ = daebench(*shlex.split(advice.command)[1:], "--json")
    run = eval(advice.python, {"daebench": package})  # it is for a script
    assert (status, run.q[-1].tolist(), run.method) == (0, json.loads(out)["q"], advice.choice.method)
    assert run.work["H_q"] > 0
    assert fractions == sorted(fractions)
    assert fractions[0] == 0


def test_what_has_to_be_kept_is_claimed_and_measured(asked):
    advice = daebench.advise("planar_pendulum", accuracy=1e-3, keep=("energy", "two_form"), **asked)
    assert advice.choice.method != "rk4"
    assert {"energy", "two_form"} <= {name for name, kept in advice.kept.items() if kept.kept}
    assert "rk4" in advice.left_out


def test_what_cannot_be_had_is_no_choice(asked):
    assert daebench.advise("planar_pendulum", accuracy=1e-6, budget=1e-7, **{**asked, "methods": ["rk4"]}).choice is None
    with refused("reference-too-coarse"):
        daebench.advise("double_pendulum", **{**asked, "case": "horizontal", "t_end": 5.0}, parameters={"gravity": 9.0}, accuracy=1e-13)


def test_bad_questions_are_refused(asked):
    for code, wrong in (
        ("not-positive", {"accuracy": 0.0}),
        ("unknown-name", {"keep": ("phase",)}),
        ("nothing-to-conserve", {"keep": ("casimirs",)}),
        ("advise-starts-or-seed", {"starts": 0}),
        ("share-out-of-range", {"share": 1}),
        ("share-out-of-range", {"share": -0.1}),
        ("not-finite", {"share": math.nan}),
        ("no-method-left", {"methods": ["rk4"], "keep": ("constraints",)}),
    ):
        with refused(code):
            daebench.advise("planar_pendulum", **{**asked, "accuracy": 1e-3, **wrong})


def test_an_integrator_of_ones_own_is_among_the_candidates(asked, tmp_path):
    mine = tmp_path / "mine.py"
    mine.write_text("def step(problem, p, q, h):\n    return p, q + h * problem.H_p(p, q)\n", encoding="utf-8")
    advice = daebench.advise("planar_pendulum", accuracy=1e-3, also=[f"{mine}:step"], **{**asked, "methods": ["rattle"]})
    assert advice.choice.method == "rattle"
    ((name, outside),) = advice.outside.items()
    assert outside
    assert [some.row for some in advice.found if some.method == name] == [None]


def test_errors_count_as_infinite_where_a_run_failed_and_never_below_the_bound():
    row = {"error_q": 1e-9, "bound_q": 1e-7, "failure": ""}
    assert error_of(row, "q") == 1e-7
    assert error_of(row | {"failure": "it stopped"}, "q") == math.inf
    assert error_of(row | {"error_q": math.nan}, "q") == math.inf


def test_a_map_without_a_derivative_is_not_said_to_conserve_the_two_form(monkeypatch):
    def stopped(*_):
        raise RunFailed("it stopped.")

    measured = keeps(Question(**QUESTION), "rattle", 0.01, row_of)["two_form"]
    monkeypatch.setattr("daebench.studies.advise.evidence.defect_of", stopped)
    unknown = keeps(Question(**QUESTION), "rattle", 0.01, row_of)["two_form"]
    assert (measured.kept, unknown.kept, unknown.words) == (True, False, "not measured: it stopped")


def law(run, floor):
    """Return the made-up row of a run: rk4 with errors h^4 and 1 ms a step, rattle with errors h^2 and 0.1 ms; none below a floor."""
    order, price = (4, 1e-3) if run.method == "rk4" else (2, 1e-4)
    return made_up_row(run, max(run.value**order, floor), price * run.t_end / run.value)


def answered(budget, floor, share=0.95, accuracy=1e-4, make=law):
    """Return the choices and the sentence of a question whose runs are made up."""
    work, left_out = Work(Question(**QUESTION | {"accuracy": accuracy, "budget": budget, "share": share}), None, None), {}
    work.make = lambda run: make(run, floor)
    found = [search(work.question, name, work.make, _longest(work.question, ())) for name in ("rk4", "rattle")]
    chosen = [choice for choice, _ in chosen_of(work, found, left_out)]
    return chosen, why_nothing(work.question, found, left_out)


@pytest.mark.parametrize("share", [0, 0.95])
@pytest.mark.parametrize("accuracy", [1e-2, 1e-6])
@pytest.mark.parametrize("budget", [1e-9, 9e-3])
def test_a_budget_that_is_too_small_is_told_with_the_price_of_the_cheapest_run(budget, accuracy, share, monkeypatch):
    """The prices are known: 10 ms over h for rk4, 1 ms over h for rattle, and h is the fourth or second root of the accuracy."""
    monkeypatch.setattr("daebench.studies.advise.choice.keeps", lambda *_: {})
    least = min(1e-2 / accuracy**0.25, 1e-3 / accuracy**0.5)
    chosen, why = answered(budget, 0.0, share, accuracy)
    assert chosen == []
    price = float(re.search(r"the cheapest run within the accuracy, .* with h = .*, takes (\S+) s, which the budget excludes", why)[1])
    assert least <= 1.01 * price <= 1.5 * least
    assert "reaches its end" not in why
    chosen, _ = answered(2 * least, 0.0, share, accuracy)  # the same question with a budget of twice as much has an answer
    assert chosen


@pytest.mark.parametrize("budget", [math.inf, 1e-7])
@pytest.mark.parametrize("floor", [1e-2, 3e-4])
def test_an_accuracy_out_of_reach_is_told_with_the_best_error_and_whether_the_budget_excludes_it_as_well(floor, budget):
    chosen, why = answered(budget, floor)
    assert chosen == []
    assert float(re.search(r"the best is .*: error (\S+),", why)[1]) == pytest.approx(floor, rel=0.05)
    assert why.endswith(" s, which the budget excludes") == (budget < 1)
    assert "within the accuracy" not in why


@pytest.mark.parametrize("budget", [math.inf, 1e-7])
def test_that_no_run_reaches_its_end_is_said_where_it_is_so(budget):
    assert "it stopped" in answered(budget, 0.0, make=lambda run, _: made_up_row(run, math.nan, 1.0))[1]


def test_a_change_after_which_a_ring_does_not_close_has_an_unknown_effect_and_says_why():
    question = Question(problem="cyclohexane_ring", case="boat", accuracy=1e-3, t_end=10.0)
    made = changes(question, "rattle", "h", 0.01, lambda run: made_up_row(run, 1e-4, 1.0))
    effects = {change.what: change for change in made}
    wider = effects.pop("angle +20 %")
    assert math.isnan(wider.factor(1e-3))
    assert "must be finite numbers" in wider.found.failure
    assert [change.factor(1e-3) for change in effects.values()] == [0.1] * 10
    assert next(iter(effects)) == "nothing changed"
