"""What IDA and CVODE think of their steps: weights by their formula, estimates near the true local errors, and the run as without."""

import ctypes

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import daebench
from daebench.errors import BadInput
from daebench.methods.solvers.native import libraries, memory, recorder

FAST = {"problem": "spherical_pendulum", "case": "fig1.2"}
SOLVERS = ("ida:ode", "ida:index2", "cvode:bdf", "cvode:adams")


def recorded(method, tol, t_end, **settings):
    """Return a run with a record of its steps, by default on the fast pendulum."""
    return daebench.run(**{**FAST, **settings}, method=method, tol=tol, t_end=t_end, solver_steps=True)


def off_weights(steps, tol, untested=()):
    """Return the largest relative difference of weights from 1 / (tol |y| + tol), y before the step, and 1e20 for tol where untested."""
    atol = np.full(steps.y.shape[1], tol)
    for name in untested:
        atol[steps.blocks[name]] = 1e20
    return np.abs(steps.weight[1:] * (tol * np.abs(steps.y[:-1]) + atol) - 1.0).max()


@pytest.mark.parametrize("method", SOLVERS)
def test_a_record_changes_nothing_of_a_run(method):
    plain, run = daebench.run(**FAST, method=method, tol=1e-6, t_end=2.0), recorded(method, 1e-6, 2.0)
    assert plain.solver_steps is None
    assert np.array_equal(plain.q, run.q)
    assert dict(plain.work) == dict(run.work)
    steps = run.solver_steps
    assert len(steps.t) == run.steps
    assert steps.accepted.all()
    assert np.allclose(np.diff(steps.t), steps.h[1:], rtol=1e-9, atol=1e-15)
    assert steps.t[-1] == 2.0
    assert np.array_equal(steps.y[-1, :3], run.q[-1])


@pytest.mark.parametrize(("method", "prefix"), [("ida:index2", "IDA"), ("cvode:adams", "CVode")])
def test_counts_of_steps_add_up_to_those_of_the_solver(method, prefix, monkeypatch):
    counters, free = [], memory.Solver.free

    def counted(solver):
        library = ctypes.CDLL(libraries.paths()[prefix.lower()])
        for name in ("NumNonlinSolvIters", "NumErrTestFails", "NumNonlinSolvConvFails") if solver.mem else ():
            number = ctypes.c_long()
            assert library[f"{prefix}Get{name}"](solver.mem, ctypes.byref(number)) == 0
            counters.append(number.value)
        free(solver)

    monkeypatch.setattr(memory.Solver, "free", counted)
    steps = recorded(method, 1e-5, 5.0).solver_steps
    assert [steps.iterations.sum(), steps.error_failures.sum(), steps.newton_failures.sum()] == counters
    assert steps.error_failures.sum() > 0
    assert steps.iterations.min() >= 1
    assert set(steps.order) <= set(range(1, 13 if method == "cvode:adams" else 6))
    assert len(set(steps.order)) > 3


@pytest.mark.parametrize("method", SOLVERS)
def test_weights_are_those_of_their_formula_and_no_step_taken_is_over_its_tolerance(method):
    steps = recorded(method, 1e-6, 5.0).solver_steps
    assert off_weights(steps, 1e-6) < 1e-14
    norm = np.sqrt(np.mean((steps.estimate * steps.weight) ** 2, axis=1))
    assert np.allclose(steps.tested, norm, rtol=1e-13, atol=0)
    assert 0.5 < norm.max() <= 1.0
    assert np.allclose(sum(share**2 for share in steps.shares.values()), norm**2, rtol=1e-13, atol=0)


def pendulum(_, x):
    """Unit pendulum in the plane as HLW (1.18), by hand."""
    q, v = x[:2], x[2:]
    return np.concatenate([v, -np.array([0.0, 1.0]) - q * (v @ v - q[1]) / (q @ q)])


def true_over_estimated(steps):
    """Return local errors of SciPy's, from where each step began, over those estimated; of every third step after the first thirty."""
    ratios = []
    for k in range(30, len(steps.t), 3):
        exact = solve_ivp(pendulum, (0.0, steps.h[k]), steps.y[k - 1], method="DOP853", rtol=1e-13, atol=1e-15).y[:, -1]
        ratios.append(np.linalg.norm(steps.y[k] - exact) / np.linalg.norm(steps.estimate[k]))
    return np.percentile(ratios, [10, 50, 90])


