"""IDA, CVODE and SciPy's solvers on Poisson systems: accuracy, Casimir functions, exact counts, and what they say when they fail."""

import re
from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest
from measures import error_of, jacobian_defect, residual
from poisson_motions import BY_HAND, body, ivp_of, plain_module, solution, three
from scipy.integrate import solve_ivp

from daebench.errors import BadInput, DaebenchError, RunFailed
from daebench.methods.formulations import poisson as posing
from daebench.methods.formulations.poisson import pose_poisson
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import POISSON
from daebench.methods.names import parse as parse_name
from daebench.runs.request import Request

parse = partial(parse_name, kind=POISSON)
NAMES = [method.name for method in POISSON.listed() if method.knob == "tol"]
ONE_EACH = ["ida:casimirs", "ida:ode", "cvode:adams", "scipy:RK45", "scipy:LSODA"]
END = Request(value=1e-8, t_end=2.0, points=3)


@pytest.fixture(autouse=True)
def plain(monkeypatch, request):
    if "compiled" not in request.fixturenames:
        monkeypatch.setattr(posing, "_module", plain_module)


# ---- what is posed -------------------------------------------------------------------------------------------------------

POSED = [
    (name, formulation, multipliers)
    for name in BY_HAND
    for formulation, multipliers in (("ode", "plain"), ("casimirs", "plain"), ("casimirs", "derivative"))
    if formulation == "ode" or name in ("body", "top", "three")
]


@pytest.mark.parametrize("name", BY_HAND)
def test_the_right_side_is_the_one_written_by_hand(name, random):
    dae = pose_poisson(ivp_of(name), "ode")
    y, out = dae.y0 * (1 + 0.1 * random.random(dae.n)), np.empty(dae.n)
    assert dae.rhs(0.0, y, out, dae.par) == 1.0
    assert np.allclose(out, BY_HAND[name](y), rtol=1e-12, atol=1e-12 * np.abs(out).max())


@pytest.mark.parametrize(("name", "formulation", "multipliers"), POSED, ids=["-".join(each) for each in POSED])
def test_the_start_is_consistent_and_jacobians_are_those_of_the_residual(name, formulation, multipliers):
    dae = pose_poisson(ivp_of(name), formulation, multipliers=multipliers)
    assert np.abs(residual(dae, dae.y0, dae.yp0)).max() <= 1e-14 * np.abs(dae.yp0).max()
    assert jacobian_defect(dae) < 1e-8


def test_the_residual_with_casimirs_has_a_multiplier_along_each_gradient():
    dae = pose_poisson(ivp_of("body"), "casimirs")
    y, mu, rate, start = np.array([0.3, -0.2, 0.9]), 0.7, np.array([0.1, 0.2, 0.3]), ivp_of("body").y0
    found = residual(dae, np.append(y, mu), np.append(rate, 0.0))
    assert error_of(found, [*(rate - body(y) - mu * y), (y @ y - start @ start) / 2]) < 1e-15


# ---- what comes out ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [*NAMES, "ida:casimirs:atol"])
def test_method_follows_the_motion_written_by_hand(name):
    for problem, t, bound in (("body", 2.0, 2e-6), ("top", 2.0, 2e-6), ("three", 1.5, 3e-5)):
        trajectory = parse(name).solve(ivp_of(problem), replace(END, t_end=t)).complete()
        assert error_of(trajectory.y[-1], solution(problem, t)) < bound


@pytest.mark.parametrize("name", ["ida:ode", "cvode:bdf", "scipy:DOP853"])
def test_a_lattice_is_solved_too(name):
    trajectory = parse(name).solve(ivp_of("lattice"), replace(END, t_end=0.005)).complete()
    assert error_of(trajectory.y[-1], solution("lattice", 0.005)) < 1e-5


def test_maxima_are_those_of_their_formulas():
    trajectory = parse("scipy:RK45").solve(ivp_of("top"), Request(value=1e-6, t_end=1.5, points=7))
    y, Gamma = trajectory.y[:, :3], trajectory.y[:, 3:]
    H = (y**2 / [1.0, 1.0, 0.5]).sum(axis=1) / 2 + Gamma[:, 0]
    errors = {"energy": H, "C1": (Gamma**2).sum(axis=1) / 2, "C2": (y * Gamma).sum(axis=1)}
    assert trajectory.maxima.keys() == errors.keys()
    for each, values in errors.items():
        assert trajectory.maxima[each] == pytest.approx(error_of(values, values[0]), abs=1e-14)


def test_a_smaller_tolerance_holds_the_casimir_closer():
    for tol in (1e-6, 1e-9, 1e-12):
        assert parse("ida:casimirs").solve(ivp_of("top"), replace(END, value=tol)).maxima["C2"] < 5 * tol


# ---- stopping early ------------------------------------------------------------------------------------------------------


@cache
def blow_up():
    """The time at which the three species reach infinity, with the length of the path as the independent variable."""

    def field(_, state):
        rate = three(state[:3])
        return np.append(rate, 1.0) / (1.0 + np.linalg.norm(rate))

    found = solve_ivp(field, (0, 1e12), [*ivp_of("three").y0, 0.0], method="DOP853", rtol=1e-12, atol=1e-12)
    return found.y[3, -1]


@pytest.mark.parametrize("name", ONE_EACH[1:])
def test_a_blow_up_is_a_failure_with_the_time_reached(name, capfd):
    trajectory = parse(name).solve(ivp_of("three"), Request(value=1e-7, t_end=3.0))
    assert blow_up() == pytest.approx(1.7479, abs=1e-5)
    assert re.search(r"t = 1\.74\d+ of 3", trajectory.failure)
    with pytest.raises(RunFailed):
        trajectory.complete()
    assert trajectory.t[-1] == pytest.approx(blow_up(), abs=1e-4)
    assert trajectory.steps < 20_000
    assert np.isfinite([*trajectory.y.flat, *trajectory.maxima.values()]).all()
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("name", ["ida:ode", "cvode:adams", "scipy:RK23"])
def test_a_state_that_leaves_the_domain_ends_the_run_before_it_is_kept(name):
    ivp = initial_value_problem("lotka_volterra", "6,2", y0=[30.0, 30.0])
    trajectory = parse(name).solve(ivp, Request(value=1e-2, t_end=100.0, points=1001))
    assert "the domain u > 0 and v > 0" in trajectory.failure
    assert f"t = {trajectory.t[-1]:.9g} of" in trajectory.failure
    assert np.all(trajectory.y > 0)
    assert 0 < trajectory.t[-1] < 100
    assert np.isfinite(trajectory.maxima["energy"])


# ---- requests and names --------------------------------------------------------------------------------------------------


def test_systems_without_casimir_functions_are_refused_with_a_way_out():
    for name in ("prey", "lattice"):
        ivp = ivp_of(name)
        assert "use ida:ode" in parse("ida:casimirs").refusal(ivp)
        assert parse("ida:ode").refusal(ivp) is None
        with pytest.raises(BadInput, match="Casimir"):
            parse("ida:casimirs").solve(ivp, END)
    with pytest.raises(BadInput, match="Casimir"):
        pose_poisson(ivp_of("prey"), "casimirs")


def test_dependent_gradients_at_the_start_are_an_error():
    for name, case, size in (("free_rigid_body", "hlw", 3), ("heavy_top_lie_poisson", "kovalevskaya", 6)):
        still = initial_value_problem(name, case, y0=np.zeros(size))
        with pytest.raises(DaebenchError, match="dependent at y0"):
            pose_poisson(still, "casimirs")
