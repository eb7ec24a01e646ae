"""Poisson systems: reference solutions, orders measured, and claims held against measurements."""

import json
import math
from dataclasses import replace

import mpmath
import numpy as np
import pytest
from poisson_motions import ivp_of, plain_module, solution
from refusals import refused

import daebench.methods.formulations.poisson as posing
from daebench.errors import RunFailed
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.fixed_step.lifted import Lifted
from daebench.methods.fixed_step.poisson import PoissonStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import POISSON, parse
from daebench.reference.solution import integrated, reach, reference_solution
from daebench.studies.claims.bench import FALLS_SHORT, NOT_CLAIMED, OK
from daebench.studies.claims.check import check_claims
from daebench.studies.orders.study import order, study

TIMES = np.arange(1, 9) / 4


@pytest.fixture(autouse=True)
def plain_sources(monkeypatch):
    monkeypatch.setattr(posing, "_module", plain_module)


def plain(name, **more):
    """Return the method of this name with an uncompiled kernel."""
    return replace(parse(name, **more, kind=POISSON), compiled=False)


# ---- reference -----------------------------------------------------------------------------------------------------------


def test_the_closed_form_and_the_integration_agree_within_the_bound_of_the_worse():
    exact, steps = reference_solution(ivp_of("body"), TIMES), integrated(ivp_of("body"), TIMES)
    assert (exact.kind, steps.kind) == ("closed form", "DOP853")
    assert 0 < np.max(np.linalg.norm(exact.states["y"] - steps.states["y"], axis=1)) <= steps.bound["y"] < 1e-11
    assert exact.bound["y"] < 1e-15


@pytest.mark.parametrize(("name", "t"), [("three", 1.5), ("prey", 2.0), ("top", 2.0)])
def test_the_reference_is_the_motion_written_by_hand(name, t):
    found = reference_solution(ivp_of(name), [t / 2, t])
    assert found.kind == "DOP853"
    assert np.linalg.norm(found.states["y"][-1] - solution(name, t)) <= 3 * found.bound["y"] < 1e-9


def test_the_bound_holds_against_an_integration_with_thirty_digits():
    with mpmath.workdps(30):
        f = mpmath.odefun(lambda _, y: [y[0] * (y[1] - 2), y[1] * (1 - y[0])], 0, [mpmath.mpf(6), mpmath.mpf(2)], tol=1e-22)
        exact = np.array([float(x) for x in f(1)])
    found = reference_solution(ivp_of("prey"), [1.0])
    assert np.linalg.norm(found.states["y"][0] - exact) <= found.bound["y"] < 1e-11


def test_beyond_a_blow_up_there_is_no_reference_and_the_default_end_is_before_it():
    with refused("reference-solution-stopped", RunFailed):
        reference_solution(ivp_of("three"), [2.0])
    assert 1 < reach(ivp_of("three"), 64) < reach(ivp_of("three"), 10_000) < 1.7480


def test_a_reference_that_has_left_the_domain_is_an_error(monkeypatch):
    monkeypatch.setattr("daebench.reference.solution.advanced", lambda dae, times, tol, calls: np.array([[1.0, -1e-3]] * len(times)))
    with refused("reference-leaves-domain", RunFailed, says=("u > 0 and v > 0 at t = 1",)):
        reference_solution(ivp_of("prey"), [1.0])


# ---- orders --------------------------------------------------------------------------------------------------------------


