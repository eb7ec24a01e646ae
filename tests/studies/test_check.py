"""Claims held against measurements: what is found, and on which bounds."""

import math
from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
from checks import EXACT, Study
from refusals import refused

from daebench.compiler.definition import source_of
from daebench.errors import RunFailed
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.names import parse
from daebench.runs.make_ivp import make_ivp
from daebench.studies.claims.bench import FALLS_SHORT, NOT_APPLICABLE, NOT_CLAIMED, OK, UNDETERMINED
from daebench.studies.claims.check import check_claims
from daebench.studies.claims.measured_run import default_step
from daebench.systems.constrained import Case, ConstrainedHamiltonian, coordinates


def checked(monkeypatch, ivp, method, h=0.01, *, claims=None, order=False, **more):
    """Return the findings by property, on an uncompiled kernel, of what the method claims or of other claims."""
    if claims is not None:
        monkeypatch.setattr(FixedStep, "claims", property(lambda _: claims))
    if not order:
        monkeypatch.setattr("daebench.studies.claims.check.study", no_study)
    found = check_claims(ivp, FixedStep(method, compiled=False), h=h, **{"steps": 60} | more)
    return {each.property: each for each in found}


def no_study(ivp, methods, **_):
    raise RunFailed("no study here.")


def two_masses(first, second, *, magnet=0):
    """Return a bent double pendulum in the plane with unit rods and these masses, in a magnetic field if there is one."""
    q, p = coordinates(4)
    m1, m2 = sp.symbols("m1 m2", real=True)
    M, U = sp.diag(m1, m1, m2, m2), m1 * q[1] + m2 * q[3]
    A = magnet * sp.Matrix([-q[1], q[0], 0, 0])
    free = sp.Matrix(p) - A
    a, b = sp.Rational(3, 5), sp.Rational(4, 5)
    place = (a, -b, a + b, a - b)
    momenta = M * sp.Matrix([b, a, b - 2 * a, a + 2 * b]) + A.subs(dict(zip(q, place, strict=True)))
    problem = ConstrainedHamiltonian(
        q=q,
        p=p,
        g=[q[0] ** 2 + q[1] ** 2 - 1, (q[2] - q[0]) ** 2 + (q[3] - q[1]) ** 2 - 1],
        parameters={m1: first, m2: second},
        cases={"bent": Case(q=place, p=tuple(momenta))},
        **({"H": (free.T * M.inv() * free)[0] / 2 + U} if magnet else {"M": M, "U": U}),
    )
    return make_ivp(source_of(problem, "two_masses"), "bent")


# ---- what is found -------------------------------------------------------------------------------------------------------


def test_rattle_holds_all_that_it_claims_and_its_energy_and_integrals_are_reported(get_ivp, monkeypatch):
    found = checked(monkeypatch, get_ivp("spherical-fast"), "rattle", 0.004)
    assert [found[name].verdict for name in EXACT] == [OK, OK, OK, OK, NOT_CLAIMED]
    assert found["keeps H"].measured > 1e3 * found["keeps H"].bound
    assert (found["keeps L3"].claimed, found["keeps L3"].verdict) == (None, NOT_CLAIMED)
    assert found["keeps L3"].measured < 1e-13


def test_on_the_manifold_the_poisson_defect_in_the_chart_is_that_of_the_two_form(get_ivp, monkeypatch):
    kept = checked(monkeypatch, get_ivp("spherical-fast"), "rattle")["Poisson in the chart"]
    assert (kept.claimed, kept.verdict) == (None, NOT_CLAIMED)
    assert kept.measured < 1e-13
    monkeypatch.undo()
    lost = checked(monkeypatch, get_ivp("spherical-fast"), "implicit_euler")["Poisson in the chart"]
    assert lost.measured > 1e-3
    monkeypatch.undo()
    assert "Poisson in the chart" not in checked(monkeypatch, get_ivp("spherical-fast"), "shake")


def test_the_order_on_the_penalised_system_is_not_held_against_the_constrained_one(get_ivp, monkeypatch):
    soft = FixedStep("gauss2", form="stiff", compiled=False)
    found = {each.property: each for each in check_claims(get_ivp("planar"), soft, h=0.001, steps=20)}
    assert found["order"].verdict == NOT_APPLICABLE
    assert "penalised" in found["order"].note
    assert found["symplectic"].verdict == OK


