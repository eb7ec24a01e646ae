"""IDA, CVODE and SciPy's solvers as methods: accuracy, exact counts, grids, limits, and what they say when they fail."""

import itertools
import signal
from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest
import uncompiled
from ivps import ivp
from measures import error_of, right_side
from oracles import solution
from refusals import refused

from daebench.compiler.native import Callback, Native
from daebench.errors import DaebenchError, RunFailed, Stopped
from daebench.methods.formulations import constrained as posing
from daebench.methods.formulations.constrained import FORMULATIONS, pose
from daebench.methods.solvers.cvode import Cvode
from daebench.methods.solvers.ida import Ida
from daebench.methods.solvers.monitor import Monitor
from daebench.methods.solvers.scipy_ode import ScipyOde
from daebench.methods.solvers.variants import SCIPY as IMPLICIT
from daebench.runs.request import Request, WorkLimit

METHODS = [*map(Ida, FORMULATIONS), *map(Cvode, Cvode.variants), *map(ScipyOde, IMPLICIT)]
ONE_EACH = [Ida("index1"), Cvode("adams"), ScipyOde("RK45"), ScipyOde("LSODA")]
SLOW = Request(value=1e-8, t_end=2.0, points=3)


def named(methods):
    return {"argvalues": methods, "ids": [method.name for method in methods]}


@pytest.fixture(autouse=True)
def plain_functions(monkeypatch, request):
    if "compiled" not in request.fixturenames:
        monkeypatch.setattr(posing, "_module", uncompiled.kept_module)


@pytest.fixture
def compiled():
    """Asked for by tests that want machine code."""


# ---- what comes out ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", **named(METHODS))
def test_method_follows_the_motion_written_by_hand(method):
    for name, bound in (("spherical-slow", 1e-5), ("relativistic", 2e-4)):
        trajectory = method.solve(ivp(name), SLOW).complete()
        q, p = solution(name, 2.0)
        assert max(error_of(trajectory.q[-1], q), error_of(trajectory.p[-1], p)) < bound


@pytest.mark.parametrize("method", **named(ONE_EACH))
def test_trajectory_says_what_was_run(method):
    fast = ivp("spherical-fast")
    trajectory = method.solve(fast, Request(value=1e-6, t_end=1.5, points=7, multipliers=True, watch=("energy", "manifold", "integrals")))
    assert (trajectory.problem, trajectory.case, trajectory.method) == ("spherical_pendulum", "fig1.2b", method.name)
    assert (trajectory.knob, trajectory.value, trajectory.maxima_over, trajectory.failure) == ("tol", 1e-6, "outputs", None)
    assert np.array_equal(trajectory.t, np.linspace(0, 1.5, 7))
    q, p = trajectory.q.T, trajectory.p.T
    H, L3 = (p**2).sum(axis=0) / 2 + q[2], q[0] * p[1] - q[1] * p[0]
    found = {"energy": H - H[0], "g": (q**2).sum(axis=0) - 1, "Gv": 2 * (q * p).sum(axis=0), "L3": L3 - L3[0]}
    assert trajectory.maxima == pytest.approx({name: np.abs(errors).max() for name, errors in found.items()}, abs=1e-14)
    assert np.allclose(trajectory.lam[:, 0], ((p**2).sum(axis=0) - q[2]) / (2 * (q**2).sum(axis=0)), rtol=1e-12, atol=0)
    assert 0 < trajectory.callback_seconds <= trajectory.seconds
    assert trajectory.compile_seconds > 0


@pytest.mark.parametrize("method", **named(ONE_EACH))
def test_steps_do_not_depend_on_the_grid_and_a_later_run_changes_no_earlier_one(method):
    coarse = method.solve(ivp("spherical-fast"), replace(SLOW, value=1e-6, points=3))
    kept = coarse.q.copy()
    fine, ends = (
        method.solve(ivp("spherical-fast"), replace(SLOW, value=1e-6, **k)) for k in ({"points": 101}, {"points": None, "every": 0})
    )
    assert coarse.steps == fine.steps == ends.steps
    assert np.array_equal(coarse.q, kept)
    assert np.array_equal(coarse.q[1:], fine.q[[50, 100]])
    assert np.array_equal(ends.t, [0.0, 2.0])
    assert np.array_equal(ends.q[-1], kept[-1])


