"""Symplectic submanifolds, HLW VII.2.3: constrained systems as Poisson systems, the symplectic projection, Lemma 4.9, and splitting."""

from dataclasses import replace
from functools import cache

import definitions
import numpy as np
import pytest
import sympy as sp
from integrating import by_dop853
from ivps import ivp
from measures import error_of
from refusals import refused
from runs import method

from daebench.compiler.definition import source_of
from daebench.diagnostics.poisson import poisson_defect
from daebench.diagnostics.submanifold import as_poisson, symplectic_projection
from daebench.diagnostics.symplecticity import symplecticity_defect, tangent_basis, tangent_map
from daebench.errors import InvalidProblem
from daebench.methods.catalogue import find_problem
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.reference.keep.store import load
from daebench.runs.local_flow import enter, leave, local_flow, structure_matrix
from daebench.runs.make_ivp import make_ivp
from daebench.systems.constrained import Chart, ConstrainedHamiltonian, coordinates

STEP = 1e-30
PENDULUMS = (("planar_pendulum", "rotating"), ("spherical_pendulum", "fig1.2b"), ("double_pendulum", "swing"))


@cache
def local(problem, case):
    """Return a problem in its chart."""
    return make_ivp(source_of(as_poisson(find_problem(problem).define()), problem), case)


def integrated(where, y0, t):
    return by_dop853(lambda _, y: where.value("field", y), y0, t)


def J(d):
    return np.kron([[0, 1], [-1, 0]], np.eye(d))


def chi_derivative(where, y):
    """Return X = chi'(y), momenta first, shape(2d, len(y))."""
    out = leave(where)
    return np.array([np.imag(np.concatenate(out(*np.split(y + 1j * STEP * e, 2)))) / STEP for e in np.eye(len(y))]).T


# ---- (2.22): constrained systems as Poisson systems ----------------------------------------------------------------------


each_pendulum = pytest.mark.parametrize(
    ("problem", "case"),
    [pytest.param(name, case, id=name, marks=[pytest.mark.exhaustive] * (name == "double_pendulum")) for name, case in PENDULUMS],
)


@each_pendulum
def test_the_flow_of_the_poisson_system_mapped_by_the_chart_is_the_certified_one(problem, case):
    above, below = initial_value_problem(problem, case), local(problem, case)
    known = load(f"{problem}-{case}")
    row = 8
    p, q = leave(above)(*np.split(integrated(below, below.y0, known.t[row]), 2))
    assert known.t[row] == 1.0
    assert error_of(q, known.q[row]) < 1e-10
    assert error_of(p, known.p[row]) < 1e-10


@each_pendulum
def test_every_case_is_carried_over_and_its_energy_with_it(problem, case):
    for other in local(problem, case).facts.CASES:
        above, below = initial_value_problem(problem, other), make_ivp(local(problem, case).source, other)
        assert below.parameters == above.parameters
        assert error_of(np.ravel(leave(above)(*np.split(below.y0, 2))), np.ravel(above.start)) < 1e-15
        assert below.value("H", below.y0) == pytest.approx(float(above.value("H", above.p0, above.q0)), rel=1e-14, abs=1e-14)


@each_pendulum
def test_the_structure_matrix_has_the_jacobi_identity_and_inverts_the_two_form_where_it_is_evaluated(problem, case):
    above, below = initial_value_problem(problem, case), local(problem, case)
    y = np.linspace(0.4, 1.3, below.size)
    B = below.value("B", y)
    slope = np.array([np.imag(below.value("B", y + 1j * STEP * e)) / STEP for e in np.eye(len(y))])
    cyclic = np.einsum("mij,mk->ijk", slope, B)
    identity = cyclic + cyclic.transpose(2, 0, 1) + cyclic.transpose(1, 2, 0)
    assert np.abs(identity).max() < 1e-13 * np.abs(cyclic).max() + 1e-15
    X = chi_derivative(above, y)
    assert error_of(B @ X.T @ J(above.d) @ X, np.eye(len(y))) < 1e-13


def test_on_the_sphere_b_and_the_angular_momentum_are_those_of_its_angles():
    sphere = as_poisson(find_problem("spherical_pendulum").define())
    mass, length = sp.symbols("mass length", positive=True)
    turn, theta = sphere.y[1:3]
    assert sp.simplify(sphere.B[0, 1] - 2 * turn / (mass * length**2 * sp.tan(theta))) == 0
    assert sp.simplify(sphere.integrals["L3"] - mass * length**2 * sp.sin(theta) ** 2 * turn) == 0


