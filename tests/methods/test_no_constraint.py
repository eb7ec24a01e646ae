"""A Hamiltonian without constraints: each scheme becomes what it then is, against hand-written methods and closed forms."""

import itertools
import subprocess
import sys

import numpy as np
import pytest
import scipy.linalg
import scipy.optimize
import sympy as sp
from measures import error_of

import daebench as package
from daebench.compiler.definition import source_of
from daebench.errors import BadInput
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import method_of
from daebench.runs.make_ivp import make_ivp
from daebench.systems.constrained import Case, ConstrainedHamiltonian, coordinates

EPS = np.finfo(float).eps


def pull(q):
    """Force of the potential of Hénon and Heiles."""
    return -np.array([q[0] + 2 * q[0] * q[1], q[1] + q[0] ** 2 - q[1] ** 2])


def stormer_verlet(p, q, h, force=pull):
    half = p + h / 2 * force(q)
    q = q + h * half
    return half + h / 2 * force(q), q


def symplectic_euler(p, q, h):
    p = p + h * pull(q)
    return p, q + h * p


def drift_kick_drift(p, q, h):
    q = q + h / 2 * p
    p = p + h * pull(q)
    return p, q + h / 2 * p


BY_HAND = {"rattle": stormer_verlet, "symplectic_euler": symplectic_euler, "boris": drift_kick_drift}


@pytest.mark.parametrize("name", BY_HAND, ids=BY_HAND)
def test_a_scheme_for_constraints_is_the_classical_one(name):
    run = package.run("henon_heiles", method=name, case="mixed", h=0.05, steps=400)
    p, q = run.p[0], run.q[0]
    for _ in range(400):
        p, q = BY_HAND[name](p, q, 0.05)
    assert np.abs(np.concatenate([run.p[-1] - p, run.q[-1] - q])).max() < 400 * EPS


def rotating(q):
    """Return A = R (-q2, q1, 0) / 3 of the charged particle in the well, and the gradient of its potential, by hand."""
    A = np.hypot(q[0], q[1]) / 3 * np.array([-q[1], q[0], 0])
    return A, np.array([3 * q[0] ** 2 + 4 * q[0] ** 3 / 5, -3 * q[1] ** 2 + 4 * q[1] ** 3, 4 * q[2] ** 3])


def test_boris_is_the_rotation_of_the_velocity():
    ivp, h, steps = initial_value_problem("charged_particle_in_well"), 0.05, 200
    run = package.run("charged_particle_in_well", method="boris", h=h, steps=steps)
    q, v = ivp.q0, ivp.p0 - rotating(ivp.q0)[0]
    for _ in range(steps):
        q = q + h / 2 * v
        kick, t = -h / 2 * rotating(q)[1], np.array([0, 0, h / 2 * np.hypot(q[0], q[1])])
        minus = v + kick
        v = minus + np.cross(minus + np.cross(minus, t), 2 * t / (1 + t @ t)) + kick
        q = q + h / 2 * v
    assert np.abs(np.concatenate([run.q[-1] - q, run.p[-1] - v - rotating(q)[0]])).max() < 1e-12


def test_boris_is_checked_for_what_it_claims():
    found = package.check("charged_particle_in_well", method="boris", steps=20).set_index("property")
    assert found["verdict"].to_dict() == {
        "order": "ok",
        "symmetric": "ok",
        "symplectic": "not claimed",
        "keeps the volume": "ok",
        "keeps H": "not claimed",
    }


def kepler_by_series(t, e):
    """Position at time t from the perihelion for a semi-axis of 1, by bisection of Kepler's equation."""
    E = scipy.optimize.brentq(lambda E: E - e * np.sin(E) - t, t - 1, t + 1, xtol=1e-15)
    return np.array([np.cos(E) - e, np.sqrt(1 - e * e) * np.sin(E)])


ORDERS = {"lobatto3": 4, "lobatto4": 6, "gauss2": 4, "rattle": 2, "rattle/suzuki4": 4, "strang": 2, "midpoint": 2, "rk4": 4}
ORDERS |= {"symplectic_euler": 1, "symplectic_euler_adjoint": 1, "implicit_euler": 1, "energy_momentum": 2, "livens": 2, "boris": 2}


