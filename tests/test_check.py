"""Claims held against measurements: what is found, on which bounds, and how the command says so; and the Poisson defect."""

import json
import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import sympy as sp
import uncompiled

from daebench.claims_bench import FALLS_SHORT, NOT_APPLICABLE, NOT_CLAIMED, OK, UNDETERMINED
from daebench.claims_check import check_claims, default_step
from daebench.cli import main
from daebench.diagnostics.order import fit_order
from daebench.diagnostics.poisson import poisson_defect
from daebench.errors import BadInput, RunFailed
from daebench.fixed_step import FixedStep
from daebench.names import parse
from daebench.problem import Case, ConstrainedHamiltonian, coordinates
from daebench.scene import make_scene, source_of

EXACT = ("symmetric", "symplectic", "keeps g", "keeps G H_p", "keeps H")


@pytest.fixture
def plain_motion(monkeypatch):
    """Have reference solutions run uncompiled."""
    monkeypatch.setattr("daebench.pose._module", uncompiled.kept_module)


def checked(monkeypatch, scene, method, h=0.01, *, claims=None, order=False, **more):
    """Return the findings by property, on an uncompiled kernel, of what the method claims or of other claims."""
    if claims is not None:
        monkeypatch.setattr(FixedStep, "claims", property(lambda _: claims))
    if not order:
        monkeypatch.setattr("daebench.claims_check.study", no_study)
    found = check_claims(scene, FixedStep(method, compiled=False), h=h, **{"steps": 60} | more)
    return {each.property: each for each in found}


def no_study(scene, methods, **_):
    raise RunFailed("no study here.")


def two_masses(first, second, *, magnet=0.0):
    """Return a bent double pendulum in the plane with unit rods and these masses, in a magnetic field if there is one."""
    q, p = coordinates(4)
    m1, m2, field = sp.symbols("m1 m2 field", real=True)
    pi = [p[0] + field * q[1], p[1] - field * q[0], p[2], p[3]]
    H = (pi[0] ** 2 + pi[1] ** 2) / (2 * m1) + (pi[2] ** 2 + pi[3] ** 2) / (2 * m2) + m1 * q[1] + m2 * q[3]
    g = [q[0] ** 2 + q[1] ** 2 - 1, (q[2] - q[0]) ** 2 + (q[3] - q[1]) ** 2 - 1]
    a, b = sp.Rational(3, 5), sp.Rational(4, 5)
    velocities = (b, a, b - 2 * a, a + 2 * b)
    start = Case(q=(a, -b, a + b, a - b), p=[m * v for m, v in zip((m1, m1, m2, m2), velocities, strict=True)])
    system = {"H": H} if magnet else {"M": sp.diag(m1, m1, m2, m2), "U": m1 * q[1] + m2 * q[3]}
    values = {m1: first, m2: second} | ({field: magnet} if magnet else {})
    problem = ConstrainedHamiltonian(q=q, p=p, g=g, parameters=values, cases={"bent": start}, **system)
    scene = make_scene(source_of(problem, "two_masses"), "bent")
    if magnet:
        scene = replace(scene, p0=scene.p0 - magnet * np.array([scene.q0[1], -scene.q0[0], 0, 0]))
    return scene


# ---- what is found -------------------------------------------------------------------------------------------------------


def test_rattle_holds_all_that_it_claims_and_its_energy_and_integrals_are_reported(get_scene, monkeypatch):
    found = checked(monkeypatch, get_scene("spherical-fast"), "rattle", 0.004)
    assert [found[name].verdict for name in EXACT] == [OK, OK, OK, OK, NOT_CLAIMED]
    assert found["keeps H"].measured > 1e3 * found["keeps H"].bound
    assert (found["keeps L3"].claimed, found["keeps L3"].verdict) == (None, NOT_CLAIMED)
    assert found["keeps L3"].measured < 1e-13


