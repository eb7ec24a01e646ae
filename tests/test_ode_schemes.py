"""Schemes on the index-reduced equation (1.18) and its other forms: orders, claims, projections, and what each is refused for."""

import ctypes
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from oracles import solution
from scenes import scene
from scipy.linalg import expm
from scipy.optimize import root
from tallied import tally

import daebench
from daebench.diagnostics.energy import energy_drift
from daebench.diagnostics.integrals import energy_error
from daebench.diagnostics.order import fit_order
from daebench.diagnostics.poisson import poisson_defect
from daebench.diagnostics.reversibility import reversibility_defect
from daebench.diagnostics.symplecticity import symplecticity_defect, tangent_basis, tangent_map
from daebench.errors import BadInput, InvalidProblem, RunFailed
from daebench.fixed_step import FixedStep
from daebench.local_flow import arctan2, enter, leave, local_flow, structure_matrix
from daebench.method import Request
from daebench.names import parse
from daebench.problem import Case, Chart, ConstrainedHamiltonian, coordinates
from daebench.scene import make_scene, source_of

ROUND_OFF = 1e-12
ORDERS = {"rk4": 4, "midpoint": 2, "gauss2": 4, "gauss3": 6, "gauss4": 8}
PROJECTED = ("midpoint+proj", "rk4+proj", "midpoint+symproj", "gauss2+symproj", "rk4+symproj")
PLACES = ("spherical-fast", "stretched-M", "relativistic", "coupled-rods")


def method(name, **options):
    return replace(parse(name, options), compiled=False)


def run(name, place, h, steps, options=None, **more):
    where = scene(place) if isinstance(place, str) else place
    return method(name, **(options or {})).solve(where, Request(value=h, steps=steps, **more)).complete()


def state_error(name, place, n, T=0.5):
    q, p = solution(place, T)
    found = run(name, place, T / n, n, every=0, watch=())
    return max(np.abs(found.q[-1] - q).max(), np.abs(found.p[-1] - p).max())


def defects(name, place, h=0.01, steps=10, **options):
    """Return the defects of the two-form on the tangent space and of reversal over some steps."""
    where = scene(place)
    flow = method(name, **options).flow(where, h, steps)
    X = tangent_basis(where, where.p0, where.q0)
    return symplecticity_defect(flow, where.p0, where.q0, X), reversibility_defect(flow, where.p0, where.q0)


COUNTS = {2: (32, 64, 128), 4: (32, 64, 128), 6: (12, 16, 24, 32), 8: (8, 10, 12, 16)}


@pytest.mark.parametrize("name", [*ORDERS, *PROJECTED, "local:midpoint", "local:gauss2", "baumgarte:rk4", "midpoint/suzuki4"])
def test_the_order_on_the_fast_pendulum_is_as_claimed(name):
    order = method(name).claims.order
    assert order == ORDERS.get(name, order)
    counts = COUNTS[order]
    errors = [state_error(name, "spherical-fast", n) for n in counts]
    assert abs(fit_order([0.5 / n for n in counts], errors).slope - order) < 0.3, errors


@pytest.mark.parametrize("place", ["stretched-M", "relativistic", "coupled-rods"])
@pytest.mark.parametrize(("name", "order"), [("rk4", 4), ("midpoint", 2), ("gauss2", 4), ("midpoint+symproj", 2)])
def test_the_order_is_kept_for_every_kind_of_hamiltonian(name, order, place):
    errors = [state_error(name, place, n) for n in (8, 16, 32)]
    assert abs(fit_order([0.5 / n for n in (8, 16, 32)], errors).slope - order) < 0.2, errors


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("name", ["midpoint", "gauss2", "gauss3", "midpoint+symproj", "gauss2+symproj"])
def test_symmetric_schemes_return_and_do_not_keep_the_two_form(name, place):
    assert method(name).claims.symmetric
    assert not method(name).claims.symplectic
    two_form, reversal = defects(name, place)
    assert reversal < ROUND_OFF
    assert two_form > 1e-8 or name in ("gauss2", "gauss3", "gauss2+symproj")


@pytest.mark.parametrize("name", ["rk4", "rk4+proj", "rk4+symproj", "midpoint+proj", "baumgarte:midpoint"])
def test_what_is_not_symmetric_does_not_claim_to_be_and_does_not_return(name):
    assert not method(name).claims.symmetric or name == "rk4+symproj"
    assert defects(name, "spherical-fast")[1] > 1e-8


