"""Orders of methods, measured: the sequence of step sizes, and what is fitted to the errors."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from ball_on_a_string import rattle
from ivps import ivp
from refusals import refused
from studies import plain, rattle_on_planar

from daebench.methods.fixed_step.constrained import FixedStep
from daebench.reference.solution import EPS, reference_solution
from daebench.studies.orders.bench import Bench
from daebench.studies.orders.series import COMMON, Point, step_sizes
from daebench.studies.orders.study import order, study

pytestmark = pytest.mark.usefixtures("plain_functions")


def by_component(found):
    return {series.component: series for series in found.series}


# ---- step sizes ----------------------------------------------------------------------------------------------------------


def test_every_sequence_begins_coarse_has_many_steps_and_never_one_twice():
    for claimed in range(1, 11):
        counts = step_sizes(1.0, claimed)
        assert counts == sorted(set(counts))
        assert len(counts) >= 11
        assert claimed < 3 or counts[0] == 1
        assert claimed < 5 or {3, 5, 7} < set(counts)


def test_given_step_sizes_are_halved_and_no_others_are_taken():
    assert step_sizes(2.0, 8, 0.1, 3) == [3, 6, 12, 24]
    assert step_sizes(2.0, 1, 0.25, 2) == [1, 2, 4]


def test_numbers_out_of_range_are_refused():
    for code, settings in [
        ("not-positive", {"t_end": 0.0}),
        ("not-positive", {"t_end": -1.0}),
        ("not-finite", {"t_end": math.nan}),
        ("halvings-below-two", {"halvings": 1}),
        ("not-whole", {"halvings": 2.5}),
        ("halvings-make-too-many-steps", {"halvings": 40}),
        ("not-positive", {"h": -0.1}),
        ("halvings-make-too-many-steps", {"h": 1e-300}),
        ("orders-step-too-long", {"h": 0.2}),
    ]:
        with refused(code):
            study(ivp("planar"), [plain("rattle")], **{"t_end": 1.0} | settings)


def test_methods_without_an_order_are_refused():
    wrong = {"unknown-name": ["rattel"], "own-steps-where-fixed-needed": ["rattle", "ida:index2"], "orders-without-method": []}
    for code, methods in wrong.items():
        with refused(code):
            order("planar_pendulum", methods=methods)


def test_a_method_that_refuses_the_problem_is_refused_before_any_run():
    with refused("method-refuses-problem"):
        study(ivp("stretched-M"), [plain("rattle"), plain("shake")], t_end=1.0, halvings=2)


# ---- orders --------------------------------------------------------------------------------------------------------------


def test_rattle_has_order_two_and_its_multipliers_order_one_each_and_two_in_the_mean():
    found = by_component(rattle_on_planar())
    assert list(found) == ["q", "p", "lam", "lam_n", "mu_n", "mean"]
    for name, expected in {"q": 2, "p": 2, "lam": 2, "lam_n": 1, "mu_n": 1, "mean": 2}.items():
        assert abs(found[name].fit.slope - expected) < 0.1, name
        assert all(found[name].fit.used), name
    assert [found[name].claimed for name in found] == [2, 2, 2, None, None, None]


def test_errors_are_the_largest_over_the_common_times_in_the_euclidean_norm():
    point = by_component(rattle_on_planar())["q"].points[1]
    assert (point.h, point.steps) == (1 / 64, 64)
    states = [(ivp("planar").p0, ivp("planar").q0)]
    for _ in range(point.steps):
        states.append(rattle(*states[-1], point.h))
    p, q = (np.array(part)[:: point.steps // COMMON][1:] for part in zip(*states, strict=True))
    lam = (np.sum(p**2, axis=1) - q[:, 1]) / (2 * np.sum(q**2, axis=1))
    exact = reference_solution(ivp("planar"), np.arange(1, COMMON + 1) / COMMON).states
    for name, found in {"q": q, "p": p, "lam": lam[:, None]}.items():
        assert point.errors[name] == pytest.approx(np.max(np.linalg.norm(found - exact[name], axis=1)), rel=1e-9)


def test_the_order_is_found_without_a_closed_form():
    found = study(ivp("double-pendulum"), [plain("rattle"), plain("symplectic_euler")], t_end=1.0, h=1 / 64, halvings=4)
    slopes = {(series.method, series.component): series.fit.slope for series in found.series}
    for name in ("q", "p", "lam"):
        assert abs(slopes["rattle", name] - 2) < 0.1
        assert not slopes["symplectic_euler", name] > 1.3
    assert found.reference_solution.kind == "DOP853"


def test_an_order_that_looks_like_two_at_large_steps_is_found_to_be_one_or_not_at_all():
    # three halvings from h = 1/32: the errors of q and p fall by factors from 4 to 9 each time
    coarse = by_component(study(ivp("spherical-fast"), [plain("symplectic_euler")], t_end=1.0, h=1 / 32, halvings=3))
    for name in ("q", "p"):
        errors = coarse[name].errors
        assert errors[0] > 50 * errors[-1]
        assert math.isnan(coarse[name].fit.slope)
        assert coarse[name].fit.note


@pytest.mark.slow
def test_symplectic_euler_has_order_one_where_it_looks_like_two():
    found = study(ivp("spherical-fast"), ["symplectic_euler"])
    for series in found.series[:3]:
        assert abs(series.fit.slope - 1) < 0.06
        assert sum(series.fit.used) >= 8


HIGH_ORDERS = {"rattle/suzuki4": 4, "rattle/yoshida6": 6, "rattle/kahan_li8": 8, "rattle/sofroniou_spaletta10": 10}

# a reference by DOP853 is not good enough for order 10: too few points are left
FOUND = [(case, name) for case in ("spherical-slow", "spherical-fast", "planar", "stretched-M") for name in HIGH_ORDERS]
FOUND.remove(("stretched-M", "rattle/sofroniou_spaletta10"))


USUAL = ("spherical-slow-rattle/yoshida6", "planar-rattle/kahan_li8")
"""Compositions on a problem, which the gate takes."""


@pytest.mark.slow
@pytest.mark.sampled(by=lambda case: case in USUAL)
@pytest.mark.parametrize(("case", "name"), FOUND, ids=[f"{case}-{name}" for case, name in FOUND])
def test_high_orders_are_found_with_the_default_step_sizes(case, name):
    found, claimed = study(ivp(case), [name]), HIGH_ORDERS[name]
    for series in found.series:
        assert series.claimed == claimed
        assert abs(series.fit.slope - claimed) < 0.3, series


def test_steps_that_fail_are_points_that_failed():
    found = study(ivp("spherical-fast"), [plain("rattle")], t_end=8.0, h=1.0, halvings=6)
    for series in found.series:
        assert series.fit.reasons[0] == "failed"
        assert math.isnan(series.errors[0])
        assert "stopped at t = 0" in series.points[0].failure
    assert found.drawn[found.drawn["reason"] == "failed"]["failure"].all()
    none = study(ivp("spherical-fast"), [plain("rattle")], t_end=32.0, h=4.0, halvings=2)
    assert [series.component for series in none.series] == ["q", "p", "lam"]
    assert [series.dropped for series in none.series] == [{"failed": 3}] * 3
    assert math.isnan(none.table["order"].max())


def test_points_below_what_the_reference_is_good_for_are_round_off(monkeypatch):
    def vague(*asked):
        return replace(reference_solution(*asked), kind="vague", bound={"q": 1e-3, "p": 1e-4, "lam": 1e-9})

    monkeypatch.setattr("daebench.studies.orders.study.reference_solution", vague)
    found = by_component(study(ivp("planar"), [plain("rattle")], t_end=1.0, h=1 / 32, halvings=4))
    for name, bound in (("q", 1e-3), ("p", 1e-4)):
        assert found[name].floor == bound
        assert [reason == "round-off" for reason in found[name].fit.reasons] == [error <= bound for error in found[name].errors]
    assert "round-off" in found["q"].fit.reasons
    assert all(found["lam"].fit.used)


def test_refinement_ends_at_round_off():
    found = by_component(study(ivp("planar"), [plain("rattle", composition="kahan_li8")], t_end=4.0))
    assert len(found["q"].points) < len(step_sizes(4.0, 8))
    assert found["q"].errors[-1] < 1000 * EPS
    assert found["q"].dropped["round-off"] >= 2
    assert abs(found["q"].fit.slope - 8) < 0.3


def test_multipliers_inside_of_a_step_are_taken_where_steps_begin_at_common_times():
    n, times = 4, np.arange(1, COMMON + 1) / COMMON
    pendulum, h = ivp("planar"), 1 / 32
    inside = (np.arange(COMMON * n) + 0.3) * h
    values = reference_solution(pendulum, inside).states["lam"].copy()
    values[::n] += 1e-3
    values[1::n] += 1.0
    values[3 * n] += 2e-3
    run = SimpleNamespace(raw={"lam_1": (inside, values)}, value=h)
    errors, bound = Bench(pendulum, plain("rattle"), reference_solution(pendulum, times))._raw_errors(run, n)
    assert errors == {"lam_1": pytest.approx(3e-3, abs=bound)}
    assert bound < 1e-10


def test_the_second_multiplier_of_ggl_is_held_against_zero():
    found = by_component(study(ivp("planar"), [plain("radau2_ggl")], t_end=1.0, h=1 / 16, halvings=4))
    assert abs(found["mu_2"].fit.slope - 2) < 0.1


def test_what_converges_to_something_else_is_no_round_off():
    soft = FixedStep("gauss2", form="stiff", options={"eps": 0.05}, compiled=False)
    found = by_component(study(ivp("planar"), [soft], t_end=1.0, h=1 / 128, halvings=3))
    assert found["q"].dropped == {"plateau": 4}
    assert "not to 0" in found["q"].fit.note


GAUSS2 = (2.206e-08, 1.379e-09, 8.501e-11, 5.363e-12, 1.483e-12, 3.836e-13)
"""Errors in q of gauss2 on the fast swing of the spherical pendulum with 1024, 2048, ... steps to t = 4: the last two are of rounding."""


def test_roundings_that_add_up_over_many_steps_are_no_part_of_the_order():
    own = ivp("planar")
    known = reference_solution(own, [4.0 * k / COMMON for k in range(1, COMMON + 1)])
    points = [Point(4.0 / n, n, {"q": error}) for n, error in zip((1024 * 2**k for k in range(6)), GAUSS2, strict=True)]
    series = Bench(own, plain("gauss2"), known)._component("q", points)
    assert abs(series.fit.slope - 4) < 0.02
    assert series.fit.reasons[-2:] == ("round-off",) * 2
