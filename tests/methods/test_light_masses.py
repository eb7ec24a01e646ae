"""A mass that is too light for the step is told from a G that loses rank, and named."""

import numpy as np
import pytest

from daebench.diagnostics.rank import badly_scaled
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.solvers.cvode import Cvode
from daebench.methods.solvers.ida import Ida
from daebench.methods.solvers.scipy_ode import ScipyOde
from daebench.runs.request import Request

LIGHT = (1e-3, 1e-6, 1e-9)


pytestmark = pytest.mark.usefixtures("plain_functions")


def pendulum(mass):
    """Return two rods in space whose upper point is light, so that it whirls about as they come to be in line."""
    return initial_value_problem("double_spherical_pendulum", "swing", {"mass1": mass})


@pytest.mark.sampled(by=lambda case: case in ("rattle-0.001", "rattle_gauss_seidel-1e-06"))
@pytest.mark.parametrize("mass", LIGHT, ids=str)
@pytest.mark.parametrize("scheme", ["rattle", "lobatto3", "shake", "rattle_gauss_seidel"])
def test_a_run_that_does_not_resolve_a_light_mass_names_it(scheme, mass):
    for mode in ("stop", "continue"):
        request = Request(value=0.01, t_end=0.3, on_singular=mode)
        run = FixedStep(scheme, compiled=False).solve(pendulum(mass), request)
        assert run.failure is not None
        assert "loses rank" not in run.failure
        assert not run.passages
    assert f"M is badly scaled: the mass of q1, {mass:.3g}, is {mass:.1e} of the largest" in run.failure


@pytest.mark.sampled(by=lambda case: case in ("0.001-ida:index2", "1e-06-cvode:bdf"))
@pytest.mark.parametrize("method", [Ida("index2"), Cvode("bdf"), ScipyOde("DOP853")], ids=lambda method: method.name)
@pytest.mark.parametrize("mass", LIGHT, ids=str)
def test_a_tolerance_driven_run_resolves_it_and_goes_on(method, mass):
    run = method.solve(pendulum(mass), Request(value=1e-8, t_end=0.15, points=3)).complete()
    assert run.maxima["energy"] < 1e-3


@pytest.mark.sampled(by=lambda case: case in ("crank_mass-0.0001", "slider_mass-0.01"))
@pytest.mark.parametrize("share", [1.0, 1e-2, 1e-4], ids=str)
@pytest.mark.parametrize("which", ["crank_mass", "rod_mass", "slider_mass"])
def test_a_true_loss_of_rank_is_told_whatever_the_masses(which, share):
    usual = initial_value_problem("slider_crank", "lock_up")
    where = initial_value_problem("slider_crank", "lock_up", {which: share * usual.parameters[which]})
    for method, value in ((FixedStep("rattle", compiled=False), 2e-3), (ScipyOde("DOP853"), 1e-7)):
        run = method.solve(where, Request(value=value, t_end=5.0, every=0))
        assert "G loses rank at about t = " in run.failure, (method.name, run.failure)


@pytest.mark.parametrize("mass", LIGHT, ids=str)
def test_it_is_the_scale_of_the_masses_that_is_told_and_not_that_of_g(mass):
    where = pendulum(mass)
    rods = np.array([0, 0, -1.0, 0, 0, -2.0])
    assert "the mass of q1, " in badly_scaled(where, np.zeros(6), rods, 0.0)
    assert badly_scaled(pendulum(1.0), np.zeros(6), rods, 0.0) == ""


@pytest.mark.filterwarnings("error")
def test_the_time_is_no_coordinate_with_a_mass():
    for mass, named in ((1e-9, "the mass of q4, 1e-09, "), (1.0, "")):
        where = initial_value_problem("driven_slider_crank", parameters={"load_mass": mass})
        found = badly_scaled(where, where.p0, where.q0, 0.0)
        assert named in found
        assert bool(found) == bool(named)