def test_midpoint_on_the_sphere_conserves_q_dot_p_and_angular_momentum_but_not_the_two_form():
    maxima = run("midpoint", "spherical-slow", 0.03, 300, watch=("manifold", "integrals")).maxima
    assert maxima["Gv"] < 1e-15
    assert maxima["L3"] < 1e-15
    assert maxima["g"] > 1e-8
    assert defects("midpoint", "spherical-slow", 0.03)[0] > 1e-7


@pytest.mark.slow
def test_midpoint_has_no_visible_energy_drift_over_a_million_steps_where_se_has_over_a_thousand():
    where = scene("spherical-slow")
    found = []
    for name, steps in (("midpoint", 1000), ("midpoint", 10**6), ("se", 1000)):
        each = FixedStep(name).solve(where, Request(value=0.03, steps=steps, every=steps // 500)).complete()
        found.append((each.maxima["energy"], energy_drift(each.t, energy_error(where, each))))
    (early, _), (late, drift), (_, drift_of_se) = found
    assert late < 1.001 * early < 1e-6
    assert drift.kind == "bounded"
    assert abs(drift.slope) < 4 * drift.slope_error
    assert drift_of_se.slope > 100 * drift_of_se.slope_error


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("name", PROJECTED)
def test_projected_schemes_stay_on_the_manifold(name, place):
    assert method(name).claims.on_manifold
    maxima = run(name, place, 0.02, 30).maxima
    assert maxima["g"] < 1e-14
    assert maxima["Gv"] < 1e-14


def test_symmetric_projection_is_that_of_its_definition():
    where, h = scene("spherical-fast"), 0.02
    plain = method("midpoint").flow(where, h, 1)

    def normal(p, q, w):
        return 2 * q * w[1], 2 * q * w[0] + 2 * p * w[1]

    def off(z):
        p1, q1, w = z[:3], z[3:6], z[6:]
        up = normal(where.p0, where.q0, w)
        p, q = (np.real(x) for x in plain(where.p0 + up[0], where.q0 + up[1]))
        back = normal(p1, q1, w)
        return np.concatenate([p1 - p - back[0], q1 - q - back[1], [q1 @ q1 - 1, 2 * q1 @ p1]])

    start = np.concatenate([*(np.real(x) for x in plain(where.p0, where.q0)), np.zeros(2)])
    expected = root(off, start, tol=1e-14).x
    found = run("midpoint+symproj", where, h, 1)
    assert np.abs(off(np.concatenate([found.p[-1], found.q[-1], expected[6:]]))).max() < 1e-12
    assert np.abs(np.concatenate([found.p[-1], found.q[-1]]) - expected[:6]).max() < 1e-12
    assert np.abs(expected[6:]).max() > 1e-8


@pytest.mark.parametrize("name", ["midpoint", "gauss2", "midpoint+symproj", "midpoint+proj", "stiff:midpoint", "local:midpoint"])
def test_the_tangent_map_by_complex_step_is_that_of_differences(name):
    where, s = scene("spherical-fast"), 1e-5
    flow = method(name, **({"eps": 0.1} if name.startswith("stiff") else {})).flow(where, 0.02, 2)
    x = np.concatenate([where.p0, where.q0])
    X = tangent_basis(where, where.p0, where.q0)

    def at(x):
        return np.real(np.concatenate([np.asarray(part) for part in flow(x[:3], x[3:])]))

    differences = np.array([(at(x + s * e) - at(x - s * e)) / (2 * s) for e in X.T]).T
    found = tangent_map(flow, where.p0, where.q0, X)
    assert np.abs(found - differences).max() < 1e-7
    assert np.abs(found - X).max() > 1e-2


def test_a_step_too_large_for_the_iteration_inside_is_said_and_no_nan_travels():
    for name in ("midpoint", "gauss3", "midpoint+symproj"):
        found = method(name).solve(scene("spherical-fast"), Request(value=1.0, steps=5))
        assert "did not converge" in found.failure or "no longer finite" in found.failure
        assert found.steps == 0
        assert np.all(np.isfinite(found.q))
    with pytest.raises(RunFailed):
        method("midpoint+symproj").flow(scene("spherical-fast"), 1.0, 1)(scene("spherical-fast").p0, scene("spherical-fast").q0)


@pytest.mark.parametrize(
    "name", [*PROJECTED, "se+symproj", "stiff:gauss2", "local:midpoint", "baumgarte:rk4", "midpoint/triple_jump4+proj"]
)
def test_work_is_what_an_independent_tally_counts(name, monkeypatch):
    where, own, request = scene("spherical-fast"), method(name), Request(value=0.002, steps=4, watch=())
    counted = own.solve(where, request).work
    assert counted == tally(monkeypatch, own, where, request)
    assert counted["H_q"] > 0


@pytest.mark.parametrize("light", [sp.Rational(1, 10**8), 10**8], ids=["light", "heavy"])
@pytest.mark.parametrize("name", ["rk4", "midpoint", "gauss2", "midpoint+symproj", "midpoint+proj"])
def test_mass_ratios_of_1e16_change_nothing_of_what_is_not_coupled(name, light):
    def pendulum(*masses):
        q, p = coordinates(2 * len(masses))
        M = sp.diag(*(each for mass in masses for each in (mass, mass)))
        U = sum(mass * q[2 * k + 1] for k, mass in enumerate(masses))
        g = [q[2 * k] ** 2 + q[2 * k + 1] ** 2 - 1 for k in range(len(masses))]
        start = Case(q=(1, 0) * len(masses), p=(0, 0) * len(masses))
        return make_scene(source_of(ConstrainedHamiltonian(q=q, p=p, M=M, U=U, g=g, cases={"a": start}), "pendulums"), "a")

    both, alone = (run(name, pendulum(*masses), 0.02, 20, watch=()) for masses in ((light, 1 / light), (sp.Integer(1),)))
    assert np.abs(both.q[-1] - np.tile(alone.q[-1], 2)).max() < 1e-13
    assert both.pivot > 0.1


def test_baumgarte_draws_the_solution_back_as_a_damped_oscillator():
    where = scene("spherical-slow")
    off = make_scene(where.source, "fig1.1", q0=1.005 * where.q0, p0=where.p0 + 0.01 * where.q0)
    t = 0.5
    for alpha, beta in ((10.0, 10.0), (3.0, 8.0)):
        found = run("baumgarte:rk4", off, t / 400, 400, {"alpha": alpha, "beta": beta}, every=0)
        g, Gv = (float(where.value(name, *x)[0]) for name, x in (("g", (found.q[-1],)), ("Gv", (found.p[-1], found.q[-1]))))
        g0, Gv0 = (float(where.value(name, *x)[0]) for name, x in (("g", (off.q0,)), ("Gv", (off.p0, off.q0))))
        A = np.array([[0, 1], [-(beta**2), -2 * alpha]])
        assert np.abs(expm(A * t) @ [g0, Gv0] - [g, Gv]).max() < 1e-9
        assert abs(g) < abs(g0) / 3


def test_the_drift_that_grows_without_baumgarte_stays_bounded_with_it():
    grown = {}
    for name in ("rk4", "baumgarte:rk4"):
        found = run(name, "spherical-slow", 0.1, 1200)
        g = np.abs(scene("spherical-slow").along("g", found.q)[:, 0])
        grown[name] = g[-300:].max() / g[1:301].max()
    assert grown["rk4"] > 3
    assert grown["baumgarte:rk4"] < 1.1


@pytest.mark.parametrize("place", ["spherical-fast", "stretched-M", "relativistic"])
@pytest.mark.parametrize("name", ["stiff:midpoint", "stiff:gauss2"])
def test_the_stiff_form_is_integrated_symplectically_with_steps_of_many_periods(name, place):
    where, own = scene(place), method(name, eps=1e-3)
    assert own.claims.symplectic
    assert own.claims.symmetric
    run(name, where, 0.01, 20, {"eps": 1e-3})
    flow = own.flow(where, 0.01, 5)
    assert symplecticity_defect(flow, where.p0, where.q0, np.eye(2 * where.d)) < 1e-11
    assert reversibility_defect(flow, where.p0, where.q0) < 1e-11


@pytest.mark.parametrize("place", ["spherical-fast", "stretched-M", "relativistic"])
def test_the_stiff_forms_iteration_matrix_is_the_derivative_of_its_right_side(place):
    where, own, s = scene(place), method("stiff:midpoint", eps=0.3), 1e-30
    kernel, par = own.kernel(where, "float64", (), count=False), (*map(np.float64, where.par), *own.data)
    p, q = where.p0, 1.1 * where.q0
    stiffness = np.array(kernel.gauss_stiffness(tuple(p), tuple(q), par))
    columns = [np.imag(kernel.stiff_f(tuple(p.astype(complex)), tuple(q + 1j * s * e), par)[0]) / s for e in np.eye(where.d)]
    assert np.abs(stiffness + np.array(columns).T).max() < 1e-12 * np.abs(stiffness).max()


def test_rk4_on_the_stiff_form_is_not_symplectic():
    where = scene("spherical-fast")
    flow = method("stiff:rk4", eps=0.1).flow(where, 0.01, 5)
    assert symplecticity_defect(flow, where.p0, where.q0, np.eye(6)) > 1e-7


def test_the_stiff_form_tends_to_the_constrained_motion_as_eps_squared():
    where, (q, _) = scene("spherical-slow"), solution("spherical-slow", 0.5)
    lam = (where.p0 @ where.p0 - where.q0[2]) / 2
    errors, widths, sizes = [], [], (0.04, 0.02, 0.01)
    for eps in sizes:
        at_rest = make_scene(where.source, "fig1.1", q0=where.q0 * np.sqrt(1 + eps**2 * lam))
        errors.append(np.abs(run("stiff:midpoint", at_rest, 0.0025, 200, {"eps": eps}, every=0).q[-1] - q).max())
        widths.append(run("stiff:midpoint", where, 0.0025, 200, {"eps": eps}).maxima["g"])
    for found in (errors, widths):
        assert abs(fit_order(sizes, found).slope - 2) < 0.1, found
    assert np.allclose(widths, [2 * eps**2 * lam for eps in sizes], rtol=0.05)


@pytest.mark.parametrize("place", ["spherical-fast", "planar"])
def test_the_chart_and_its_inverse_undo_each_other(place):
    where = scene(place)
    into, out = enter(where), leave(where)
    p, q = out(*into(where.p0, where.q0))
    assert np.abs(np.array(p) - where.p0).max() < 1e-14
    assert np.abs(np.array(q) - where.q0).max() < 1e-15


def test_the_structure_matrix_is_the_inverse_of_x_transposed_j_x():
    where, s = scene("spherical-fast"), 1e-30
    y = np.concatenate(enter(where)(where.p0, where.q0))
    out, J = leave(where), np.kron([[0, 1], [-1, 0]], np.eye(3))
    X = np.array([np.imag(np.concatenate(out(*np.split(y + 1j * s * e, 2)))) / s for e in np.eye(4)]).T
    assert np.abs(structure_matrix(where)(y) @ (X.T @ J @ X) - np.eye(4)).max() < 1e-14


def test_local_coordinates_keep_the_manifold_and_midpoint_in_them_is_no_poisson_map():
    where, steps = scene("spherical-fast"), (0.01, 0.005, 0.0025, 0.00125)
    maxima = run("local:midpoint", where, 0.02, 100).maxima
    assert max(maxima["g"], maxima["Gv"]) < 1e-14
    y, B = np.concatenate(enter(where)(where.p0, where.q0)), structure_matrix(where)
    found = [poisson_defect(local_flow(method("local:midpoint").flow(where, h, 1), where), y, B) for h in steps]
    assert abs(fit_order(steps, found).slope - 3) < 0.2, found
    two_form, reversal = defects("local:midpoint", "spherical-fast")
    assert two_form > 1e-6
    assert reversal < ROUND_OFF
    exact = poisson_defect(local_flow(method("local:gauss4").flow(where, 0.005, 1), where), y, B)
    assert exact < 1e-10


def test_local_coordinates_go_round_and_round():
    for place in ("planar", "spherical-fast"):
        assert state_error("local:gauss3", place, 250, 5.0) < 1e-6


def test_a_start_where_the_chart_is_singular_is_refused_with_the_place():
    where = make_scene(scene("spherical-slow").source, "fig1.1", q0=[0, 0, -1], p0=[0.1, 0, 0])
    with pytest.raises(BadInput, match="chart of spherical_pendulum is singular at q"):
        method("local:midpoint").solve(where, Request(value=0.01, steps=3))
    run("midpoint", where, 0.01, 3)


def test_arctan2_takes_complex_numbers():
    for x, y in ((1.0, 2.0), (-1.0, 0.5), (-0.3, -2.0), (0.0, 1.0)):
        s = 1e-7
        expected = (np.arctan2(y + 2 * s, x - 3 * s) - np.arctan2(y - 2 * s, x + 3 * s)) / (2 * s)
        found = arctan2(np.complex128(y + 2e-30j), np.complex128(x - 3e-30j))
        assert found.real == np.arctan2(y, x) == arctan2(np.float64(y), np.float64(x))
        assert abs(found.imag / 1e-30 - expected) < 1e-8


def bead(**change):
    """Return a bead on a parabola with a chart of its abscissa and speed, M given in a form that is not diagonal."""
    q, p = coordinates(2)
    s, u = sp.symbols("s u", real=True)
    M = sp.Matrix([[2, sp.Rational(1, 2)], [sp.Rational(1, 2), 1]])
    v = sp.Matrix([u, 2 * s * u])
    inverse = {"inverse_eta": ((M.inv() * sp.Matrix(p))[0],), "inverse_xi": (q[0],)}
    chart = {"eta": (u,), "xi": (s,), "p": tuple(M * v), "q": (s, s**2), **inverse} | change
    start = Case(q=(1, 1), p=tuple(M * sp.Matrix([1, 2])))
    return ConstrainedHamiltonian(q=q, p=p, M=M, U=q[1], g=[q[1] - q[0] ** 2], cases={"a": start}, chart=Chart(**chart))


def test_a_chart_works_with_a_mass_matrix_that_is_not_diagonal():
    where = make_scene(source_of(bead(), "bead"), "a")
    local, plain = (run(name, where, 0.01, 50) for name in ("local:gauss3", "gauss3"))
    assert np.abs(local.q[-1] - plain.q[-1]).max() < 1e-11
    assert np.abs(local.p[-1] - plain.p[-1]).max() < 1e-11
    assert local.maxima["g"] < 1e-15
    assert local.maxima["energy"] < 1e-10


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"xi": ()}, "as many as positions less constraints"),
        ({"q": (1,)}, "1 positions and 2 momenta"),
        ({"eta": (sp.Symbol("s", real=True),)}, "used twice"),
        ({"xi": (coordinates(2)[0][0],)}, "rename it"),
        ({"q": (sp.Symbol("w"), 1)}, "the chart contains w"),
        ({"inverse_xi": (sp.Symbol("s", real=True),)}, "the inverse of the chart contains s"),
    ],
    ids=lambda x: x if isinstance(x, str) else "",
)
def test_a_chart_that_does_not_fit_is_refused(change, words):
    with pytest.raises(InvalidProblem, match=words):
        bead(**change)