def test_positions_that_depend_on_eta_too_are_no_obstacle():
    """The plane rotor with angle and rate mixed: xi = theta - omega/2."""
    plain = find_problem("planar_pendulum").define()
    chart = plain.chart
    omega, xi = sp.symbols("omega xi", real=True)
    own = dict(zip([*chart.eta, *chart.xi], [omega, xi + omega / 2], strict=True))
    p, q = ([each.subs(own) for each in part] for part in (chart.p, chart.q))
    mixed = replace(chart, eta=(omega,), xi=(xi,), p=p, q=q, inverse_xi=(chart.inverse_xi[0] - chart.inverse_eta[0] / 2,))
    where = make_ivp(source_of(as_poisson(replace(plain, chart=mixed, closed_form=None)), "mixed"), "rotating")
    other = local("planar_pendulum", "rotating")
    found, known = integrated(where, where.y0, 1.0), integrated(other, other.y0, 1.0)
    assert error_of([found[0], found[1] + found[0] / 2], known) < 1e-10


def test_three_coupled_coordinates_in_different_orders_of_rates_and_places_are_a_poisson_system():
    """A point on the saddle q4 = q1 q2: with rates in another order than places the block A of X^T J X is not symmetric."""
    q, p = coordinates(4)
    x, v = sp.symbols("x1:4", real=True), sp.symbols("v1:4", real=True)
    chart = Chart(
        eta=(v[2], v[0], v[1]),
        xi=x,
        p=(*v, x[1] * v[0] + x[0] * v[1]),
        q=(*x, x[0] * x[1]),
        inverse_eta=(p[2], p[0], p[1]),
        inverse_xi=q[:3],
    )
    saddle = ConstrainedHamiltonian(q=q, p=p, M=sp.eye(4), U=q[3] ** 2 + q[2] * q[0], g=[q[3] - q[0] * q[1]], chart=chart)
    above = make_ivp(source_of(saddle, "saddle"), "", q0=(0.5, 0.4, -0.3, 0.2), p0=(0.7, -0.2, 0.1, 0.18))
    below = make_ivp(source_of(as_poisson(saddle), "saddle_below"), "", y0=(0.1, 0.7, -0.2, 0.5, 0.4, -0.3))
    lam, G = above.value("lam", above.p0, above.q0), above.value("G", above.q0)
    force = -above.value("H_q", above.p0, above.q0) - G.T @ lam
    known = [force[2], force[0], force[1], *above.p0[:3]]
    assert error_of(below.value("field", below.y0), known) < 1e-14
    assert not np.any(below.value("B", below.y0)[3:, 3:])


def test_a_case_in_a_pole_of_the_chart_is_left_out():
    plain = find_problem("spherical_pendulum").define()
    low = type(next(iter(plain.cases.values())))(q=(0, 0, -1), p=(0, 0, 0))
    problem = replace(plain, cases={**plain.cases, "low": low})
    assert list(as_poisson(problem).cases) == ["fig1.1", "fig1.2", "fig1.2b"]


def test_what_is_no_chart_and_what_is_no_integral_is_refused():
    for problem, code in ((definitions.two_spheres(), "as-poisson-without-chart"), ("spherical_pendulum", "as-poisson-of-other-type")):
        with refused(code):
            as_poisson(problem)
    q, p = coordinates(2)
    a, b = sp.symbols("a b", real=True)
    rest = {"q": q, "p": p, "M": sp.eye(2), "U": q[1], "g": [q[0] ** 2 + q[1] ** 2 - 1]}
    flat = Chart(eta=(a,), xi=(b,), p=(0, 0), q=(sp.sin(b), -sp.cos(b)), inverse_eta=(p[0],), inverse_xi=(q[0],))
    with refused("chart-singular-everywhere"):
        as_poisson(ConstrainedHamiltonian(**rest, chart=flat))
    chart = replace(flat, p=(a * sp.cos(b), a * sp.sin(b)))
    with refused("not-a-first-integral", InvalidProblem, where="Lz"):
        as_poisson(ConstrainedHamiltonian(**rest, chart=chart, integrals={"Lz": q[0] * p[1] - q[1] * p[0]}))


# ---- (2.19): the symplectic projection -----------------------------------------------------------------------------------

PLACES = ("stretched-M", "relativistic", "coupled-rods")


@pytest.mark.parametrize("place", PLACES)
def test_the_symplectic_projection_projects_onto_the_tangent_space_and_along_what_is_orthogonal_to_it(place):
    where = ivp(place)
    P, X = symplectic_projection(where, where.p0, where.q0), tangent_basis(where, where.p0, where.q0)
    size = np.linalg.norm(P, 2) ** 2
    assert error_of(P @ P, P) < 1e-14 * size
    assert error_of(P @ X, X) < 1e-14 * size
    assert np.linalg.matrix_rank(P, tol=1e-8) == X.shape[1] == 2 * (where.d - where.m)
    assert np.abs(X.T @ J(where.d) @ (np.eye(2 * where.d) - P)).max() < 1e-14 * size