def test_on_the_manifold_the_poisson_defect_in_the_chart_is_that_of_the_two_form(get_scene, monkeypatch):
    kept = checked(monkeypatch, get_scene("spherical-fast"), "rattle")["Poisson in the chart"]
    assert (kept.claimed, kept.verdict) == (None, NOT_CLAIMED)
    assert kept.measured < 1e-13
    monkeypatch.undo()
    lost = checked(monkeypatch, get_scene("spherical-fast"), "implicit_euler")["Poisson in the chart"]
    assert lost.measured > 1e-3
    monkeypatch.undo()
    assert "Poisson in the chart" not in checked(monkeypatch, get_scene("spherical-fast"), "shake")


def test_the_order_on_the_penalised_system_is_not_held_against_the_constrained_one(get_scene, monkeypatch):
    soft = FixedStep("gauss2", form="stiff", compiled=False)
    found = {each.property: each for each in check_claims(get_scene("planar"), soft, h=0.001, steps=20)}
    assert found["order"].verdict == NOT_APPLICABLE
    assert "penalised" in found["order"].note
    assert found["symplectic"].verdict == OK


def test_what_se_does_not_claim_is_measured_all_the_same(get_scene, monkeypatch):
    found = checked(monkeypatch, get_scene("spherical-slow"), "se", 0.03)
    assert {found[name].verdict for name in EXACT} == {NOT_CLAIMED}
    for name in ("symmetric", "symplectic", "keeps g"):
        assert found[name].measured > 1e4 * found[name].bound
    # on the sphere its drift is purely radial
    assert found["keeps G H_p"].measured < 1e-15


@pytest.mark.parametrize("scheme", ["rattle", "symplectic_euler", "symplectic_euler_adjoint", "implicit_euler", "shake", "se", "seproj"])
@pytest.mark.parametrize("scene", ["spherical-slow", "stretched-M", "relativistic", "coupled-rods"])
def test_no_claim_falls_short_by_rounding_alone(scheme, scene, get_scene, monkeypatch):
    method = FixedStep(scheme, compiled=False)
    if why := method.refusal(get_scene(scene)):
        pytest.skip(why)
    assert {each.verdict for each in checked(monkeypatch, get_scene(scene), scheme).values()} <= {OK, NOT_CLAIMED, UNDETERMINED}


MASSES = [(1e8, 1.0), (1.0, 1e8), (1e-8, 1.0), (1.0, 1e-8), (1e8, 1e8), (1e-8, 1e-8)]


@pytest.mark.parametrize("masses", MASSES, ids=lambda masses: "{:g} over {:g}".format(*masses))
@pytest.mark.parametrize("scheme", ["rattle", "symplectic_euler", "shake"])
def test_heavy_and_light_bodies_raise_no_false_alarm_and_hide_no_fault(scheme, masses, monkeypatch):
    scene = two_masses(*masses)
    found = checked(monkeypatch, scene, scheme)
    assert FALLS_SHORT not in {each.verdict for each in found.values()}
    boast = replace(FixedStep("implicit_euler").claims, symmetric=True, symplectic=True)
    found = checked(monkeypatch, scene, "implicit_euler", claims=boast)
    assert {name for name, each in found.items() if each.verdict == FALLS_SHORT} == {"symmetric", "symplectic"}


def test_roundings_off_the_manifold_that_a_stiff_penalty_amplifies_are_allowed_for(get_scene, monkeypatch):
    monkeypatch.setattr("daebench.claims_check.study", no_study)
    method = FixedStep("midpoint", form="stiff", options={"eps": 1e-5}, compiled=False)
    found = {each.property: each for each in check_claims(get_scene("spherical-slow"), method, h=1e-3, steps=10)}
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
def test_a_claim_too_much_falls_short_and_no_other_does(scheme, boast, short, get_scene, monkeypatch):
    claims = replace(FixedStep(scheme).claims, **boast)
    found = checked(monkeypatch, get_scene("double-pendulum"), scheme, claims=claims)
    assert [name for name, each in found.items() if each.verdict == FALLS_SHORT] == [short]


