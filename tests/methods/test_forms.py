"""Forms of the index-reduced equation (1.18): Baumgarte's, the stiff one of a penalty, and local coordinates."""

from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
import uncompiled
from ivps import ivp
from oracles import solution
from runs import ROUND_OFF, defects, method, run, state_error
from scipy.linalg import expm

from daebench.compiler.definition import source_of
from daebench.diagnostics.order import fit_order
from daebench.diagnostics.poisson import poisson_defect
from daebench.diagnostics.reversibility import reversibility_defect
from daebench.diagnostics.symplecticity import symplecticity_defect
from daebench.errors import BadInput, InvalidProblem
from daebench.methods.names import parse
from daebench.runs.local_flow import enter, leave, local_flow, structure_matrix
from daebench.runs.make_ivp import make_ivp
from daebench.runs.request import Request
from daebench.systems.constrained import Case, Chart, ConstrainedHamiltonian, coordinates


def test_options_of_the_forms_are_checked():
    for options in ({"alpha": 0.0}, {"beta": -1.0}, {"alpha": float("nan")}, {"eps": 1.0}):
        with pytest.raises(BadInput):
            parse("baumgarte:midpoint", options)
    with pytest.raises(BadInput, match="alpha"):
        parse("midpoint", {"alpha": 1.0})


# ---- Baumgarte's stabilisation -------------------------------------------------------------------------------------------


def test_baumgarte_draws_the_solution_back_as_a_damped_oscillator():
    where = ivp("spherical-slow")
    off = make_ivp(where.source, "fig1.1", q0=1.005 * where.q0, p0=where.p0 + 0.01 * where.q0)
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
        g = np.abs(ivp("spherical-slow").along("g", found.q)[:, 0])
        grown[name] = g[-300:].max() / g[1:301].max()
    assert grown["rk4"] > 3
    assert grown["baumgarte:rk4"] < 1.1


# ---- a stiff penalty -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("place", ["spherical-fast", "stretched-M", "relativistic"])
@pytest.mark.parametrize("name", ["stiff:midpoint", "stiff:gauss2"])
def test_the_stiff_form_is_integrated_symplectically_with_steps_of_many_periods(name, place):
    where, own = ivp(place), method(name, eps=1e-3)
    assert own.claims.symplectic
    assert own.claims.symmetric
    run(name, where, 0.01, 20, {"eps": 1e-3})
    flow = own.flow(where, 0.01, 5)
    assert symplecticity_defect(flow, where.p0, where.q0, np.eye(2 * where.d)) < 1e-11
    assert reversibility_defect(flow, where.p0, where.q0) < 1e-11


@pytest.mark.parametrize("place", ["spherical-fast", "stretched-M", "relativistic"])
def test_the_stiff_forms_iteration_matrix_is_the_derivative_of_its_right_side(place):
    where, own, s = ivp(place), method("stiff:midpoint", eps=0.3), 1e-30
    files, par = uncompiled.kernel(own, where, "float64", (), count=False).FILES, (*map(np.float64, where.par), (1.0, 1.0), *own.data)
    p, q = where.p0, 1.1 * where.q0
    stiffness = np.array(files.root("daebench.schemes.gauss", "stiffness")(tuple(p), tuple(q), par))
    f = files.root("daebench.schemes.kernels.stiff", "f")
    columns = [np.imag(f(tuple(p.astype(complex)), tuple(q + 1j * s * e), par)[0]) / s for e in np.eye(where.d)]
    assert np.abs(stiffness + np.array(columns).T).max() < 1e-12 * np.abs(stiffness).max()


def test_rk4_on_the_stiff_form_is_not_symplectic():
    where = ivp("spherical-fast")
    flow = method("stiff:rk4", eps=0.1).flow(where, 0.01, 5)
    assert symplecticity_defect(flow, where.p0, where.q0, np.eye(6)) > 1e-7


def test_the_stiff_form_tends_to_the_constrained_motion_as_eps_squared():
    where, (q, _) = ivp("spherical-slow"), solution("spherical-slow", 0.5)
    lam = (where.p0 @ where.p0 - where.q0[2]) / 2
    errors, widths, sizes = [], [], (0.04, 0.02, 0.01)
    for eps in sizes:
        at_rest = make_ivp(where.source, "fig1.1", q0=where.q0 * np.sqrt(1 + eps**2 * lam))
        errors.append(np.abs(run("stiff:midpoint", at_rest, 0.0025, 200, {"eps": eps}, every=0).q[-1] - q).max())
        widths.append(run("stiff:midpoint", where, 0.0025, 200, {"eps": eps}).maxima["g"])
    for found in (errors, widths):
        assert abs(fit_order(sizes, found).slope - 2) < 0.1, found
    assert np.allclose(widths, [2 * eps**2 * lam for eps in sizes], rtol=0.05)


# ---- local coordinates ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("place", ["spherical-fast", "planar"])
def test_the_chart_and_its_inverse_undo_each_other(place):
    where = ivp(place)
    into, out = enter(where), leave(where)
    p, q = out(*into(where.p0, where.q0))
    assert np.abs(np.array(p) - where.p0).max() < 1e-14
    assert np.abs(np.array(q) - where.q0).max() < 1e-15


def test_the_structure_matrix_is_the_inverse_of_x_transposed_j_x():
    where, s = ivp("spherical-fast"), 1e-30
    y = np.concatenate(enter(where)(where.p0, where.q0))
    out, J = leave(where), np.kron([[0, 1], [-1, 0]], np.eye(3))
    X = np.array([np.imag(np.concatenate(out(*np.split(y + 1j * s * e, 2)))) / s for e in np.eye(4)]).T
    assert np.abs(structure_matrix(where)(y) @ (X.T @ J @ X) - np.eye(4)).max() < 1e-14


def test_local_coordinates_keep_the_manifold_and_midpoint_in_them_is_no_poisson_map():
    where, steps = ivp("spherical-fast"), (0.01, 0.005, 0.0025, 0.00125)
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
    where = make_ivp(ivp("spherical-slow").source, "fig1.1", q0=[0, 0, -1], p0=[0.1, 0, 0])
    with pytest.raises(BadInput, match="chart of spherical_pendulum is singular at q"):
        method("local:midpoint").solve(where, Request(value=0.01, steps=3))
    run("midpoint", where, 0.01, 3)


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
    where = make_ivp(source_of(bead(), "bead"), "a")
    local, plain = (run(name, where, 0.01, 50) for name in ("local:gauss3", "gauss3"))
    assert np.abs(local.q[-1] - plain.q[-1]).max() < 1e-11
    assert np.abs(local.p[-1] - plain.p[-1]).max() < 1e-11
    assert local.maxima["g"] < 1e-15
    assert local.maxima["energy"] < 1e-10


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"xi": ()}, "positions minus constraints"),
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


def test_a_problem_without_a_chart_refuses_local_coordinates():
    with pytest.raises(BadInput, match="needs a chart"):
        method("local:midpoint").solve(ivp("double-pendulum"), Request(value=0.01, steps=3))
    with pytest.raises(BadInput, match="declares no chart"):
        enter(ivp("double-pendulum"))