# ---- counts --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("variant", ["RK45", "Radau"])
def test_scipy_steps_are_those_of_solve_ivp(variant):
    from scipy.integrate import solve_ivp

    dae = pose(ivp("spherical-fast"), "ode")

    def jac(t, y):
        JJ = np.empty((6, 6))
        dae.rhs_jacobian(t, y, JJ, dae.par)
        return JJ

    found = solve_ivp(
        lambda t, y: right_side(dae, y), (0, 2), dae.y0, method=variant, rtol=1e-6, atol=1e-6, **({"jac": jac} if IMPLICIT[variant] else {})
    )
    trajectory = ScipyOde(variant).solve(ivp("spherical-fast"), replace(SLOW, value=1e-6))
    assert trajectory.steps == len(found.t) - 1
    assert np.array_equal(trajectory.q[-1], found.y[:3, -1])


def test_work_is_left_out_where_it_is_not_wanted():
    assert Ida("index2").solve(ivp("planar"), replace(SLOW, count=False)).work == {}


@pytest.mark.usefixtures("compiled")
@pytest.mark.parametrize("method", **named([Ida("index2"), Cvode("bdf"), ScipyOde("Radau")]))
def test_nothing_is_compiled_while_the_clock_runs(method, monkeypatch):
    begin, seen = type(method)._begin, []

    def compiled(dae):
        functions = vars(dae.module).values()
        called = ["address" in vars(found) for found in functions if isinstance(found, Callback)]
        return called + [len(found.kinds) for found in functions if isinstance(found, Native)]

    def begun(self, dae, tol, monitor):
        advance = begin(self, dae, tol, monitor)
        seen.append((dae, compiled(dae)))
        return advance

    monkeypatch.setattr(type(method), "_begin", begun)
    method.solve(ivp("spherical-slow"), SLOW).complete()
    dae, before = seen[0]
    assert compiled(dae) == before
    assert sum(before) > 0


# ---- stopping early ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", **named([Ida("index3", "none"), Ida("ggl", "none")]))
def test_plain_settings_fail_with_a_sentence(method, capsys):
    trajectory = method.solve(ivp("spherical-fast"), replace(SLOW, seconds_limit=60))
    with pytest.raises(RunFailed, match=rf"{method.name} on spherical_pendulum, case fig1.2b, stopped at t = \S+ of 2 \(tol = 1e-08\)"):
        trajectory.complete()
    assert "limit" not in trajectory.failure
    assert trajectory.failure.endswith("with the treatment atol or derivative.")
    assert len(trajectory.t) == len(trajectory.q) < 3
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize("method", **named(ONE_EACH))
def test_the_wall_clock_limit_keeps_what_there_is(method):
    trajectory = method.solve(ivp("spherical-fast"), Request(value=1e-9, t_end=1e6, seconds_limit=0.05))
    assert "the limit of 0.05 s is reached; allow more time" in trajectory.failure
    assert len(trajectory.t) == 2
    assert f"stopped at t = {trajectory.t[-1]:.9g} of" in trajectory.failure
    assert abs((trajectory.q[-1] ** 2).sum() - 1) < 1e-5


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="needs an interval timer")
@pytest.mark.parametrize("method", **named([Ida("index1"), ScipyOde("RK45")]))
@pytest.mark.parametrize("kept", [True, False])
def test_an_interrupt_goes_on_unless_what_there_is_is_to_be_kept(method, kept, monkeypatch):
    def interrupt(*_):
        raise KeyboardInterrupt

    def start(monitor, begin=Monitor.start):
        begin(monitor)
        signal.setitimer(signal.ITIMER_REAL, 0.2)  # not before the steps, however long it takes to come to them

    monkeypatch.setattr(Monitor, "start", start)
    old = signal.signal(signal.SIGALRM, interrupt)
    try:
        with nullcontext() if kept else pytest.raises(KeyboardInterrupt):
            trajectory = method.solve(ivp("spherical-fast"), Request(value=1e-9, t_end=1e6, seconds_limit=60, keep_interrupted=kept))
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, old)
    if kept:
        assert "interrupted" in trajectory.failure
        assert len(trajectory.t) == 2