@pytest.mark.parametrize("name", ORDERS, ids=ORDERS)
def test_orders_on_the_ellipse_of_kepler(name):
    exact, h = kepler_by_series(1.0, 0.6), 1 / 64 if ORDERS[name] > 2 else 1 / 256
    errors = [error_of(package.run("kepler", method=name, h=h / n, t_end=1, every=0).q[-1], exact) for n in (1, 2)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(ORDERS[name], abs=0.15)


@pytest.mark.parametrize(("case", "e"), [("eccentric", 0.6), ("circular", 0.0), ("very_eccentric", 0.9)])
def test_the_closed_form_of_kepler(case, e):
    ivp = initial_value_problem("kepler", case)
    closed_form = ivp.source.derivation.problem.closed_form
    for t in (0.1, 2.0, 9.0):
        q, p = closed_form(t, ivp.q0, ivp.p0, {"mu": 1.0})
        assert error_of(np.array(q, dtype=float), kepler_by_series(t, e)) < 1e-13
        back, _ = closed_form(-t, q, p, {"mu": 1.0})
        assert error_of(np.array(back, dtype=float), ivp.q0) < 1e-13
    with pytest.raises(BadInput, match="is that of ellipses; give a start with H < 0"):
        closed_form(1, (1, 0), (0, 2), {"mu": 1.0})


SOLVERS = ("ida:ode", "cvode:adams", "cvode:bdf", "scipy:DOP853", "scipy:Radau", "heyoka:taylor")


@pytest.mark.sampled(by=lambda case: case.startswith("kepler") or case.endswith(("ida:ode", "heyoka:taylor")))
@pytest.mark.parametrize("name", SOLVERS, ids=SOLVERS)
@pytest.mark.parametrize(("problem", "case"), [("kepler", "eccentric"), ("charged_particle", "helix"), ("charged_particle", "drift")])
def test_solvers_of_odes_follow_the_closed_form(problem, case, name):
    ivp = initial_value_problem(problem, case)
    exact, _ = ivp.source.derivation.problem.closed_form(2.0, ivp.q0, ivp.p0, ivp.parameters)
    run = package.run(problem, case=case, method=name, tol=1e-10, t_end=2)
    assert error_of(run.q[-1], np.array(exact, dtype=float)) < 1e-6


REFUSED = {
    **dict.fromkeys(("ida:index2", "ida:ggl", "ida:baumgarte"), "ida:ode"),
    "shake": "rattle",
    "radau3_ggl": "",
    "rattle_ilves": "",
    "cvode:bdf:projected": "cvode:bdf",
    "midpoint+proj": "+proj",
    "midpoint+symproj": "+symproj",
    "stiff:midpoint": "stiff:",
    "soft:rk4": "soft:",
    "baumgarte:rk4": "baumgarte:",
}
"""Methods that treat constraints, and what each is told to use, or to leave out."""


def test_treatments_of_constraints_are_refused():
    ivp = initial_value_problem("kepler")
    for name, way_out in REFUSED.items():
        refusal = method_of(ivp, name).refusal(ivp)
        assert refusal.startswith(f"{name}: kepler")
        assert way_out in refusal.removeprefix(name), name
    pendulum = initial_value_problem("planar_pendulum")
    assert method_of(pendulum, "boris").refusal(pendulum)


def test_requests_for_constraints_are_refused():
    for given in ({"project": True}, {"on_singular": "continue"}, {"watch": ("manifold",)}):
        with pytest.raises(BadInput, match="without constraints"):
            package.run("kepler", method="rattle", h=0.01, t_end=1, **given)


def chain(n):
    """Return n unit masses on a line, joined to each other and to two walls by springs of stiffness 1."""
    q, p = coordinates(n)
    ends = [sp.Integer(0), *q, sp.Integer(0)]
    U = sum((b - a) ** 2 for a, b in itertools.pairwise(ends)) / 2
    start = Case(q=[sp.Rational(k % 5, 10) for k in range(n)], p=[0] * n)
    return make_ivp(source_of(ConstrainedHamiltonian(q=q, p=p, M=sp.eye(n), U=U, g=[], cases={"a": start}), "chain"), "a")


def test_many_bodies_are_computed_in_loops():
    n, h = 27, 0.05
    ivp = chain(n)
    K = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    p, q = ivp.start
    for _ in range(20):
        p, q = stormer_verlet(p, q, h, lambda q: -K @ q)
    run = package.run(ivp, method="rattle", h=h, steps=20)
    assert np.abs(np.concatenate([run.q[-1] - q, run.p[-1] - p])).max() < 1e-13


def test_small_oscillations_of_the_elastic_pendulum_are_at_the_resonance():
    found = package.modes("elastic_pendulum", methods=["rattle"])
    assert found.frequencies == pytest.approx([np.sqrt(0.75), np.sqrt(3)], rel=1e-12)
    assert found.steps["rattle"] == pytest.approx(2 / np.sqrt(3), rel=1e-3)
    assert list(found.spectra) == ["ode"]


@pytest.mark.parametrize(("case", "energy"), [("regular", 1 / 12), ("mixed", 1 / 8), ("chaotic", 1 / 6)])
def test_energies_of_henon_and_heiles(case, energy):
    ivp = initial_value_problem("henon_heiles", case)
    assert float(ivp.value("H", ivp.p0, ivp.q0)) == pytest.approx(energy, abs=1e-15)


def test_commands_on_a_problem_without_constraints(daebench):
    assert daebench("compare", "kepler", "--methods", "rattle,ida:ode", "--h", 0.05, "--t-end", 3)[0] == 0
    assert daebench("check", "charged_particle")[0] == 0
    assert daebench("diagnose", f"{__file__}:symplectic_euler", "--problem", "henon_heiles")[0] == 2
    assert daebench.error.code == "diagnose-no-constraint"


@pytest.mark.slow
def test_code_in_python_of_a_problem_without_constraints(daebench, folder):
    words = ("--method", "rattle", "--h", "0.01", "--language", "python", "--out", "code")
    assert daebench("generate", "charged_particle_in_well", *words)[0] == 0
    checked = subprocess.run([sys.executable, "check.py"], cwd=folder / "code", capture_output=True, text=True, check=True)
    assert checked.stdout.count("good") == 5
