"""Splitting, HLW (1.45): flows of the kinetic energy against equations written out by hand, and the schemes made of them."""

from dataclasses import replace

import definitions
import numpy as np
import pytest
import sympy as sp
from ivps import ivp
from measures import error_of
from refusals import refused
from scipy.integrate import solve_ivp

from daebench.compiler.definition import source_of
from daebench.compiler.entry import form_of
from daebench.compiler.trace.ir import FLOAT32, FLOAT64
from daebench.diagnostics.order import fit_order
from daebench.diagnostics.reversibility import reversibility_defect
from daebench.diagnostics.symplecticity import symplecticity_defect, tangent_basis, tangent_map
from daebench.errors import InvalidProblem
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.runs.make_ivp import make_ivp
from daebench.runs.request import Request
from daebench.systems.constrained import KineticFlow, coordinates
from daebench.systems.kinetic_flows import product, rotation, sphere

SPLITTINGS = ("lie", "lie_adjoint", "strang")
PLACES = ("spherical", "two-spheres", "rotation")

pytestmark = pytest.mark.sampled(by=lambda case: "rotation" not in case or "lie" not in case)  # of rotations the gate takes strang


def place(name, **parameters):
    """Return an initial value problem that declares its kinetic flow; the pendulum has a mass and a length that are not 1."""
    if name == "spherical":
        heavy = {"mass": 2.5, "length": 0.8} | parameters
        b = 1.3
        q0 = 0.8 * np.array([np.sin(b), 0, -np.cos(b)])
        return initial_value_problem("spherical_pendulum", "fig1.2b", heavy, q0=q0, p0=[3 * np.cos(b), 6.5, 3 * np.sin(b)])
    definition = {"two-spheres": definitions.two_spheres, "rotation": definitions.rotation_matrix}[name]()
    return make_ivp(source_of(definition, name), next(iter(definition.cases)), parameters)


def free(name):
    """Return the same initial value problem without forces."""
    forces = {"spherical": ["gravity"], "two-spheres": ["gravity", "stiffness"], "rotation": ["gravity"]}[name]
    return place(name, **dict.fromkeys(forces, 0.0))


@pytest.fixture(params=PLACES, ids=PLACES)
def name(request):
    return request.param


@pytest.fixture(params=SPLITTINGS, ids=SPLITTINGS)
def method(request):
    return FixedStep(request.param, compiled=False)


# ---- oracles: Newton's equations by hand ---------------------------------------------------------------------------------


def on_sphere(x, v, acceleration):
    """Acceleration on a sphere about the origin, from x . x'' = -v . v."""
    return acceleration - x * (v @ v + x @ acceleration) / (x @ x)


def pendulum(x, gravity, **_):
    q, v = x[:3], x[3:]
    return np.concatenate([v, on_sphere(q, v, np.array([0, 0, -gravity]))])


def pair(x, stiffness, gravity):
    a, b, v, w = np.split(x, 4)
    down, spring = np.array([0, 0, -gravity]), stiffness * (b - a)
    return np.concatenate([v, w, on_sphere(a, v, spring + down), on_sphere(b, w, down - 2 * spring)])


def top(x, c, gravity):
    """Q' = Q hat(W) and 2 c W' = gravity (Q^T e3) x b, for its three moments of inertia are all 2 c."""
    Q, W = x[:9].reshape(3, 3), x[9:]
    return np.concatenate([(Q @ hat(W)).ravel(), gravity * np.cross(Q[2], [0.6, 0, 0.8]) / (2 * c)])


def hat(W):
    return np.cross(np.eye(3), W)


def exact(ivp, t):
    """Return (p, q) at time t by DOP853."""
    (p0, q0), values = ivp.start, dict(ivp.parameters)

    def integrated(f, x0):
        found = solve_ivp(lambda _, x: f(x, **values), (0, t), x0, method="DOP853", rtol=1e-13, atol=1e-14)
        assert found.success
        return found.y[:, -1]

    if len(q0) == 9:
        X = q0.reshape(3, 3).T @ p0.reshape(3, 3) / values["c"]
        x = integrated(top, [*q0, X[2, 1], X[0, 2], X[1, 0]])
        return values["c"] * (x[:9].reshape(3, 3) @ hat(x[9:])).ravel(), x[:9]
    mass = values["mass"] if len(q0) == 3 else np.repeat([1.0, 0.5], 3)
    x = integrated(pendulum if len(q0) == 3 else pair, [*q0, *p0 / mass])
    return mass * x[len(q0) :], x[: len(q0)]


def flow(ivp, p, q, t):
    """Return (p, q) after the declared flow."""
    dp, dq = ivp.value("kinetic_increment", p, q, (t,))
    return p + dp, q + dq


