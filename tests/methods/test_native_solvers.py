"""IDA and CVODE with compiled callbacks do what they do with Python callbacks, and nothing is lost or leaks."""

import itertools
import os
import resource
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import numpy as np
import pytest
from measures import error_of

import daebench
from daebench.methods.formulations.constrained import pose
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.solvers.monitored import Monitored
from daebench.methods.solvers.native import libraries

FORMULATIONS = ("index3", "index2", "index1", "ggl", "baumgarte", "ode")
CONSTRAINED = [*(f"ida:{name}" for name in FORMULATIONS), "cvode:adams", "cvode:bdf"]
POISSON = ("ida:ode", "ida:casimirs", "cvode:adams", "cvode:bdf")
RUNS = [
    *(("spherical_pendulum", method, tol) for method, tol in zip(CONSTRAINED, itertools.cycle((1e-5, 1e-11)), strict=False)),
    *(("free_rigid_body", method, tol) for method, tol in zip(POISSON, itertools.cycle((1e-11, 1e-5)), strict=False)),
    ("slider_crank", "ida:index2", 1e-11),
]


def both(problem, **settings):
    """Return a run with compiled callbacks, and one with Python callbacks."""
    return [daebench.run(problem, callbacks=callbacks, **settings) for callbacks in ("native", "python")]


def states(run):
    return np.hstack(list(run.states.values()))


def same(native, python):
    """Assert that two runs have the same steps and calls, and states within 1e-15 of their size."""
    assert (native.callbacks, python.callbacks) == ("native", "python")
    assert dict(native.work) == dict(python.work)
    assert native.failure == python.failure
    assert np.array_equal(native.t, python.t)
    assert error_of(states(native), states(python)) <= 1e-15 * np.abs(states(python)).max()


def test_a_native_run_has_no_time_in_python_callbacks():
    native, python = both("spherical_pendulum", method="ida:index2", tol=1e-8, t_end=5.0)
    assert native.callback_seconds is None
    assert native.seconds > 0
    assert 0 < python.callback_seconds <= python.seconds


ENDINGS = {
    "lock-up": ("slider_crank", {"case": "turning", "method": "ida:index1", "tol": 1e-6, "t_end": 2.0, "parameters": {"rod": 1.0}}),
    "blow-up": ("lotka_volterra_3d", {"method": "cvode:bdf", "tol": 1e-8, "t_end": 50.0}),
    "domain": ("lotka_volterra", {"method": "cvode:adams", "tol": 1e-2, "t_end": 100.0, "y0": [1e-3, 8.0]}),
    "no cure": ("spherical_pendulum", {"case": "fig1.2", "method": "ida:index3:none", "tol": 1e-6, "t_end": 1.0}),
    "collapse": ("spherical_pendulum", {"case": "fig1.2", "method": "ida:index2:none", "tol": 1e-10, "t_end": 1.0}),
}


ENDINGS |= {"-".join(map(str, row)): (row[0], {"method": row[1], "tol": row[2], "t_end": 1.0, "points": 21}) for row in RUNS}
"""Runs that end early, and whole ones of every method."""


@pytest.mark.parametrize("ending", ENDINGS)
def test_both_kinds_of_callbacks_give_the_same_run_and_the_same_end(ending):
    problem, settings = ENDINGS[ending]
    same(*both(problem, **settings))


def test_limits_end_a_native_run_and_keep_what_there_is():
    run = daebench.run("double_pendulum", method="ida:index2", tol=1e-12, t_end=1e4, points=100_001, seconds_limit=0.3)
    assert "limit of 0.3 s" in run.failure
    assert 1 < len(run.t) < 100_001


def test_progress_is_told_as_a_native_run_goes_on():
    told = []
    daebench.run("double_pendulum", method="ida:index2", tol=1e-10, t_end=200.0, progress=told.append)
    assert told == sorted(told)
    assert 0 < told[0] < 0.9
    assert told[-1] == 1.0