ROUNDED = ("spherical-slow-shake", "stretched-M-seproj", "relativistic-symplectic_euler", "coupled-rods-rattle")
"""A scheme on each problem."""


@pytest.mark.sampled(by=lambda case: case in ROUNDED)
@pytest.mark.parametrize("scheme", ["rattle", "symplectic_euler", "symplectic_euler_adjoint", "implicit_euler", "shake", "se", "seproj"])
@pytest.mark.parametrize("ivp", ["spherical-slow", "stretched-M", "relativistic", "coupled-rods"])
def test_no_claim_falls_short_by_rounding_alone(scheme, ivp, get_ivp, monkeypatch):
    method = FixedStep(scheme, compiled=False)
    if why := method.refusal(get_ivp(ivp)):
        pytest.skip(why)
    assert {each.verdict for each in checked(monkeypatch, get_ivp(ivp), scheme).values()} <= {OK, NOT_CLAIMED, UNDETERMINED}


MASSES = [(1e8, 1.0), (1.0, 1e8), (1e-8, 1.0), (1.0, 1e-8), (1e8, 1e8), (1e-8, 1e-8)]


@pytest.mark.sampled(by=lambda case: case in ("1e+08 over 1-rattle", "1 over 1e-08-symplectic_euler"))
@pytest.mark.parametrize(
    ("masses", "scheme"),
    [*zip(MASSES, 2 * ("rattle", "symplectic_euler", "shake"), strict=True)],
    ids=lambda value: value if isinstance(value, str) else "{:g} over {:g}".format(*value),
)
def test_heavy_and_light_bodies_raise_no_false_alarm_and_hide_no_fault(masses, scheme, monkeypatch):
    ivp = two_masses(*masses)
    found = checked(monkeypatch, ivp, scheme)
    assert FALLS_SHORT not in {each.verdict for each in found.values()}
    boast = replace(FixedStep("implicit_euler").claims, symmetric=True, symplectic=True)
    found = checked(monkeypatch, ivp, "implicit_euler", claims=boast)
    assert {name for name, each in found.items() if each.verdict == FALLS_SHORT} == {"symmetric", "symplectic"}


def test_roundings_off_the_manifold_that_a_stiff_penalty_amplifies_are_allowed_for(get_ivp, monkeypatch):
    monkeypatch.setattr("daebench.studies.claims.check.study", no_study)
    method = FixedStep("midpoint", form="stiff", options={"eps": 1e-5}, compiled=False)
    found = {each.property: each for each in check_claims(get_ivp("spherical-slow"), method, h=1e-3, steps=10)}
    assert (found["symmetric"].claimed, found["symmetric"].verdict) == (True, OK)


def test_bounds_scale_with_the_units(monkeypatch):
    small, large = (checked(monkeypatch, two_masses(m, m), "rattle") for m in (1.0, 2.0**20))
    # momenta and energy carry the unit of mass, constraints and velocities do not
    assert large["symmetric"].bound / small["symmetric"].bound > 2.0**18
    assert large["keeps H"].bound == pytest.approx(2.0**20 * small["keeps H"].bound, rel=1e-12)
    assert large["keeps H"].measured == pytest.approx(2.0**20 * small["keeps H"].measured, rel=1e-6)
    for name in ("keeps g", "keeps G H_p"):
        assert large[name].bound == pytest.approx(small[name].bound, rel=1e-12)


