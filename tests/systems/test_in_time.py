"""Systems in time and under forces without potential: truth in a minimal coordinate, the balance of energy, claims, and bad input."""

import dataclasses
from functools import cache

import numpy as np
import pytest
import sympy as sp
from integrating import by_dop853
from measures import error_of
from refusals import refused

import daebench
from daebench.cli.summary import summary_of
from daebench.diagnostics.negative_damping import negative_damping
from daebench.errors import InvalidProblem
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.warnings_on_runs import doubts_at_start
from daebench.runs.request import Request
from daebench.studies.claims.check import check
from daebench.systems.constrained import Case, ConstrainedHamiltonian

x, y, px, py, vx, vy, t = sp.symbols("x y px py vx vy t", real=True)
gravity, c = sp.symbols("gravity c", real=True)
PIVOT = sp.sin(3 * t) / 5
DRAG = (-c * vx, -c * vy)
TWIST = (-c * vx + y / 3, -c * vy * vx**2 + t / 10)
T_END = 2.0


def pendulum(form, force=None, **more):
    """Return a pendulum of unit mass whose pivot is moved along x, as H(p, q) or with a mass matrix that is solved with."""
    M, p = sp.Matrix([[1, x / 9], [x / 9, 1 + sp.sin(t) / 3]]), sp.Matrix([px, py])
    energy = {
        "H": {"H": (px**2 + py**2) / 2 + gravity * y},
        "diagonal": {"M": sp.eye(2), "U": gravity * y},
        "mass": {"M": M, "U": gravity * y},
        "inverted": {"H": (p.T * M.inv() * p)[0] / 2 + gravity * y},
    }[form]
    start = (sp.Rational(3, 5), sp.Rational(1, 15) if form in ("mass", "inverted") else 0)
    settings = {"t": t, "parameters": {gravity: 9.81, c: 0.3}, "cases": {"a": Case(q=(1, 0), p=start)}} | more
    return ConstrainedHamiltonian(q=(x, y), p=(px, py), v=(vx, vy), g=[(x - PIVOT) ** 2 + y**2 - 1], force=force, **energy, **settings)


@cache
def truth(force):
    """Return x and y at the end, from the angle theta: x = s + sin theta, y = -cos theta, integrated by SciPy."""
    pushed = sp.lambdify((x, y, vx, vy, t, c), force or (0, 0))

    def rate(time, z):
        s, s_t, s_tt = np.sin(3 * time) / 5, 0.6 * np.cos(3 * time), -1.8 * np.sin(3 * time)
        sine, cosine = np.sin(z[0]), np.cos(z[0])
        F = pushed(s + sine, -cosine, s_t + cosine * z[1], sine * z[1], time, 0.3)
        return [z[1], (F[0] - s_tt) * cosine + (F[1] - 9.81) * sine]

    angle, _ = by_dop853(rate, [np.pi / 2, 0.0], T_END)
    return np.array([np.sin(3 * T_END) / 5 + np.sin(angle), -np.cos(angle)])