@pytest.mark.parametrize(("problem", "formulation"), [("slider_crank", "index3"), ("spherical_pendulum", "ode")])
def test_what_is_monitored_is_the_same_compiled_and_not(problem, formulation):
    dae = pose(initial_value_problem(problem, None, None), formulation)
    compiled, plain = Monitored(dae, 1e-7), Monitored(dae, 1e-7)
    plain.compiled = False
    y = dae.y0 + 0.01 * np.random.default_rng(2).standard_normal(dae.n)
    assert compiled.values(y) == pytest.approx(plain.values(y), rel=1e-13)
    assert compiled.independence(y) == pytest.approx(plain.independence(y), rel=1e-12)
    assert compiled.explained(y, 0.1) == pytest.approx(plain.explained(y, 0.1), rel=1e-6)


BROKEN = {
    "not installed": lambda patch: patch.setattr(libraries, "DISTRIBUTION", "no-such-wheel"),
    "newer": lambda patch: patch.setattr(libraries, "VERSIONS", ((6, 0), (7, 0))),
    "no function": lambda patch: patch.setattr(libraries, "FUNCTIONS", {**libraries.FUNCTIONS, "ida": {"IDANothing": "ip"}}),
}
"""What may be wrong with the libraries."""


@pytest.mark.parametrize("broken", BROKEN)
def test_where_the_libraries_do_not_fit_python_callbacks_serve(broken, monkeypatch):
    expected = daebench.run("spherical_pendulum", method="ida:index2", tol=1e-6, t_end=1.0)
    libraries.functions.cache_clear()
    BROKEN[broken](monkeypatch)
    try:
        with pytest.raises(libraries.Unavailable, match=r"\w"):
            libraries.functions()
        run = daebench.run("spherical_pendulum", method="ida:index2", tol=1e-6, t_end=1.0)
    finally:
        libraries.functions.cache_clear()
    assert run.callbacks == "python"
    assert run.steps == expected.steps
    assert error_of(run.q, expected.q) < 1e-15


def test_paths_are_those_of_all_platforms(monkeypatch):
    names = ["libsundials_ida-16d992eb.so.7.9.0", "libsundials_core.7.9.0.dylib", "sundials_cvode-0123456789abcdef0123456789abcdef.dll"]
    files = [SimpleNamespace(name=name, locate=lambda name=name: name) for name in [*names, "sundials.h", "c_sundials.pxd"]]
    monkeypatch.setattr(libraries.metadata, "files", lambda _: files)
    assert libraries.paths() == dict(zip(("ida", "core", "cvode"), names, strict=True))


def test_threads_and_a_forked_process_get_the_same_bits():
    def run(_=None):
        return daebench.run("double_pendulum", method="ida:index2", tol=1e-9, t_end=5.0).q

    expected = run()
    with ThreadPoolExecutor(4) as pool:
        assert all(np.array_equal(found, expected) for found in pool.map(run, range(4)))
    if child := os.fork():
        assert os.waitpid(child, 0)[1] == 0
    else:
        os._exit(0 if np.array_equal(run(), expected) else 1)


@pytest.mark.parametrize("runs", [300, pytest.param(10_000, marks=[pytest.mark.slow, pytest.mark.exhaustive])])
def test_runs_leave_no_memory_behind(runs):
    def run():
        daebench.run("spherical_pendulum", method="ida:index2", tol=1e-4, t_end=0.5, points=2)
        daebench.run("spherical_pendulum", case="fig1.2", method="ida:index3:none", tol=1e-4, t_end=0.5, points=2)

    for _ in range(50):
        run()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for _ in range(runs // 2):
        run()
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 4_000  # kB; one solver of this size has 20


ENDLESS = """
import daebench
while True:
    run = daebench.run("double_pendulum", method="ida:index2", tol=1e-12, t_end=1e6, points=100_001, progress=lambda _: print(flush=True))
"""


@pytest.mark.slow
def test_a_process_that_is_killed_in_the_loop_ends():
    with subprocess.Popen([sys.executable, "-c", ENDLESS], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "\n"
        process.send_signal(signal.SIGTERM)
        process.stdout.close()
        assert process.wait() == -signal.SIGTERM


def test_ctrl_c_ends_the_loop(interrupted_in_the_loop):
    run = daebench.run("double_pendulum", method="ida:index2", tol=1e-6, t_end=1e6, points=3)
    assert (run.callbacks, interrupted_in_the_loop) == ("native", [signal.SIGINT])
    assert "interrupted" in run.failure