def strang_by_hand(y, h, steps):
    """(4.6): half a step of v - 2 ln v, which moves u, a whole one of u - ln u, which moves v, and half a step again."""
    u, v = y
    kept = []
    for k in range(steps):
        u = u * math.exp(h / 2 * (v - 2))
        v = v * math.exp(h * (1 - u))
        u = u * math.exp(h / 2 * (v - 2))
        if (k + 1) % (steps // 8) == 0:
            kept.append((u, v))
    return np.array(kept)


def test_errors_are_the_largest_over_the_common_times_in_the_euclidean_norm():
    (series,) = study(ivp_of("prey"), [plain("strang")], t_end=1.0, h=1 / 16, halvings=3).series
    point = series.points[1]
    assert (series.component, point.h, point.steps) == ("y", 1 / 32, 32)
    exact = [solution("prey", k / 8) for k in range(1, 9)]
    errors = np.linalg.norm(strang_by_hand([6.0, 2.0], point.h, point.steps) - exact, axis=1)
    assert point.errors["y"] == pytest.approx(errors.max(), rel=1e-9)


ORDERS = {
    ("prey", "lie"): (1, 1 / 256),
    ("prey", "darboux:verlet"): (2, 1 / 32),
    ("prey", "strang/suzuki4"): (4, 1 / 32),
    ("three", "strang@123"): (2, 1 / 128),
    ("body", "midpoint"): (2, 1 / 8),
    ("top", "strang"): (2, 1 / 16),
}


@pytest.mark.parametrize(("name", "method"), ORDERS, ids=["-".join(key) for key in ORDERS])
def test_the_order_is_the_one_claimed(name, method):
    claimed, h = ORDERS[name, method]
    found = study(ivp_of(name), [plain(method, anyway=True)], t_end=1.0, h=h, halvings=3).series[0]
    assert found.claimed == claimed
    assert abs(found.fit.slope - claimed) < 0.1
    assert sum(found.fit.used) >= 3


def test_a_lifted_method_has_the_order_of_the_one_above():
    lifted = Lifted(FixedStep("rattle", compiled=False))
    found = study(ivp_of("body"), [lifted], t_end=1.0, h=1 / 8, halvings=3).series[0]
    assert (found.method, found.claimed) == ("lifted:rattle", 2)
    assert abs(found.fit.slope - 2) < 0.1


def test_methods_that_cannot_be_measured_are_refused():
    for code, method in (
        ("unknown-name", "strnag"),
        ("own-steps-where-fixed-needed", "ida:ode"),
        ("method-refuses-problem", "midpoint"),
        ("method-of-other-kind", "rattle"),
        ("method-for-constrained", FixedStep("rattle")),
    ):
        with refused(code):
            order("lotka_volterra", methods=[method])


# ---- claims --------------------------------------------------------------------------------------------------------------


def no_study(ivp, methods, **_):
    raise RunFailed("no study here.")


def checked(monkeypatch, name, method, h, *, order=False, **more):
    """Return the findings by property, on an uncompiled kernel."""
    if not order:
        monkeypatch.setattr("daebench.studies.claims.check.study", no_study)
    ivp = ivp_of(name) if isinstance(name, str) else name
    found = check_claims(ivp, plain(method, anyway=True) if isinstance(method, str) else method, h=h, **{"steps": 60} | more)
    return {each.property: each for each in found}


HOLD = {
    ("prey", "strang"): {"symmetric", "Poisson map"},
    ("prey", "darboux:midpoint"): {"symmetric", "Poisson map"},
    ("prey", "midpoint"): {"symmetric"},
    ("late", "strang/suzuki4"): {"symmetric", "Poisson map", "keeps C"},
    ("body", "strang"): {"symmetric", "Poisson map", "keeps C"},
    ("body", "midpoint"): {"symmetric", "keeps H", "keeps C"},
    ("body", "darboux:symplectic_euler"): {"Poisson map", "keeps C"},
    ("top", "strang"): {"symmetric", "Poisson map", "keeps C1", "keeps C2"},
    ("top", "rk4"): set(),
}


@pytest.mark.parametrize(("name", "method"), HOLD, ids=["-".join(key) for key in HOLD])
def test_what_is_claimed_holds_and_what_is_not_claimed_does_not(name, method, monkeypatch):
    found = checked(monkeypatch, name, method, 0.05)
    del found["order"]
    held = {each for each, finding in found.items() if finding.claimed}
    assert held == HOLD[name, method]
    assert {each for each, finding in found.items() if finding.verdict == OK} == held
    for finding in found.values():
        assert finding.claimed or finding.verdict == NOT_CLAIMED
        assert not finding.claimed or finding.measured < 0.1 * finding.bound
        assert finding.claimed or finding.measured > 10 * finding.bound


def test_a_method_that_is_lifted_is_checked_too(monkeypatch):
    found = checked(monkeypatch, "body", Lifted(FixedStep("rattle", compiled=False)), 0.05)
    assert [each for each, finding in found.items() if finding.verdict == OK] == ["symmetric", "Poisson map", "keeps C"]


def test_a_map_that_is_poisson_at_the_step_size_alone_falls_short(monkeypatch):
    own = PoissonStep.flow
    other = PoissonStep("rk4", compiled=False)
    monkeypatch.setattr(PoissonStep, "flow", lambda self, ivp, h, n: own(self if abs(h) <= 0.05 else other, ivp, h, n))
    found = checked(monkeypatch, "prey", "strang", 0.05)["Poisson map"]
    assert found.verdict == FALLS_SHORT
    assert "0.05, 0.1, 0.2" in found.note


BOASTS = {
    "lie is not a symmetric method": ("prey", "lie", "symmetric"),
    "rk4 is not a Poisson map": ("body", "rk4", "Poisson map"),
    "midpoint is none for this B": ("prey", "midpoint", "Poisson map"),
    "strang does not keep H": ("body", "strang", "keeps H"),
    "verlet does not keep Casimirs of this B": ("top", "verlet", "keeps C1"),
}


@pytest.mark.parametrize("boast", BOASTS)
def test_a_claim_too_much_falls_short_and_no_other_does(boast, monkeypatch):
    name, method, short = BOASTS[boast]
    if short == "Poisson map":
        monkeypatch.setattr(PoissonStep, "is_poisson", lambda *_: True)
        monkeypatch.setattr(PoissonStep, "keeps", lambda *_: ())
    elif short == "symmetric":
        boasting = replace(parse(method, kind=POISSON).member, symmetric=True)
        monkeypatch.setattr(PoissonStep, "member", property(lambda _: boasting))
    else:
        monkeypatch.setattr(PoissonStep, "keeps", lambda *_: ("energy" if short == "keeps H" else "C1",))
    found = checked(monkeypatch, name, method, 0.05)
    assert [each for each, finding in found.items() if finding.verdict == FALLS_SHORT] == [short]


def spoilt(monkeypatch, change):
    """Plant a fault in the map of strang: ``change(y, h)`` is added to what it gives."""

    def with_a_fault(self, ivp, h, steps, flow=PoissonStep.flow):
        own = flow(self, ivp, h, steps)
        return lambda y: own(y) + change(own(y), h)

    monkeypatch.setattr(PoissonStep, "flow", with_a_fault)


@pytest.mark.parametrize(
    ("change", "short"),
    [
        (lambda z, h: 1e-9 * np.array([z[1], 0.0]), ["symmetric", "Poisson map"]),
        (lambda z, h: 1e-9 * h * z * z, ["symmetric", "Poisson map"]),
        (lambda z, h: 1e-9 * z, ["symmetric"]),
    ],
    ids=["shear", "stretch", "growth, which is a Poisson map"],
)
def test_small_faults_in_the_map_are_found(change, short, monkeypatch):
    spoilt(monkeypatch, change)
    found = checked(monkeypatch, "prey", "strang", 0.1)
    assert [each for each, finding in found.items() if finding.verdict == FALLS_SHORT] == short


def test_the_poisson_defect_is_that_of_the_definition_written_by_hand(monkeypatch):
    found = checked(monkeypatch, "prey", "rk4", 0.02, steps=1)["Poisson map"]

    def rate(y):
        return np.array([y[0] * (y[1] - 2), y[1] * (1 - y[0])])

    def rk4(y, h):
        k1 = rate(y)
        k2 = rate(y + h / 2 * k1)
        k3 = rate(y + h / 2 * k2)
        return y + h / 6 * (k1 + 2 * k2 + 2 * k3 + rate(y + h * k3))

    y0, defects = np.array([6.0, 2.0]), []
    for h in (0.02, 0.04, 0.08):
        D = np.array([(rk4(y0 + 1e-5 * e, h) - rk4(y0 - 1e-5 * e, h)) / 2e-5 for e in np.eye(2)]).T
        defects.append(abs(np.linalg.det(D) * 12.0 - np.prod(rk4(y0, h))))
    assert found.measured == pytest.approx(max(defects), rel=1e-4)


def test_where_the_map_has_no_solution_there_is_a_sentence_and_no_number(monkeypatch):
    def lost(*_):
        raise RunFailed("lost on the way.")

    monkeypatch.setattr(PoissonStep, "flow", lambda *_: lost)
    found = checked(monkeypatch, "prey", "strang", 0.1)
    for each in ("symmetric", "Poisson map"):
        assert math.isnan(found[each].measured)
        assert (found[each].verdict, found[each].note) == (FALLS_SHORT, "lost on the way.")


def test_bounds_follow_the_size_of_the_state(monkeypatch):
    small, large = (
        checked(monkeypatch, initial_value_problem("free_rigid_body", "hlw", y0=[0.6 * size, 0.0, 0.8 * size]), "strang", 0.05 / size)
        for size in (1.0, 1024.0)
    )
    for name, power in {"symmetric": 1, "Poisson map": 1, "keeps C": 2, "keeps H": 2}.items():
        assert large[name].bound == pytest.approx(1024.0**power * small[name].bound, rel=1e-9)
        assert large[name].verdict == small[name].verdict


def test_the_command_checks_claims(daebench, monkeypatch):
    monkeypatch.setattr("daebench.methods.names.PoissonStep", lambda *a, **k: PoissonStep(*a, **k | {"compiled": False}))
    monkeypatch.setattr("daebench.studies.claims.check.study", no_study)
    monkeypatch.setattr(PoissonStep, "is_poisson", lambda *_: True)
    words = ("check", "free_rigid_body", "--h", 0.05, "--steps", 20, "--method", "midpoint", "--anyway", "--json")
    status, out, _ = daebench(*words)
    found = json.loads(out)
    assert (status, found["falls_short"]) == (1, ["Poisson map"])
    assert [row["property"] for row in found["claims"]] == ["order", "symmetric", "Poisson map", "keeps H", "keeps C"]
