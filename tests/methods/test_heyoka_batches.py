"""heyoka's batch mode for members of ensembles: the members that single runs give, and certified motions."""

from importlib.util import find_spec

import numpy as np
import pytest
import sympy as sp
from refusals import refused

from daebench.methods.ensemble.heyoka_batches import in_batches
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.solvers import heyoka_ode
from daebench.methods.solvers.heyoka_ode import equations_of
from daebench.runs.members import Members
from daebench.starts.draw import draw_starts
from daebench.systems.poisson import PoissonCase, PoissonSystem

needs_heyoka = pytest.mark.skipif(find_spec("heyoka") is None, reason="heyoka, of the extra peers, is not installed")

TOL = 2.2e-16


def alone(members, i, times, tol=TOL):
    """Return the states of one member by heyoka's scalar integrator, as (p, q) or y."""
    import heyoka as hy

    ivp = members.member(i)
    series = hy.taylor_adaptive(equations_of(ivp), np.concatenate(ivp.start[::-1]), tol=tol)
    series.step(max_delta_t=heyoka_ode.FIRST * times[-1])
    rows = np.array(series.propagate_grid(np.concatenate([[series.time], times[1:]]))[-1])
    rows[0] = np.concatenate(ivp.start[::-1])
    return np.concatenate(np.split(rows, len(ivp.start), axis=1)[::-1], axis=1)


@needs_heyoka
@pytest.mark.parametrize(
    ("problem", "case", "t_end"),
    [
        *(("planar_pendulum", "rotating", 1.0), ("spherical_pendulum", "fig1.2", 0.5), ("double_pendulum", "horizontal", 0.5)),
        *(("lotka_volterra", "4,2", 2.0), ("free_rigid_body", None, 10.0)),
    ],
    ids=str,
)
def test_members_of_a_batch_are_single_runs(problem, case, t_end):
    members = draw_starts(initial_value_problem(problem, case), members=6, h=0.1).members
    times = np.linspace(0, t_end, 5)
    together = in_batches(members, times, TOL)
    single = np.stack([alone(members, i, times) for i in range(6)], axis=1)
    assert np.max(np.abs(together - single)) <= 1e-14 * np.max(np.abs(single))
    assert np.array_equal(together[0], np.concatenate(members.start, axis=1))
    assert np.ptp(together[-1], axis=0).max() > 1e-3  # members differ


@needs_heyoka
def test_a_member_that_blows_up_leaves_the_others_as_they_are():
    y, z = sp.symbols("y z", real=True)
    # y' = y^2, which is infinite at t = 1/y0, and z' = -2 y z
    system = PoissonSystem(y=[y, z], B=sp.Matrix([[0, 1], [-1, 0]]), H=z * y**2, cases={"one": PoissonCase(y=(0.5, 1))})
    ivp = initial_value_problem(system, "one")
    members = Members(ivp, (np.array([[0.1, 1.0], [0.5, 1.0], [2.0, 1.0], [0.2, 1.0], [0.3, 1.0]]),), 0.1, {})
    times = np.linspace(0, 1, 6)
    found = in_batches(members, times, 1e-15)
    lost = np.isnan(found[-1]).any(axis=1)
    assert lost.tolist() == [False, False, True, False, False]
    exact = members.start[0][~lost, 0] / (1 - np.outer(times, members.start[0][~lost, 0]))
    assert np.allclose(found[:, ~lost, 0], exact, rtol=1e-13, atol=0)


@needs_heyoka
def test_members_with_parameters_of_their_own_are_refused():
    members = draw_starts(initial_value_problem("planar_pendulum"), members=2, h=0.1, vary={"gravity": (9.0, 10.0)}).members
    with refused("heyoka-batches-refused", says=("gravity",)):
        in_batches(members, np.linspace(0, 1, 3), 1e-10)