def test_a_chart_is_part_of_what_a_definition_is():
    assert bead().fingerprint != replace(bead(), chart=None).fingerprint


def test_options_of_the_forms_are_checked():
    for options in ({"alpha": 0.0}, {"beta": -1.0}, {"alpha": float("nan")}, {"eps": 1.0}):
        with pytest.raises(BadInput):
            parse("baumgarte:midpoint", options)
    with pytest.raises(BadInput, match="alpha"):
        parse("midpoint", {"alpha": 1.0})


def test_a_problem_without_a_chart_refuses_local_coordinates():
    with pytest.raises(BadInput, match="needs a chart"):
        method("local:midpoint").solve(scene("double-pendulum"), Request(value=0.01, steps=3))
    with pytest.raises(BadInput, match="declares no chart"):
        enter(scene("double-pendulum"))


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_rk4_in_c_is_the_same_method(tmp_path):
    library = tmp_path / "rk4.so"
    source = Path(daebench.__file__).with_name("rk4.c")
    subprocess.run(["cc", "-O3", "-Wall", "-Werror", "-shared", "-fPIC", str(source), "-o", str(library), "-lm"], check=True)
    rk4 = ctypes.CDLL(str(library)).rk4
    rk4.restype, rk4.argtypes = ctypes.c_long, [ctypes.c_void_p, *[ctypes.c_double] * 4, ctypes.c_long]
    where = make_scene(scene("spherical-fast").source, "fig1.2b", {"mass": 2.0, "gravity": 9.81})
    state = np.concatenate([where.p0, where.q0])
    assert rk4(state.ctypes.data, *where.par, 0.01, 100) == 100
    found = run("rk4", where, 0.01, 100)
    assert np.abs(state - np.concatenate([found.p[-1], found.q[-1]])).max() < 1e-12


@pytest.mark.slow
@pytest.mark.parametrize("name", ["gauss2", "midpoint+symproj", "stiff:midpoint", "local:midpoint", "baumgarte:rk4"])
def test_machine_code_does_what_the_files_say(name):
    where, request = scene("spherical-fast"), Request(value=0.005, steps=40, watch=("energy", "manifold", "integrals"))
    fast, slow = (replace(parse(name), compiled=compiled).solve(where, request).complete() for compiled in (True, False))
    assert np.abs(fast.q - slow.q).max() < 1e-11
    assert fast.maxima.keys() == slow.maxima.keys()
    single = replace(parse(name), compiled=True).solve(where, replace(request, precision="float32"))
    assert single.failure is None
    assert np.abs(single.q[-1] - slow.q[-1]).max() < 1e-2