def test_a_motion_that_is_not_reversed_with_its_momenta_is_not_held_to_that(monkeypatch):
    found = checked(monkeypatch, two_masses(1.0, 2.0, magnet=0.5), "rattle")
    assert found["symmetric"].verdict == NOT_APPLICABLE
    assert "H(-p, q)" in found["symmetric"].note
    assert found["symplectic"].verdict == OK


def test_a_reversal_without_a_solution_is_a_sentence_and_no_number(get_scene, monkeypatch):
    def lost(flow, p, q):
        raise RunFailed("lost on the way back.")

    monkeypatch.setattr("daebench.claims_bench.reversibility_defect", lost)
    found = checked(monkeypatch, get_scene("spherical-slow"), "rattle")["symmetric"]
    assert np.isnan(found.measured)
    assert (found.verdict, found.note) == (FALLS_SHORT, "lost on the way back.")


def test_what_stops_early_or_has_no_claims_is_an_error(get_scene, monkeypatch):
    with pytest.raises(RunFailed, match="stopped at t = "):
        checked(monkeypatch, get_scene("spherical-fast"), "se", 0.1)
    with pytest.raises(BadInput, match="ida:index2 chooses its own steps"):
        check_claims(get_scene("spherical-fast"), parse("ida:index2"), h=0.1)
    with pytest.raises(BadInput, match="shake needs H"):
        checked(monkeypatch, get_scene("stretched-M"), "shake")


# ---- order ---------------------------------------------------------------------------------------------------------------


def test_the_order_is_measured_and_a_false_one_falls_short(get_scene, monkeypatch, plain_motion):
    scene, claims = get_scene("planar"), FixedStep("rattle").claims
    found = checked(monkeypatch, scene, "rattle", order=True, halvings=6)["order"]
    assert (found.claimed, found.verdict) == (2, OK)
    assert abs(found.measured - 2) < 0.1
    assert found.bound == pytest.approx(1.85 - 2 * found.standard_error, abs=1e-15)
    assert found.note.startswith("q: ")
    found = checked(monkeypatch, scene, "rattle", claims=replace(claims, order=3), order=True, halvings=6)["order"]
    assert found.verdict == FALLS_SHORT


class Study:
    """What :func:`daebench.order_study.study` might give: errors of q and p against h."""

    def __init__(self, **errors):
        h = 0.1 * 0.5 ** np.arange(5)
        self.series = [SimpleNamespace(component=name, fit=fit_order(h, error(h))) for name, error in errors.items()]


@pytest.mark.parametrize(
    ("errors", "verdict", "slope"),
    [
        ({"q": lambda h: h**2, "p": lambda h: h**2}, OK, 2),
        ({"q": lambda h: h**2, "p": lambda h: h}, FALLS_SHORT, 1),
        ({"q": lambda h: h**2, "p": lambda h: h**1.86}, OK, 1.86),
        ({"q": lambda h: h**2, "p": lambda h: h**1.84}, FALLS_SHORT, 1.84),
        ({"q": lambda h: h**2, "p": lambda h: 0 * h + 1e-16}, OK, 2),
        ({"q": lambda h: h**2, "lam": lambda h: h}, OK, 2),
        ({"q": lambda h: np.nan * h, "p": lambda h: np.nan * h}, UNDETERMINED, np.nan),
    ],
    ids=["both", "worse counts", "just", "just not", "one known", "multiplier", "none"],
)
def test_the_verdict_on_the_order_is_that_of_the_worse_component(errors, verdict, slope, get_scene, monkeypatch):
    monkeypatch.setattr("daebench.claims_check.study", lambda *_, **__: Study(**errors))
    found = checked(monkeypatch, get_scene("planar"), "rattle", order=True)["order"]
    assert found.verdict == verdict
    assert found.measured == pytest.approx(slope, rel=1e-9, nan_ok=True)
    assert ("daebench order" in found.note) == (verdict == UNDETERMINED)


def test_without_a_reference_the_order_is_undetermined(get_scene, monkeypatch):
    found = checked(monkeypatch, get_scene("planar"), "rattle")["order"]
    assert (found.verdict, found.note) == (UNDETERMINED, "no study here.")