def apart(x, y):
    return max(np.abs(np.subtract(a, b)).max() for a, b in zip(x, y, strict=True))


# ---- the flow of the kinetic energy --------------------------------------------------------------------------------------


@pytest.mark.parametrize("t", [0.01, 0.7, 2.5, -1.2])
def test_the_kinetic_flow_solves_the_equation_of_free_motion_through_more_than_half_a_turn_too(name, t):
    still = free(name)
    assert apart(flow(still, still.p0, still.q0, t), exact(still, t)) < 1e-11


def test_rattle_without_forces_converges_to_the_kinetic_flow_with_order_2(name):
    still, T, counts = free(name), 0.2, (10, 20, 40, 80)
    ends = [FixedStep("rattle", compiled=False).solve(still, Request(value=T / n, steps=n)).complete() for n in counts]
    errors = [apart((end.p[-1], end.q[-1]), flow(still, still.p0, still.q0, T)) for end in ends]
    assert abs(fit_order([T / n for n in counts], errors).slope - 2) < 0.05
    assert errors[-1] < 1e-3


@pytest.mark.parametrize("number", [np.float64, np.float32, np.complex128])
def test_at_rest_the_kinetic_flow_rests_in_every_number_type(name, number):
    here = place(name)
    par = tuple(map(np.float32 if number is np.float32 else np.float64, here.par))
    kinetic = here.functions("kinetic_increment").kinetic_increment
    given = (number(0),) * here.d, tuple(map(number, here.q0)), (par[0].dtype.type(0.01),), par
    changes = kinetic(*given)
    for x in (*changes[0], *changes[1]):
        assert abs(x) < 1e-36
        assert isinstance(x, complex) == (number is np.complex128)
    (kinds,) = (kinds for form, kinds in kinetic.kinds.items() if form == form_of(given))
    assert set(kinds) == {FLOAT32 if number is np.float32 else FLOAT64}


def test_the_derivative_of_the_kinetic_flow_at_rest_is_that_of_straight_motion(name):
    here = place(name)
    X = tangent_basis(here, 0 * here.p0, here.q0)
    moved = tangent_map(lambda p, q: flow(here, p, q, 0.3), 0 * here.p0, here.q0, X)
    mass = {"spherical": 2.5, "two-spheres": np.repeat([1.0, 0.5], 3), "rotation": 0.75}[name]
    dp, dq = X[: here.d], X[here.d :]
    assert error_of(moved[here.d :].T, dq.T + 0.3 * dp.T / mass) < 1e-15
    assert error_of(moved[: here.d], dp) < 1e-15


def test_a_kinetic_flow_that_does_not_fit_is_refused():
    q, p = coordinates(3)
    rest = {"q": q, "p": p, "M": sp.eye(3), "U": q[2], "g": [sum(x**2 for x in q) - 1]}
    declared = sphere(q, p, mass=1, length=1)
    make = type(definitions.two_spheres())
    assert make(**rest, kinetic_flow=declared).fingerprint != make(**rest).fingerprint
    other = sphere(q, p, mass=1, length=2)
    assert make(**rest, kinetic_flow=declared).fingerprint != make(**rest, kinetic_flow=other).fingerprint
    for flow_, code in (
        (replace(declared, p=declared.p[:2]), "kinetic-flow-sizes"),
        (sphere(q, p, mass=sp.Symbol("m"), length=1), "kinetic-flow-undeclared"),
        (KineticFlow(t=q[0], p=p, q=q), "kinetic-flow-time-taken"),
    ):
        with refused(code, InvalidProblem):
            make(**rest, kinetic_flow=flow_)
    with refused("rotation-entries", InvalidProblem):
        rotation(q, p, c=1)
    with refused("flow-momenta-not-per-position", InvalidProblem):
        sphere(q, p[:2], mass=1, length=1)


def test_a_product_takes_flows_whose_times_have_different_names():
    q, p = coordinates(4)
    s = sp.Symbol("s", real=True)
    first = sphere(q[:2], p[:2], mass=1, length=1)
    second = KineticFlow(t=s, p=p[2:], q=[q[2] + s * p[2], q[3] + s * p[3]])
    both = product(first, second)
    assert [*both.p[:2], *both.q[:2]] == [*first.p, *first.q]
    assert [both.p[3], both.q[3]] == [p[3], q[3] + both.t * p[3]]


# ---- the schemes ---------------------------------------------------------------------------------------------------------


def run(method, ivp, h, steps, **more):
    return method.solve(ivp, Request(value=h, steps=steps, **more)).complete()


def measured_order(method, ivp, T=0.5, counts=(32, 64, 128, 256)):
    p, q = exact(ivp, T)
    ends = [run(method, ivp, T / n, n, watch=()) for n in counts]
    return fit_order([T / n for n in counts], [apart((end.p[-1], end.q[-1]), (p, q)) for end in ends]).slope


