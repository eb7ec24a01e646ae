"""Formulations as machine code: the same functions as uncompiled, and what tight tolerances deliver on the fast pendulum."""

import dataclasses
from functools import cache

import numpy as np
import pytest
import uncompiled
from ivps import ivp
from measures import residual, somewhere
from scipy.integrate import solve_ivp

from daebench.compiler.callbacks import SINGULAR
from daebench.methods.formulations.constrained import FORMULATIONS, pose
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.solvers.ida import Ida
from daebench.runs.request import Request


@pytest.mark.parametrize("formulation", FORMULATIONS, ids=FORMULATIONS)
def test_compiled_functions_give_what_the_uncompiled_give(formulation):
    fast = ivp("spherical-fast")
    dae = pose(fast, formulation)
    plain = dataclasses.replace(dae, module=uncompiled.kept_module(fast, formulation, "plain"))
    y, yp = somewhere(dae)
    assert np.allclose(residual(dae, y, yp), residual(plain, y, yp), rtol=0, atol=1e-13 * np.abs(y).max() ** 2)
    J, K = (np.full((dae.n, dae.n), np.nan) for _ in range(2))
    for each, JJ in ((dae, J), (plain, K)):
        assert each.jacobian(0.0, y, yp, np.empty(dae.n), 2.5, JJ, each.par) > SINGULAR
    assert np.allclose(J, K, rtol=0, atol=1e-13 * np.abs(K).max())


@cache
def fast_reference(t_end):
    """Positions of spherical_pendulum fig1.2 from its angles: th'' = sin th cos th phi'^2 + sin th, sin^2 th phi' constant."""
    L = 6.5 * np.sin(1.3)

    def f(_, x):
        turn = L / np.sin(x[0]) ** 2
        return [x[1], np.sin(x[0]) * np.cos(x[0]) * turn**2 + np.sin(x[0]), turn]

    times = np.linspace(0.0, t_end, 201)
    th, _, phi = solve_ivp(f, (0.0, t_end), [1.3, 3.0, 0.0], method="DOP853", rtol=3e-14, atol=1e-14, t_eval=times).y
    return np.stack([np.sin(th) * np.cos(phi), np.sin(th) * np.sin(phi), np.cos(th)], axis=1)


def fast_error(method, tol):
    trajectory = method.solve(initial_value_problem("spherical_pendulum", "fig1.2"), Request(value=tol, t_end=10.0, watch=())).complete()
    return np.abs(trajectory.q - fast_reference(10.0)).max()


@pytest.mark.exhaustive
@pytest.mark.parametrize(("variant", "bound"), [("index2", 5e-5), ("index1", 1e-3), ("ggl", 5e-4), ("baumgarte", 3e-4), ("ode", 3e-3)])
def test_error_on_the_fast_pendulum_at_a_tolerance_of_1e_8(variant, bound):
    assert fast_error(Ida(variant), 1e-8) < bound


MEASURED = [
    ("index2", 1e-12, 2e-9),
    ("index2", 1e-14, 3e-11),
    ("ggl", 1e-12, 1.3e-8),
    ("ggl", 1e-14, 3e-10),
    ("index1", 1e-12, 6e-7),
    ("index1", 1e-14, 2e-8),
    ("index3", 1e-12, 3e-5),
]


BOTH_WAYS = ("ggl", "index1")
"""Where round-off does not decide the steps, the error is met from below too; index 2 and 3 were seen to vary by a factor 5."""


@pytest.mark.exhaustive
@pytest.mark.parametrize(("variant", "tol", "measured"), MEASURED, ids=[f"{v}-{t:g}" for v, t, _ in MEASURED])
def test_tight_tolerances_deliver_what_was_measured_before(variant, tol, measured):
    error = fast_error(Ida(variant), tol)
    assert error < 3 * measured
    assert variant not in BOTH_WAYS or error > measured / 3