@pytest.mark.parametrize(("name", "low", "high"), [("spherical-slow", 0.005, 0.05), ("spherical-fast", 0.0005, 0.01)])
def test_the_step_size_chosen_is_a_small_round_part_of_the_motion(name, low, high, get_scene, plain_motion):
    h = default_step(get_scene(name))
    assert low <= h <= high
    assert float(f"{h:.0e}"[0]) in (1, 2, 5)
    assert h == pytest.approx(float(f"{h:.0e}"), rel=1e-12)


# ---- the command ---------------------------------------------------------------------------------------------------------


@pytest.fixture
def daebench(monkeypatch, capsys):
    """Run the command line in this process on uncompiled kernels; return exit status, standard output and standard error."""

    def call(*words):
        monkeypatch.setattr(sys, "argv", ["daebench", *map(str, words)])
        monkeypatch.setattr("daebench.names.FixedStep", lambda *a, **k: FixedStep(*a, **k | {"compiled": False}))
        monkeypatch.setattr("daebench.claims_check.study", lambda *_, **__: Study(q=lambda h: h**2, p=lambda h: h**2))
        with pytest.raises(SystemExit) as stop:
            main()
        printed = capsys.readouterr()
        return stop.value.code, printed.out, printed.err

    return call


CHECK = ("check", "spherical_pendulum", "--case", "fig1.1", "--h", 0.03, "--steps", 20, "--method")


def test_the_command_prints_a_row_a_claim_and_exits_0_where_all_hold(daebench):
    status, out, err = daebench(*CHECK, "rattle")
    assert (status, err) == (0, "")
    for name in ("order", *EXACT, "keeps L3"):
        assert name in out
    assert "2.000 ±" in out
    assert FALLS_SHORT not in out


def test_the_command_gives_one_json_object(daebench):
    status, out, _ = daebench(*CHECK, "rattle", "--json")
    found = json.loads(out)
    rows = {row["property"]: row for row in found["claims"]}
    assert (status, found["falls_short"], found["h"], found["steps"]) == (0, [], 0.03, 20)
    assert list(rows) == ["order", *EXACT[:2], "Poisson in the chart", *EXACT[2:], "keeps L3"]
    assert (rows["symplectic"]["claimed"], rows["symplectic"]["verdict"]) == (True, OK)
    assert rows["symplectic"]["measured"] <= rows["symplectic"]["bound"]
    assert (rows["keeps L3"]["claimed"], rows["keeps L3"]["bound"]) == (None, None)


def test_a_false_claim_exits_1_naming_the_property(daebench, monkeypatch):
    claims = replace(FixedStep("se").claims, symplectic=True, order=3)
    monkeypatch.setattr(FixedStep, "claims", property(lambda _: claims))
    status, out, _ = daebench(*CHECK, "se")
    assert status == 1
    assert out.strip().endswith("se falls short of what it claims: order, symplectic.")


@pytest.mark.parametrize(
    ("words", "status", "sentence"),
    [
        (("ida:index2",), 2, "ida:index2 chooses its own steps and makes no claims to check"),
        (("ratle",), 2, "did you mean rattle"),
        (("rattle", "--steps", 0), 2, "needs at least one"),
        (("rattle", "--h", -1), 2, "h = -1 must be greater than 0"),
        (("se", "--h", 10), 1, "se on spherical_pendulum, case fig1.1, stopped at t = "),
    ],
    ids=["no fixed step", "unknown", "no step", "negative", "fails"],
)
def test_what_cannot_be_checked_is_one_sentence(daebench, words, status, sentence):
    found, out, err = daebench(*CHECK, *words)
    assert (found, out) == (status, "")
    assert sentence in err
    assert err.count("\n") == 1


def test_a_method_that_refuses_the_problem_says_why(daebench, monkeypatch):
    monkeypatch.setattr(FixedStep, "refusal", lambda *_: "shake needs what spherical_pendulum does not have; use rattle.")
    assert daebench(*CHECK, "shake") == (2, "", "daebench: shake needs what spherical_pendulum does not have; use rattle.\n")


