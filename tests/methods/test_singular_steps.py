"""Steps over a singularity are told by what the run conserves, and ordinary motions by no one; what is lost is warned of."""

import itertools
import json
import re

import numpy as np
import pytest
from ivps import ivp
from leaving import SINGULAR, singular

from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.formulations.constrained import FORMULATIONS, pose
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.solvers.cvode import Cvode
from daebench.methods.solvers.ida import Ida
from daebench.methods.solvers.monitored import Monitored
from daebench.methods.solvers.scipy_ode import ScipyOde
from daebench.methods.solvers.variants import SCIPY as IMPLICIT
from daebench.methods.warnings_on_runs import losses
from daebench.runs.request import Request

METHODS = [*map(Ida, FORMULATIONS), *map(Cvode, Cvode.variants), *map(ScipyOde, IMPLICIT)]
TESTED = [method for method in METHODS if method.name != "ida:index3"]
"""Methods whose velocities are in the error test: what the tolerance explains is far more where they are not."""


pytestmark = pytest.mark.usefixtures("plain_functions")


def said(where, method, tol):
    """Return what is said of a run through the singularity."""
    run = method.solve(where, Request(value=tol, t_end=3.0, points=101, seconds_limit=20.0))
    return run.failure or " ".join(losses(where, run))


HARDLY_MORE = {("passing", 1e-4), ("cusp", 1e-4), ("cusp", 1e-6, "scipy:RK23"), ("cusp", 1e-6, "scipy:RK45")}
"""Runs whose step changes H by about as much as is still put down to the tolerance, on one processor more, on another less."""


def crossed(names, tolerances, methods, share):
    """Return all triples as parameters, of which the gate takes so large a part: each name and each tolerance."""
    found = []
    for (k, name), (j, tol), (i, method) in itertools.product(*map(enumerate, (names, tolerances, methods))):
        taken = (i + k) % share == 0 and (i + k) // share % len(tolerances) == j
        marks = () if taken else pytest.mark.exhaustive
        found.append(pytest.param(name, tol, method, id=f"{name}-{tol}-{method.name}", marks=marks))
    return found


@pytest.mark.filterwarnings("ignore:.*in scalar:RuntimeWarning")  # of functions that are not compiled, at the kink itself
@pytest.mark.parametrize(("name", "tol", "method"), crossed(SINGULAR, (1e-4, 1e-6, 1e-9), TESTED, 8))
def test_a_step_over_a_singularity_is_said(name, tol, method):
    if (name, tol) not in HARDLY_MORE and (name, tol, method.name) not in HARDLY_MORE:
        assert said(singular(name), method, tol)


@pytest.mark.parametrize(
    ("name", "tol", "method"),
    crossed(["spherical-fast", "planar", "stretched-M", "relativistic", "double-pendulum"], (1e-3, 1e-6, 1e-10), METHODS, 8),
)
def test_an_ordinary_motion_is_never_stopped_nor_doubted(name, tol, method):
    run = method.solve(ivp(name), Request(value=tol, t_end=2.0, points=21)).complete()
    assert not losses(ivp(name), run)


def test_the_change_that_is_explained_is_that_of_errors_within_the_tolerance():
    fast = ivp("spherical-fast")
    dae = pose(fast, "ode")
    found = Monitored(dae, 1e-6).explained(dae.y0, 0.1)
    q, v = dae.y0[:3], dae.y0[3:]
    H_q, H_v = np.array([0, 0, 1.0]), v
    expected = 1e-6 * (np.abs(H_q) @ (1 + np.abs(q)) + np.abs(H_v) @ (1 + np.abs(v)))
    assert found[0] == pytest.approx(expected, rel=1e-4)
    assert found[1] == pytest.approx(1e-6 * (np.abs(2 * v) @ (1 + np.abs(q)) + np.abs(2 * q) @ (1 + np.abs(v))), rel=1e-4)
    wider = Monitored(pose(fast, "index3"), 1e-6).explained(dae.y0, 1e-3)
    assert wider[0] > 100 * found[0]


LOST = {
    "generalized_alpha": ("fig1.2", 0.05, 20.0),
    "implicit_euler": ("fig1.2", 0.05, 100.0),
    "se": ("fig1.1", 0.03, 100.0),
}
"""Methods that lose the spherical pendulum, with the case, the step and the end."""


@pytest.mark.parametrize("method", LOST)
def test_a_motion_that_is_lost_is_warned_of_with_the_time(method):
    case, h, t_end = LOST[method]
    where = initial_value_problem("spherical_pendulum", case)
    run = FixedStep(method, compiled=False).solve(where, Request(value=h, t_end=t_end)).complete()
    since, kinetic = map(float, re.search(r"lost from t = (\S+) .*kinetic energy, ([^;]+);", losses(where, run)[0]).groups())
    assert run.maxima["energy"] > kinetic
    error = np.abs(where.along("H", run.p, run.q) - where.value("H", where.p0, where.q0))
    first = np.argmin(np.abs(run.t - since))
    assert error[first] > 0.99 * kinetic
    assert np.all(error[:first] < 1.01 * kinetic)


@pytest.mark.parametrize("method", ["rattle", "lobatto3", "energy_momentum", "generalized_alpha"])
def test_a_motion_that_is_not_lost_is_not_warned_of(method):
    where = initial_value_problem("spherical_pendulum", "fig1.2")
    assert not losses(where, FixedStep(method, compiled=False).solve(where, Request(value=0.002, t_end=2.0)).complete())


def test_the_command_warns_in_words_and_in_json(daebench):
    words = ("run", "spherical_pendulum", "--case", "fig1.2", "--method", "generalized_alpha", "--h", 0.05, "--t-end", 20)
    status, out, _ = daebench(*words)
    assert (status, out.count("Warning: ")) == (1, 1)
    assert len(json.loads(daebench(*words, "--json")[1])["warnings"]) == 1
    status, out, _ = daebench(*words[:-4], "--h", 0.002, "--t-end", 1, "--json")
    assert (status, json.loads(out)["warnings"]) == (0, [])


def test_a_constraint_that_is_broken_is_warned_of():
    cusp = singular("cusp")
    run = ScipyOde("DOP853").solve(cusp, Request(value=1e-2, t_end=3.0, points=301)).complete()
    assert any("g1 = 0 is broken from t = " in each for each in losses(cusp, run))
    assert np.max(np.abs(cusp.along("g", run.q))) > 1


@pytest.mark.parametrize("rate", [3.0, 10.0, 30.0], ids=str)
@pytest.mark.parametrize(("turn", "lost"), [(0.1, False), (0.15, False), (0.2, True), (0.3, True)], ids=str)
def test_generalized_alpha_loses_a_pendulum_where_its_page_says(rate, turn, lost):
    where = initial_value_problem("planar_pendulum", "rotating", q0=[0, -1], p0=[rate, 0])
    run = FixedStep("generalized_alpha", compiled=False).solve(where, Request(value=turn / rate, steps=1000)).complete()
    assert bool(losses(where, run)) == lost