@pytest.mark.parametrize("method", ["ida:ode", "cvode:adams"])
def test_estimates_are_near_the_true_local_errors(method):
    low, median, high = true_over_estimated(recorded(method, 1e-7, 5.0, problem="planar_pendulum", case="horizontal").solver_steps)
    assert 0.2 < low < 3.0
    assert 1.0 < median < 3.0
    assert 1.0 < high < 6.0


# ---- what is not tested, and what fails ----------------------------------------------------------------------------------


@pytest.mark.parametrize("treatment", ["atol", "suppress"])
def test_blocks_that_are_left_out_have_the_share_that_they_would_have(treatment):
    tol = 1e-5
    steps = recorded(f"ida:index3:{treatment}", tol, 2.0).solver_steps
    assert steps.untested == ("v", "lam")
    assert off_weights(steps, tol, steps.untested if treatment == "atol" else ()) < 1e-12
    for name in ("v", "lam"):
        there = steps.blocks[name]
        squares = (steps.estimate[:, there] / (tol + tol * np.abs(steps.y[:, there]))) ** 2
        assert np.allclose(steps.shares[name], np.sqrt(squares.sum(axis=1) / 7), rtol=1e-13, atol=0)
    assert np.array_equal(steps.tested, steps.shares["q"])
    assert steps.tested.max() <= 1.0
    assert np.median(steps.shares["lam"]) > 100  # what would end the run if it was tested
    assert np.median(steps.shares["v"]) > 3


KINDS = {
    "momenta": ({"problem": "free_rigid_body", "case": None, "method": "ida:casimirs"}, ["y", "Mu"]),
    "derivatives": ({"method": "ida:ggl"}, ["q", "v", "Lam", "Mu"]),
    "chain": ({"problem": "pendulum_chain", "case": "hanging", "parameters": {"links": 80}, "method": "ida:index2"}, ["q", "v", "Lam"]),
}


@pytest.mark.sampled(left_out=("chain",))
@pytest.mark.parametrize("kind", KINDS)
def test_unknowns_are_named_and_in_their_order(kind):
    settings, names = KINDS[kind]
    run = recorded(tol=1e-5, t_end=0.5, **settings)
    steps = run.solver_steps
    assert [*steps.blocks] == names
    state = run.states[names[0]]
    assert np.array_equal(steps.y[-1, : state.shape[1]], state[-1])
    assert off_weights(steps, 1e-5, steps.untested) < 1e-12
    columns = steps.columns
    assert np.array_equal(columns[f"estimate_{names[-1]}1"], steps.estimate[:, steps.blocks[names[-1]].start])
    assert {len(column) for column in columns.values()} == {len(steps.t)}


def test_steps_that_no_longer_fit_end_the_run_and_stay(monkeypatch):
    monkeypatch.setattr(recorder, "MOST_NUMBERS", 3000)
    run = recorded("ida:ode", 1e-8, 10.0)
    assert "steps are recorded, and there is no room for more; end the run before, or record no steps." in run.failure
    assert len(run.solver_steps.t) == run.steps > 100
    assert np.isfinite(run.q).all()


REFUSED = {
    "fixed steps": ({"method": "rattle", "h": 0.1}, "rattle has fixed steps without error estimates"),
    "another solver": ({"method": "scipy:DOP853", "tol": 1e-6}, "scipy:DOP853 does not report its steps"),
    "solve_dae": ({"method": "solve_dae:Radau", "tol": 1e-6}, "solve_dae:Radau does not report its steps"),
    "python": (
        {"method": "ida:index2", "tol": 1e-6, "callbacks": "python"},
        "a record of steps needs compiled callbacks, because scikit-sundae",
    ),
    "poisson": ({"problem": "lotka_volterra", "case": None, "method": "scipy:RK45", "tol": 1e-6}, "does not report its steps"),
}


def test_a_record_is_refused_where_there_is_none():
    for settings, says in REFUSED.values():
        with pytest.raises(BadInput, match=says):
            daebench.run(**{**FAST, "t_end": 1.0, "solver_steps": True, **settings})


# ---- the treatment suppress ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("problem", "method"), [("planar_pendulum", "ida:index2:suppress"), ("free_rigid_body", "ida:casimirs:suppress")])
def test_suppress_is_refused_with_python_callbacks(problem, method):
    with pytest.raises(
        BadInput, match=rf"{method} needs compiled callbacks, because scikit-sundae has no way to suppress unknowns; leave out"
    ):
        daebench.run(problem, method=method, tol=1e-6, t_end=1.0, callbacks="python")
    assert daebench.run(problem, method=method, tol=1e-6, t_end=1.0).failure is None