@pytest.mark.slow
def test_the_command_as_it_is_used_finds_that_rattle_keeps_its_word(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["daebench", "check", "spherical_pendulum", "--method", "rattle"])
    with pytest.raises(SystemExit) as stop:
        main()
    out = capsys.readouterr().out
    assert stop.value.code == 0
    assert out.count(f" {OK} ") + out.count(f" {OK}\n") == 5


# ---- the Poisson defect --------------------------------------------------------------------------------------------------
# Lotka-Volterra, HLW (2.13): u' = u (v - 2), v' = v (1 - u), H_u = 1 - 1/u, H_v = 1 - 2/v

PLACES = [(6.0, 2.0), (0.5, 3.0), (1.0, 1e-3)]


def lotka_volterra(y):
    u, v = y
    return np.array([[0, u * v], [-u * v, 0]])


def symplectic_euler(y, h):
    u, v = y
    u1 = u / (1 - h * (v - 2))
    return np.array([u1, v - h * v * (u1 - 1)])


def adjoint(y, h):
    u, v = y
    v1 = v / (1 + h * (u - 1))
    return np.array([u * (1 + h * (v1 - 2)), v1])


def splitting(y, h):
    u, v = y
    u_half = u * np.exp(h / 2 * (v - 2))
    v1 = v * np.exp(-h * (u_half - 1))
    return np.array([u_half * np.exp(h / 2 * (v1 - 2)), v1])


def midpoint(y, h):
    y1 = np.array(y)
    for _ in range(20):
        u, v = (y + y1) / 2
        f = np.array([u * (v - 2), v * (1 - u)])
        f_y = np.array([[v - 2, u], [-v, 1 - u]])
        y1 = y1 - np.linalg.solve(np.eye(2) - h / 2 * f_y, y1 - y - h * f)
    return y1


@pytest.mark.parametrize("place", PLACES, ids=str)
@pytest.mark.parametrize("step", [symplectic_euler, adjoint, splitting], ids=lambda step: step.__name__)
def test_poisson_maps_have_no_defect(step, place):
    # 64 roundings of the largest entry of B, before or after
    size = max(np.prod(place), np.prod(step(np.array(place), 0.1)))
    assert poisson_defect(lambda y: step(y, 0.1), place, lotka_volterra) < 64 * 2.0**-52 * max(1.0, size)


@pytest.mark.parametrize("place", [(2.0, 2.0), (0.7, 1.2)], ids=str)
def test_implicit_midpoint_is_not_poisson_and_misses_it_by_the_third_power_of_h(place):
    steps = 0.05 * 0.5 ** np.arange(6)
    fit = fit_order(steps, [poisson_defect(lambda y, h=h: midpoint(y, h), place, lotka_volterra) for h in steps])
    assert abs(fit.slope - 3) < 0.03
    assert all(fit.used)


def test_the_defect_of_a_linear_map_is_what_was_planted():
    B = np.array([[0.0, 2.0], [-2.0, 0.0]])
    assert poisson_defect(lambda y: 3.0 * y, [0.3, 0.7], lambda y: B) == pytest.approx(2 * 9 - 2, rel=1e-15)


def test_a_rotation_is_a_poisson_map_of_the_rigid_body_and_a_reflection_is_not():
    def cross(y):
        return np.array([[0, -y[2], y[1]], [y[2], 0, -y[0]], [-y[1], y[0], 0]])

    c, s = np.cos(0.4), np.sin(0.4)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    y = np.array([0.3, -0.8, 0.5])
    assert poisson_defect(lambda y: turn @ y, y, cross) < 1e-15
    assert poisson_defect(lambda y: -turn @ y, y, cross) == pytest.approx(2 * np.max(np.abs(turn @ y)), rel=1e-14)


def test_a_map_that_gives_no_number_has_no_poisson_defect():
    assert np.isnan(poisson_defect(lambda y: y * np.nan, [1.0, 2.0], lotka_volterra))