def test_progress_goes_from_the_first_output_to_the_end():
    told = []
    Ida("index1").solve(ivp("planar"), replace(SLOW, points=5, progress=told.append))
    assert told == [0.25, 0.5, 0.75, 1.0]


@pytest.mark.parametrize("method", **named([Ida("ode"), ScipyOde("DOP853"), ScipyOde("LSODA")]))
@pytest.mark.parametrize(("health", "says"), [(0.0, r"G M\^-1 G\^T is singular at t = "), (np.nan, "no longer finite at t = ")])
def test_rank_loss_and_values_that_are_not_finite_end_the_run(method, health, says, monkeypatch):
    def ill(found, ivp, *rest):
        module = uncompiled.module(ivp, *rest)
        for name in ("rhs", "residual"):
            right = getattr(module, name)
            setattr(module, name, lambda t, *arrays, right=right: right(t, *arrays) if t < 0.5 else health)
        return module

    monkeypatch.setattr(posing, "_module", lambda ivp, *rest: ill(None, ivp, *rest))
    trajectory = method.solve(ivp("spherical-slow"), replace(SLOW, points=21))
    with pytest.raises(RunFailed, match=says):
        trajectory.complete()
    assert 0 < trajectory.t[-1] <= 0.5 < 0.1 * len(trajectory.t) + 0.5


def test_a_step_size_that_has_collapsed_ends_the_run():
    monitor = Monitor(1.0, 600.0)
    for k in range(999):
        monitor.stepped(k * 1e-17, np.zeros(1))
    with pytest.raises(Stopped, match=r"collapsed to 1.0e-17"):
        monitor.stepped(1e-14, np.zeros(1))


# ---- requests and names --------------------------------------------------------------------------------------------------

REFUSED = [
    *(("solver-end-time-invalid", {"t_end": None}), ("solver-end-time-invalid", {"t_end": 0.0}), ("not-finite", {"t_end": np.nan})),
    *(("solver-given-steps", {"steps": 10}), ("solver-given-every", {"every": 5}), ("solver-precision", {"precision": "float32"})),
    *(("solver-points-out-of-range", {"points": points}) for points in (1, 10**9)),
    *(("solver-tol-out-of-range", {"value": tol}) for tol in (0.1, 1e-17, np.nan)),
]


def test_requests_that_cannot_be_met_are_refused():
    for method, (code, change) in itertools.product(ONE_EACH, REFUSED):
        with refused(code):
            method.solve(ivp("planar"), replace(SLOW, **change))
    with refused("solver-tol-out-of-range"):
        ScipyOde("DOP853").solve(ivp("planar"), replace(SLOW, value=1e-14))


def test_unknown_variants_are_refused():
    for make, name in (
        (lambda: Ida("index4"), "index4"),
        (lambda: Ida("index2", "deriv"), "deriv"),
        (lambda: Cvode("adam"), "adam"),
        (lambda: ScipyOde("dop853"), "dop853"),
    ):
        with refused("unknown-name", name=name):
            make()
    with refused("ode-has-no-treatment"):
        Ida("ode", "atol")


def test_options_reach_the_formulation():
    weak, strong = (Ida("baumgarte", options={"alpha": a, "beta": a}).solve(ivp("spherical-fast"), SLOW).maxima["g"] for a in (0, 30))
    assert strong < 0.5 * weak
    with pytest.raises(DaebenchError, match="option of index1"):
        Ida("index1", options={"alpha": 1}).solve(ivp("planar"), SLOW)


def test_work_limit_ends_after_a_number_of_calls_whatever_they_cover():
    monitor = Monitor(10.0, 600.0, WorkLimit(5, 100, 100))
    for t in range(5):
        monitor.called("residual", t, 1.0, 0.0)
        monitor.called("jacobian", t, 1.0, 0.0)
    with pytest.raises(Stopped, match="5 calls of the residual"):
        monitor.called("residual", 6.0, 1.0, 0.0)


def test_work_limit_ends_sooner_where_calls_cover_too_little():
    monitor = Monitor(10.0, 600.0, WorkLimit(1000, 10, 100))
    for k in range(1, 110):
        monitor.called("rhs", 0.011 * min(k, 100), 1.0, 0.0)
    with pytest.raises(Stopped, match="10 calls of the rhs covered less than 1/100 of the run"):
        monitor.called("rhs", 1.1, 1.0, 0.0)
