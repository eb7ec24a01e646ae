"""CVODE with projected steps: on the manifold at their ends, as accurate as asked, counted, and refused where it cannot be."""

import numpy as np
import pytest
from ivps import ivp
from leaving import ending
from measures import error_of
from oracles import solution

from daebench.errors import BadInput
from daebench.methods.names import parse
from daebench.methods.run import run
from daebench.methods.solvers import cvode as called_back
from daebench.methods.solvers.native import libraries
from daebench.runs.request import Request

NAME = "cvode:bdf:projected"
T_END = 2.0
ROUNDING = 1e-15
KINDS = {"spherical-fast": 1e-3, "coupled-rods": 1e-4, "relativistic": 1e-4}
"""Problems in velocities, with a diagonal mass matrix and a full one, and in momenta; with errors allowed at a tolerance of 1e-7."""


def solved(name, tol, method=NAME, points=2):
    return parse(method).solve(ivp(name), Request(value=tol, t_end=T_END, points=points)).complete()


def off_manifold(name, trajectory):
    """Return |g| and |G H_p| at the end, which is the end of a step, relative to |G| |q| and |G| |v|."""
    where, p, q = ivp(name), tuple(trajectory.p[-1]), tuple(trajectory.q[-1])
    G, v = np.abs(where.value("G", q)), np.abs(where.value("H_p", p, q))
    return max(np.abs(where.value("g", q)) / (G @ np.abs(q))), max(np.abs(where.value("Gv", p, q)) / (G @ v))


@pytest.mark.sampled(by=lambda case: case == "spherical-fast")
@pytest.mark.parametrize("name", KINDS)
def test_steps_end_on_the_manifold_and_follow_the_motion_written_by_hand(name):
    coarse, fine = (solved(name, tol) for tol in (1e-4, 1e-7))
    q, p = solution(name, T_END)
    errors = [max(error_of(run.q[-1], q), error_of(run.p[-1], p)) for run in (coarse, fine)]
    assert errors[1] < min(KINDS[name], 0.1 * errors[0])
    assert max(*off_manifold(name, coarse), *off_manifold(name, fine)) < ROUNDING
    assert max(off_manifold(name, solved(name, 1e-4, "cvode:bdf"))) > 1e6 * ROUNDING


def test_outputs_between_steps_are_near_the_manifold_by_the_tolerance():
    trajectory = solved("spherical-fast", 1e-8, points=201)
    assert 1e-12 < trajectory.maxima["g"] < 1e-7
    assert np.array_equal(trajectory.q[-1], solved("spherical-fast", 1e-8).q[-1])


@pytest.mark.slow
def test_a_run_beyond_the_end_of_the_motion_does_not_come_to_its_end():
    run = parse(NAME).solve(ending("log"), Request(value=1e-6, t_end=6.0))
    assert run.failure is not None
    assert np.isfinite(run.q).all()
    assert all(np.isfinite(value) for value in run.maxima.values())


def test_a_projection_that_fails_ends_the_run_with_a_reason(monkeypatch, tmp_path):
    monkeypatch.setenv("DAEBENCH_CACHE", str(tmp_path))
    monkeypatch.setattr(called_back, "CALLED_BACK", called_back.CALLED_BACK.replace("report[0] != 0", "True"))
    trajectory = parse(NAME).solve(ivp("spherical-fast"), Request(value=1e-6, t_end=T_END))
    assert "the projection onto the constraints failed" in trajectory.failure
    assert np.array_equal(trajectory.q, [ivp("spherical-fast").q0])


REFUSED = (
    ({"method": "cvode:adams:projected"}, "use cvode:bdf:projected"),
    ({"method": "cvode:bfd:projected"}, "did you mean bdf"),
    ({"method": "cvode:bdf:project"}, "did you mean projected"),
    ({"callbacks": "python"}, "compiled callbacks"),
    ({"on_singular": "least-squares"}, "independent constraints"),
    ({"problem": "lotka_volterra"}, "a Poisson system"),
    ({"problem": "pendulum_chain", "parameters": {"links": 20}}, "all 20 nodes"),
)


def test_what_cannot_be_projected_is_refused():
    for settings, words in REFUSED:
        with pytest.raises(BadInput, match=words):
            run(**{"problem": "planar_pendulum", "method": NAME, "tol": 1e-6, "t_end": 1.0, **settings})


def test_it_is_refused_where_the_libraries_are_not_there(monkeypatch):
    def missing():
        raise libraries.Unavailable("scikit-sundae has no shared library of SUNDIALS for cvode")

    monkeypatch.setattr(libraries, "functions", missing)
    with pytest.raises(BadInput, match=r"calls the libraries of SUNDIALS, and scikit-sundae has no .* for cvode; install"):
        run("planar_pendulum", method=NAME, tol=1e-6, t_end=1.0)