def test_there_is_no_symplectic_projection_where_the_constraint_loses_rank():
    q, p = coordinates(2)
    cross = ConstrainedHamiltonian(q=q, p=p, M=sp.eye(2), U=q[1], g=[q[0] ** 2 * (q[0] - 1) - q[1] ** 2])
    where = make_ivp(source_of(cross, "cross"), "", q0=(0, 0), p0=(0, 0))
    P = symplectic_projection(where, [1.0, 0.5], [2.0, 2.0])
    assert error_of(P @ P, P) < 1e-13
    with refused("manifold-not-symplectic", says=("cross",)):
        symplectic_projection(where, [1.0, 0.5], [0.0, 0.0])
    for p, code in (
        ([1.0], "initial-value-length"),
        ([1.0, np.nan], "not-finite"),
        (["a", "b"], "not-finite"),
        (1.0, "initial-value-malformed"),
    ):
        with refused(code):
            symplectic_projection(where, p, [2.0, 2.0])


# ---- Lemma 4.9 -----------------------------------------------------------------------------------------------------------


def both_ways(name, h=0.02, steps=3):
    """Return the defect of the two-form on the manifold, the Poisson defect in the chart, and what the first makes the second."""
    where = ivp("spherical-fast")
    flow, y0 = method(name).flow(where, h, steps), np.concatenate(enter(where)(where.p0, where.q0))
    X0 = chi_derivative(where, y0)
    below = local_flow(flow, where)
    T, X1 = tangent_map(flow, where.p0, where.q0, X0), chi_derivative(where, np.real(below(y0)))
    before, change = X0.T @ J(3) @ X0, T.T @ J(3) @ T - X0.T @ J(3) @ X0
    A = np.linalg.lstsq(X1, T, rcond=None)[0]
    known = np.abs(A @ (np.linalg.inv(before) - np.linalg.inv(before + change)) @ A.T).max()
    return symplecticity_defect(flow, where.p0, where.q0, X0), poisson_defect(below, y0, structure_matrix(where)), known


@pytest.mark.parametrize("name", ["rattle", "strang", "rattle/suzuki4", "implicit_euler", "midpoint+symproj", "local:midpoint"])
def test_an_integrator_misses_the_poisson_property_in_the_chart_by_as_much_as_the_two_form_on_the_manifold(name):
    """With A = Phi'(y) and the defect D of the two-form W: A B A^T - B(Phi) = A (W^-1 - (W + D)^-1) A^T."""
    symplectic, poisson, known = both_ways(name)
    if method(name).claims.symplectic:
        assert max(symplectic, poisson) < 1e-13
    else:
        assert symplectic > 1e-6
        assert poisson == pytest.approx(known, rel=1e-8)


# ---- variational splitting (4.7), (4.8) ----------------------------------------------------------------------------------


@cache
def halves():
    """Return the spherical pendulum in its chart with H^[1] = T alone and with H^[2] = U alone."""
    plain = find_problem("spherical_pendulum").define()
    rest = {"q": plain.q, "p": plain.p, "g": plain.g, "parameters": plain.parameters, "cases": plain.cases, "chart": plain.chart}
    T = ConstrainedHamiltonian(**rest, H=sum(x**2 for x in plain.p) / (2 * plain.M[0, 0]))
    U = ConstrainedHamiltonian(**rest, H=plain.U)
    return [make_ivp(source_of(as_poisson(each), name), "fig1.2b") for each, name in ((T, "kinetic"), (U, "potential"))]


@pytest.mark.parametrize(("name", "order"), [("strang", "121"), ("lie", "12"), ("lie_adjoint", "21")], ids=lambda x: x)
def test_constrained_splitting_is_variational_splitting_with_the_kinetic_energy_first(name, order):
    where, h = ivp("spherical-fast"), 0.05
    y = np.concatenate(enter(where)(where.p0, where.q0))
    for part in order:
        y = integrated(halves()[int(part) - 1], y, h / order.count(part))
    p, q = leave(where)(*np.split(y, 2))
    p1, q1 = method(name).flow(where, h, 1)(where.p0, where.q0)
    assert np.abs(np.subtract(p, np.real(p1))).max() < 1e-11
    assert np.abs(np.subtract(q, np.real(q1))).max() < 1e-11
