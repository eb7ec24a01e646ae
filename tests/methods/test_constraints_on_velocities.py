"""Constraints on velocities in every formulation and solver, against a knife edge on an incline, whose motion is known."""

import numpy as np
import pytest
import sympy as sp

import daebench
from daebench import Case, ConstrainedHamiltonian

MASS, INERTIA, GRAVITY, TURN, DRIFT = 1.25, 0.13, 9.81 * np.sqrt(0.5), np.pi / 3, 0.7
T = 3.0
SOLVERS = ["ida:index2", "ida:index1", "ida:baumgarte", "ida:ode", "cvode:bdf:projected", "scipy:DOP853", "solve_dae:Radau"]
STEPS = ["dla", "gauss2", "gauss2+proj", "rk4", "rk4+proj", "baumgarte:gauss2"]
ERRORS = {"dla": 3e-4}


def exact(t):
    """Return x, y and the angle of the knife edge, which starts at rest and turns at a constant rate."""
    c, turned = GRAVITY / TURN, TURN * t
    return np.array([c * np.sin(turned) ** 2 / (2 * TURN), c * (t / 2 - np.sin(2 * turned) / (4 * TURN)), turned])


def force(t):
    """Return lam, from m y'' = lam cos(phi) with y of the closed form."""
    return 2 * MASS * GRAVITY * np.sin(TURN * t)


def edge(*, drift=0.0, points=False):
    """Return the knife edge on a surface that moves along x, with an angle or with its cosine and sine, which g holds together."""
    q, p, v = (sp.symbols(f"{of}1:{5 if points else 4}", real=True) for of in "qpw")
    sine, cosine = (q[3], q[2]) if points else (sp.sin(q[2]), sp.cos(q[2]))
    turning = (0, INERTIA * TURN) if points else (INERTIA * TURN,)
    return ConstrainedHamiltonian(
        q=q,
        p=p,
        v=v,
        M=sp.diag(MASS, MASS, *[INERTIA] * (1 + points)),
        U=-MASS * GRAVITY * q[0],
        g=[q[2] ** 2 + q[3] ** 2 - 1] if points else [],
        velocity=[sine * (v[0] - drift) - cosine * v[1]],
        cases={"turning": Case(q=(0, 0, 1, 0) if points else (0, 0, 0), p=(MASS * drift, 0, *turning))},
    )


def error(problem, method, drift=0.0):
    """Return the error of x and y at the end of a run, and the run."""
    knob = {"h": 0.01} if method in STEPS else {"tol": 1e-9}
    run = daebench.run(problem, method=method, t_end=T, multipliers=True, **knob)
    return float(np.abs(run.q[-1, :2] - exact(T)[:2] - [drift * T, 0]).max()), run


@pytest.mark.sampled(by=lambda case: case in ("ida:ggl", "ida:index1", "cvode:bdf:projected", "dla", "rk4+proj"))
@pytest.mark.parametrize("method", ["ida:ggl", *SOLVERS, *STEPS])
def test_constraints_on_positions_and_on_velocities_hold_together(method):
    off, run = error(edge(points=True), method)
    assert off < ERRORS.get(method, 1e-6)
    assert run.maxima["g"] < 1e-4
    if method in ("dla", "gauss2+proj", "rk4+proj"):
        assert run.maxima["g"] < 1e-13
        assert run.maxima["Gv"] < 1e-13


@pytest.mark.sampled(by=("ida:baumgarte", "ida:ode", "scipy:DOP853", "dla", "gauss2", "rk4+proj").__contains__)
@pytest.mark.parametrize("method", [*SOLVERS, *STEPS])
def test_the_motion_on_a_surface_that_moves_is_that_of_the_closed_form(method):
    off, run = error(edge(drift=DRIFT), method, DRIFT)
    assert off < ERRORS.get(method, 5e-7)
    assert run.lam is not None
    assert np.allclose(run.lam[:, 0], np.array([force(t) for t in run.t]), atol=1e-2 if method == "dla" else 1e-5)
    # The energy itself changes by the power -a lam of the surface; K = H + p_t does not.
    assert run.maxima["energy"] < (5e-3 if method == "dla" else 1e-4)
    assert abs(run.p[-1, -1]) > 0.1


def test_methods_for_constraints_on_positions_are_refused():
    for method in ("rattle", "shake", "lobatto3", "strang", "se", "gauss2+symproj", "local:gauss2", "stiff:gauss2"):
        with pytest.raises(daebench.BadInput, match="velocit"):
            daebench.run(edge(), method=method, h=0.01, t_end=0.1)
    with pytest.raises(daebench.BadInput, match="velocit"):
        daebench.run("planar_pendulum", method="dla", h=0.01, t_end=0.1)


def test_a_formulation_with_g_in_it_is_refused_where_constraints_are_on_velocities():
    for formulation, points in (("index3", False), ("index3", True), ("ggl", False)):
        with pytest.raises(daebench.BadInput, match="use ida:index2"):
            daebench.run(edge(points=points), method=f"ida:{formulation}", tol=1e-6, t_end=0.1)


def test_a_start_off_the_constraint_is_refused_and_projected():
    with pytest.raises(daebench.InconsistentStart):
        daebench.run(edge(), method="rk4", h=0.01, t_end=0.1, q0=[0, 0, 0.4], v0=[1, 0, 2])
    run = daebench.run(edge(), method="rk4", h=0.01, t_end=0.1, q0=[0, 0, 0.4], v0=[1, 0, 2], project=True)
    along = np.array([np.cos(0.4), np.sin(0.4)])
    assert np.allclose(run.p[0, :2] / MASS, along * along[0], atol=1e-15)