def two_form_defect(method, ivp):
    return symplecticity_defect(method.flow(ivp, 0.01, 10), ivp.p0, ivp.q0, tangent_basis(ivp, ivp.p0, ivp.q0))


def test_order_is_as_claimed(method, name):
    assert abs(measured_order(method, place(name)) - method.claims.order) < 0.15


def test_the_two_form_and_the_manifold_are_kept_and_strang_can_be_reversed(method, name):
    here = place(name)
    assert two_form_defect(method, here) < 1e-14
    assert max(run(method, here, 0.004, 100).maxima[each] for each in ("g", "Gv")) < 2e-14
    assert (reversibility_defect(method.flow(here, 0.01, 10), here.p0, here.q0) < 1e-13) == method.claims.symmetric


def test_first_integrals_that_are_linear_in_p_are_kept_to_round_off(method, name):
    maxima = run(method, place(name), 0.01, 200, watch=("integrals",)).maxima
    assert maxima
    assert max(maxima.values()) < 1e-13


def test_lie_and_its_adjoint_are_inverse_to_each_other_in_reversed_time(name):
    here = place(name)
    p, q = FixedStep("lie", compiled=False).flow(here, 0.02, 3)(here.p0, here.q0)
    back = FixedStep("lie_adjoint", compiled=False).flow(here, 0.02, 3)(-np.array(p), q)
    assert apart((-np.array(back[0]), np.array(back[1])), (here.p0, here.q0)) < 1e-13


def test_strang_is_half_a_lie_step_after_half_an_adjoint_one_the_other_way_round(name):
    """Kinetic h/2, potential h/2, potential h/2, kinetic h/2, for flows of the potential add up."""
    here, h = place(name), 0.04
    half = [FixedStep(each, compiled=False).flow(here, 0.5 * h, 1) for each in ("lie", "lie_adjoint")]
    assert apart(half[1](*half[0](here.p0, here.q0)), FixedStep("strang", compiled=False).flow(here, h, 1)(here.p0, here.q0)) < 1e-14


def test_strang_composed_with_suzukis_weights_has_order_4(name):
    method = FixedStep("strang", composition="suzuki4", compiled=False)
    assert abs(measured_order(method, place(name), T=0.4, counts=(8, 16, 32, 64)) - 4) < 0.15
    assert two_form_defect(method, place(name)) < 1e-14


def test_the_potential_flow_is_linear_in_time_with_the_multiplier_of_the_forces_at_rest(name):
    here, h = place(name), 0.05
    p, q = flow(here, here.p0, here.q0, h)
    lam, G, U_q = here.value("lam", 0 * p, q), here.value("G", q), here.value("H_q", p, q)
    p1, q1 = FixedStep("lie", compiled=False).flow(here, h, 1)(here.p0, here.q0)
    assert apart((p1, q1), (p - h * (U_q + G.T @ lam), q)) < 1e-14


def test_compensation_keeps_what_rounding_takes(name):
    method = FixedStep("strang", compiled=False)
    plain, kept = (run(replace(method, compensated=on), place(name), 1e-3, 1500, watch=("integrals",)).maxima for on in (False, True))
    assert sum(kept.values()) < 0.7 * sum(plain.values())


def test_a_step_evaluates_the_forces_once_and_solves_nothing_by_iteration(method, name):
    work = run(method, place(name), 0.01, 7, watch=()).work
    assert work == {"H_p": 7, "H_q": 7, "g": 0, "G": 7, "second": 0, "solve": 7, "newton": 0}


@pytest.mark.parametrize(("where", "why"), [("double-pendulum", "kinetic energy in closed form"), ("stretched-M", "constant M")])
def test_a_problem_that_cannot_be_split_is_refused(method, where, why):
    with refused("method-refuses-problem", says=(method.name, why, where)):
        run(method, ivp(where), 0.01, 1)


LONG = {"spherical": (1_000_000, 1e-14), "two-spheres": (1_000_000, 5e-13), "rotation": (100_000, 1e-13)}


@pytest.mark.sampled(by=lambda case: case == "spherical-with-forces")
@pytest.mark.slow
@pytest.mark.parametrize("forces", [True, False], ids=["with-forces", "free"])
def test_the_manifold_is_kept_over_long_runs(name, forces):
    """G H_p = 0 is met anew in every step; rounding of g = 0 decays on spheres, the faster the faster they turn, and adds up of Q."""
    steps, bound = LONG[name]
    maxima = run(FixedStep("strang"), place(name) if forces else free(name), 0.01, steps, count=False).maxima
    assert maxima["g"] < bound
    assert maxima["Gv"] < 2e-14