@pytest.mark.sampled(by=lambda case: case.startswith("ida:index2"))
@pytest.mark.parametrize("force", [TWIST], ids=["driven_and_forced"])
@pytest.mark.parametrize(
    ("method", "setting", "within"),
    [
        ("lobatto4", {"h": 0.01}, 3e-9),
        ("ida:index3", {"tol": 1e-7}, 3e-3),
        ("ida:index2", {"tol": 1e-9}, 1e-6),
        ("ida:index1", {"tol": 1e-9}, 1e-6),
        ("ida:ggl", {"tol": 1e-9}, 1e-6),
        ("ida:baumgarte", {"tol": 1e-9}, 1e-6),
        ("ida:ode", {"tol": 1e-9}, 1e-6),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_driven_pendulum_is_that_of_its_angle(method, setting, within, force):
    """The angle's equation is derived by hand and solved by SciPy: nothing of it is shared with what is tested."""
    run = daebench.run(pendulum("diagonal", force), method=method, t_end=T_END, **setting).complete()
    assert run.q[-1, 2] == pytest.approx(T_END, rel=1e-12)
    assert error_of(run.q[-1, :2], truth(force)) < within


@pytest.mark.sampled(left_out=("driven",))
@pytest.mark.parametrize("force", [None, TWIST], ids=["driven", "forced"])
def test_a_mass_matrix_that_is_solved_with_gives_what_its_inverse_gives(force):
    """With a mass matrix in q and t: the one derivation never inverts it, the other has it inverted in H."""
    for method in ("rattle", "radau2_ggl", *(() if force else ("energy_momentum", "generalized_alpha"))):
        scheme, request = FixedStep(method, compiled=False), Request(value=0.02, steps=8)
        by_mass, inverted = (scheme.solve(initial_value_problem(pendulum(form, force)), request) for form in ("mass", "inverted"))
        np.testing.assert_allclose(by_mass.q, inverted.q, atol=3e-13, rtol=0, err_msg=method)
        np.testing.assert_allclose(by_mass.p, inverted.p, atol=3e-12, rtol=0, err_msg=method)


def test_the_multiplier_of_positions_does_not_act_on_the_time():
    """Of GGL it is mu that moves positions: the time, which has no mass, goes on by h in each step, and the order is that of the scheme."""
    scheme, ivp, errors = FixedStep("radau2_ggl", compiled=False), initial_value_problem(pendulum("diagonal", TWIST)), []
    for steps in (50, 100):
        run = scheme.solve(ivp, Request(value=T_END / steps, steps=steps, every=0))
        assert run.q[-1, 2] == pytest.approx(T_END, rel=1e-14)
        errors.append(error_of(run.q[-1, :2], truth(TWIST)))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(3, abs=0.3)


def test_the_energy_received_is_the_work_of_driver_and_force():
    """Work is integrated beside the motion by SciPy, along the run of a method of order 6."""
    problem = pendulum("diagonal", TWIST)
    run = daebench.run(problem, method="lobatto4", h=0.005, t_end=T_END, every=1)
    ivp = initial_value_problem(problem)
    q, p = run.q, run.p
    lam = ivp.along("lam", p, q)[:, 0]
    slope = -1.2 * np.cos(3 * run.t) * (q[:, 0] - np.sin(3 * run.t) / 5)  # g_t
    forces = sp.lambdify((x, y, vx, vy, t, c), TWIST)(*q[:, :2].T, *p[:, :2].T, run.t, 0.3)
    power = lam * slope + np.sum(forces * p[:, :2].T, axis=0)
    step = run.t[1] - run.t[0]
    work = step / 3 * (power[0] + power[-1] + 4 * power[1:-1:2].sum() + 2 * power[2:-1:2].sum())
    energy = (p[:, :2] ** 2).sum(axis=1) / 2 + 9.81 * q[:, 1]
    received = energy[-1] - energy[0]
    assert abs(received) > 0.1
    assert received == pytest.approx(-p[-1, 2], abs=1e-9)
    assert received == pytest.approx(work, abs=1e-6)


def test_the_summary_of_a_run_has_its_energy_and_what_it_received():
    """H at the end is K less p_t."""
    ivp = initial_value_problem(pendulum("H"))
    run = FixedStep("rattle", compiled=False).solve(ivp, Request(value=0.05, steps=10, every=0))
    told = summary_of(ivp, run, compensated=False)
    assert told["energy"] == pytest.approx((run.p[-1, :2] ** 2).sum() / 2 + 9.81 * run.q[-1, 1], abs=1e-7)
    assert told["energy_received"] == pytest.approx(-run.p[-1, 2], rel=1e-8)


def test_what_is_symplectic_stays_symplectic_in_time():
    """Order, symmetry by steps back in time, and the two-form in extended phase space."""
    table = check(pendulum("H"), method="rattle", h=0.02).set_index("property")
    assert (table.loc[["order", "symmetric", "symplectic", "keeps g", "keeps G H_p"], "verdict"] == "ok").all(), table


def test_a_damped_motion_is_not_called_symplectic_and_conformal_rattle_contracts_as_it_does():
    """RATTLE contracts the two-form up to h^2 only, conformal RATTLE to round-off; a twisting force is no such damping."""
    damped = pendulum("H", DRAG)
    conformal, plain = (check(damped, method=name, h=0.05).set_index("property") for name in ("rattle_conformal", "rattle"))
    assert (conformal.loc[["order", "symmetric", "contracts the two-form"], "verdict"] == "ok").all(), conformal
    assert "symplectic" not in plain.index
    assert plain.loc["contracts the two-form", "measured"] > 1e3 * plain.loc["contracts the two-form", "bound"]
    with refused("method-refuses-problem", says=["rattle_conformal", "F = -c p"]):
        daebench.run(pendulum("H", TWIST), method="rattle_conformal", h=0.01, t_end=0.1)


def test_energy_momentum_keeps_the_balance_of_energy():
    """K is constant to round-off though energy comes and goes."""
    run = daebench.run(pendulum("mass", TWIST), method="energy_momentum", h=0.02, t_end=T_END)
    assert abs(run.p[-1, 2]) > 0.1
    assert run.maxima["energy"] < 1e-12


@pytest.mark.parametrize(
    ("change", "code", "names"),
    [
        ({"t": None}, "symbol-undeclared", ["g", "t"]),
        ({"force": (sp.Symbol("lam", real=True), 0)}, "symbol-undeclared", ["force", "lam"]),
        ({"force": (vx,)}, "entries-not-per-position", ["force", "1", "2"]),
        ({"v": (vx,)}, "entries-not-per-position", ["v", "1"]),
        ({"t": x}, "name-stands-for-two", ["x"]),
        ({"t": sp.Symbol("t", positive=True)}, "symbol-assumed-too-much", ["the time t", "positive"]),
        ({"force": (sp.Abs(vx), 0)}, "function-not-differentiable", ["force[0]", "Abs(vx)"]),
        ({"force": "drag"}, "not-a-sequence", ["force", "'drag'"]),
    ],
)
def test_mistakes_in_time_and_force_are_told_in_a_sentence(change, code, names):
    """Each names the part and what to do."""
    with refused(code, InvalidProblem, names):
        dataclasses.replace(pendulum("H"), **change)


def test_shake_refuses_a_system_in_time():
    """Its momenta are differences of positions: it has no place for the energy received."""
    with refused("method-refuses-problem", says=["shake", "rattle"]):
        daebench.run(pendulum("H"), method="shake", h=0.01, t_end=0.1)


def test_a_start_may_leave_out_the_time_and_its_conjugate():
    """Positions are given as they are declared."""
    ivp = initial_value_problem(pendulum("H"), q0=[0.0, -1.0], p0=[0.6, 0.0])
    assert ivp.q0.tolist() == [0.0, -1.0, 0.0]
    with refused("initial-value-length", says=["q0", "2"]):
        initial_value_problem(pendulum("H"), q0=[0.0], p0=[0.6, 0.0])


SIGNS = {
    "drag": (DRAG, {}, 0),
    "fed": (DRAG, {c: -0.3}, 0.3),
    "fed along y alone": ((-c * vx, c * vy), {}, 0.3),
    "fed along x alone": ((c * vx, -c * vy), {}, 0),  # which the pendulum at (1, 0) does not move along
    "gyroscopic": ((vy, -vx), {}, 0),
    "twist": (TWIST, {}, 0),
    "thrust": ((y / 3, x), {}, 0),
}


@pytest.mark.parametrize(("force", "changed", "power"), SIGNS.values(), ids=SIGNS)
def test_negative_damping_is_found_where_the_motion_is_free(force, changed, power):
    ivp = initial_value_problem(pendulum("diagonal", force, parameters={gravity: 9.81, c: 0.3} | changed))
    assert negative_damping(ivp) == pytest.approx(power, abs=1e-14)


@pytest.mark.parametrize("damping", [0.3, -0.3])
def test_a_run_under_negative_damping_is_allowed_and_it_is_said(damping):
    ivp = initial_value_problem(pendulum("H", DRAG, parameters={gravity: 9.81, c: damping}))
    assert FixedStep("rattle", compiled=False).solve(ivp, Request(value=0.01, steps=10, every=1)).failure is None
    assert len(doubts_at_start(ivp)) == (damping < 0)