@pytest.mark.parametrize(
    ("scheme", "boast", "short"),
    [
        ("se", {"symplectic": True}, "symplectic"),
        ("symplectic_euler", {"symmetric": True}, "symmetric"),
        ("se", {"keeps_g": True}, "keeps g"),
        ("shake", {"keeps_Gv": True}, "keeps G H_p"),
        ("rattle", {"conserves_energy": True}, "keeps H"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_claim_too_much_falls_short_and_no_other_does(scheme, boast, short, get_ivp, monkeypatch):
    claims = replace(FixedStep(scheme).claims, **boast)
    found = checked(monkeypatch, get_ivp("double-pendulum"), scheme, claims=claims)
    assert [name for name, each in found.items() if each.verdict == FALLS_SHORT] == [short]


def test_a_motion_that_is_not_reversed_with_its_momenta_is_reversed_by_a_step_back(monkeypatch):
    found = checked(monkeypatch, two_masses(1.0, 2.0, magnet=sp.Rational(1, 2)), "rattle")
    assert (found["symmetric"].verdict, found["symplectic"].verdict) == (OK, OK)
    lopsided = checked(monkeypatch, two_masses(1.0, 2.0, magnet=sp.Rational(1, 2)), "symplectic_euler")["symmetric"]
    assert lopsided.measured > 1e3 * lopsided.bound


def test_a_reversal_without_a_solution_is_a_sentence_and_no_number(get_ivp, monkeypatch):
    def lost(*_):
        raise RunFailed("lost on the way back.")

    monkeypatch.setattr("daebench.studies.claims.constrained.reversibility_defect", lost)
    found = checked(monkeypatch, get_ivp("spherical-slow"), "rattle")["symmetric"]
    assert np.isnan(found.measured)
    assert (found.verdict, found.note) == (FALLS_SHORT, "lost on the way back.")


def test_what_stops_early_or_has_no_claims_is_an_error(get_ivp, monkeypatch):
    with refused("run-stopped-early", RunFailed):
        checked(monkeypatch, get_ivp("spherical-fast"), "se", 0.1)
    with refused("own-steps-where-fixed-needed"):
        check_claims(get_ivp("spherical-fast"), parse("ida:index2"), h=0.1)
    with refused("method-refuses-problem"):
        checked(monkeypatch, get_ivp("stretched-M"), "shake")


# ---- order ---------------------------------------------------------------------------------------------------------------


def test_the_order_is_measured_and_a_false_one_falls_short(get_ivp, monkeypatch, plain_functions):
    ivp, claims = get_ivp("planar"), FixedStep("rattle").claims
    found = checked(monkeypatch, ivp, "rattle", order=True, halvings=6)["order"]
    assert (found.claimed, found.verdict) == (2, OK)
    assert abs(found.measured - 2) < 0.1
    assert found.bound == pytest.approx(1.85 - 2 * found.standard_error, abs=1e-15)
    assert found.note.startswith("q: ")
    found = checked(monkeypatch, ivp, "rattle", claims=replace(claims, order=3), order=True, halvings=6)["order"]
    assert found.verdict == FALLS_SHORT


UNKNOWN = math.nan
OF_ORDER = {
    "both": ({"q": 2, "p": 2}, OK, 2),
    "worse counts": ({"q": 2, "p": 1}, FALLS_SHORT, 1),
    "just": ({"q": 2, "p": 1.86}, OK, 1.86),
    "just not": ({"q": 2, "p": 1.84}, FALLS_SHORT, 1.84),
    "one known": ({"q": 2, "p": 0}, OK, 2),
    "multiplier": ({"q": 2, "lam": 1}, OK, 2),
    "none": ({"q": UNKNOWN, "p": UNKNOWN}, UNDETERMINED, UNKNOWN),
}
"""Orders of components, 0 for an error of round-off; the verdict and the order found."""


@pytest.mark.parametrize(("orders", "verdict", "slope"), OF_ORDER.values(), ids=OF_ORDER)
def test_the_verdict_on_the_order_is_that_of_the_worse_component(orders, verdict, slope, get_ivp, monkeypatch):
    errors = {name: lambda h, p=p: h**p if p else 0 * h + 1e-16 for name, p in orders.items()}
    monkeypatch.setattr("daebench.studies.claims.check.study", lambda *_, **__: Study(**errors))
    found = checked(monkeypatch, get_ivp("planar"), "rattle", order=True)["order"]
    assert found.verdict == verdict
    assert found.measured == pytest.approx(slope, rel=1e-9, nan_ok=True)


@pytest.mark.parametrize(("name", "low", "high"), [("spherical-slow", 0.005, 0.05), ("spherical-fast", 0.0005, 0.01)])
def test_the_step_size_chosen_is_a_small_round_part_of_the_motion(name, low, high, get_ivp, plain_functions):
    h = default_step(get_ivp(name))
    assert low <= h <= high
    assert h == pytest.approx(float(f"{h:.0e}"), rel=1e-12)
    assert f"{h:.0e}"[0] in "125"
