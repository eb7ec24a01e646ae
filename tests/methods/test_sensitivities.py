"""Derivatives of runs of fixed-step schemes: against closed forms, complex step, and what a tangent map must keep."""

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from differentiated import by_complex_step, derivatives, states
from measures import error_of
from swinging import errors_of_swing, released, slopes, swing

import daebench
from daebench import Case, ConstrainedHamiltonian
from daebench.errors import BadInput

ALL = ["length", "gravity", "p0", "q0"]
SWING = {"problem": "planar_pendulum", "case": "horizontal", "method": "rattle"}
ROUND_OFF = 1e-12


def falling(**settings):
    return daebench.run(**SWING, sensitivities=ALL, **settings)


def test_derivatives_of_a_pendulum_are_those_of_its_closed_form():
    settings = SWING | {"method": "rattle/kahan_li8"} | released(1.0)
    run = daebench.run(**settings, h=0.05, t_end=5, every=25, sensitivities=ALL)
    assert run.failure is None
    assert errors_of_swing(run, 1.0).max() < 1e-8


def test_a_start_that_a_parameter_leaves_behind_is_moved_along_the_normal():
    """The horizontal start is (1, 0) for any length, and is put back at (length, 0): that of the closed form with both lengths changed."""
    run = falling(h=0.002, t_end=2, every=500)
    for n, t in enumerate(run.t[1:], start=1):
        by_length = slopes(lambda length, t=t: swing(mp.pi / 2, length, 1, mp.mpf(float(t))), 1)
        assert error_of(run.sensitivities["length"]["q"][n], by_length) < 1e-5
    assert run.sensitivities["length"]["q"][0].tolist() == [1, 0]


def test_about_a_pendulum_at_rest_the_tangent_of_rattle_is_that_of_verlet():
    """Values are then found at once, and derivatives are not: dq1(t_n)/dq0_1 = cos(n phi) with cos phi = 1 - h^2/2."""
    run = falling(q0=[0.0, -1.0], p0=[0.0, 0.0], h=0.3, steps=200)
    phi = np.arccos(1 - 0.3**2 / 2)
    assert np.abs(run.q[:, 0]).max() == 0
    assert error_of(run.sensitivities["q0"]["q"][:, 0, 0], np.cos(phi * np.arange(201))) < ROUND_OFF


@pytest.mark.slow
def test_parameters_in_the_expressions_of_a_start_are_differentiated():
    a, gamma = sp.symbols("steepness gravity", positive=True)
    q, p = sp.symbols("q1:3", real=True), sp.symbols("p1:3", real=True)
    bead = ConstrainedHamiltonian(
        q=q,
        p=p,
        M=sp.eye(2),
        U=gamma * q[1],
        g=[q[1] - a * q[0] ** 2],
        parameters={a: 1.5, gamma: 9.81},
        cases={"left": Case(q=(-1, a), p=(0, 0), about="")},
    )
    run = daebench.run(bead, method="rattle", h=0.01, steps=20, sensitivities=["steepness"])
    assert error_of(run.sensitivities["steepness"]["q"][0], [0, 1]) < ROUND_OFF
    end = by_complex_step(bead, ["steepness"], method="rattle", h=0.01, steps=20)
    assert error_of(derivatives(run)[-1], end) < ROUND_OFF


def held_against_complex_step(problem, names, *, case=None, **settings):
    """Hold derivatives, values, maxima and work of a run against complex step, and against a run without derivatives."""
    plain = daebench.run(problem, case=case, every=settings["steps"], **settings)
    run = daebench.run(problem, case=case, every=settings["steps"], sensitivities=names, **settings)
    assert run.failure is None
    assert np.array_equal(states(run), states(plain))
    assert (run.maxima, run.work, run.pivot) == (plain.maxima, plain.work, plain.pivot)
    expected = by_complex_step(problem, names, case=case, **settings)
    scale = np.maximum(np.abs(expected).max(axis=0), 1e-300)
    assert (np.abs(derivatives(run)[-1] - expected) / scale).max() < 1e-10


ROWS = [
    *(
        ("spherical_pendulum", "fig1.2", name, ["mass", "gravity", "q0"], 0.01)
        for name in (
            *("symplectic_euler", "symplectic_euler_adjoint", "shake", "se", "seproj", "implicit_euler", "lobatto3", "lobatto6", "gauss2"),
            *("midpoint", "rk4", "generalized_alpha", "energy_momentum", "lie", "lie_adjoint", "strang", "rattle_gauss_seidel"),
            *("radau2_index2", "radau2_ggl", "rattle/suzuki4", "midpoint+symproj", "rk4+proj"),
            *("local:midpoint", "canonical:se", "baumgarte:rk4"),
        )
    ),
    ("slider_crank", "turning", "rattle", ["crank", "rod", "slider_mass", "gravity"], 0.005),
    ("four_bar", "iftomm", "rattle", ["mass", "length", "gravity"], 0.01),
    ("butane", "trans", "rattle", ["C0", "bond", "angle", "methyl"], 0.01),
    ("torus", "trough", "rattle", ["radius", "tube", "q0"], 0.01),
    ("rigid_body_rotation", "heavy_top", "rattle", ["I1", "gravity"], 0.001),
    ("double_pendulum", "swing", "lobatto4", ["mass1", "length2", "p0"], 0.01),
    ("two_bodies_on_sphere", "gni", "rattle", ["mass1", "strength"], 0.01),
    ("free_rigid_body", None, "strang", ["I1", "y0"], 0.005),
    ("free_rigid_body", None, "midpoint", ["I1", "y0"], 0.005),
    ("lotka_volterra", None, "symplectic_euler", ["y0"], 0.005),
    ("lotka_volterra", None, "verlet/suzuki4", ["y0"], 0.005),
    ("lotka_volterra", None, "darboux:verlet", ["y0"], 0.005),
    ("heavy_top_lie_poisson", None, "rk4", ["I1", "y0"], 0.005),
]
GATE = ("spherical_pendulum-lobatto3", "lotka_volterra-symplectic_euler")
"""What the gate takes: each row compiles a kernel of dual numbers."""


@pytest.mark.sampled(by=lambda case: case in GATE)
@pytest.mark.parametrize(("problem", "case", "method", "names", "h"), ROWS, ids=[f"{row[0]}-{row[2]}" for row in ROWS])
def test_derivatives_are_those_of_complex_step(problem, case, method, names, h):
    held_against_complex_step(problem, names, case=case, method=method, h=h, steps=20, **{} if case else {"anyway": True})


# ---- runs that do not come to their end ----------------------------------------------------------------------------------


@pytest.mark.filterwarnings("ignore::daebench.errors.LostMotion")
def test_a_run_that_stops_keeps_the_derivatives_so_far():
    settings = {"problem": "spherical_pendulum", "case": "fig1.2", "method": "se", "h": 0.01, "steps": 1000}
    plain, run = daebench.run(**settings), daebench.run(**settings, sensitivities=["gravity"])
    assert run.failure == plain.failure
    assert run.failure is not None
    assert np.array_equal(run.q, plain.q)
    assert run.sensitivities["gravity"]["q"].shape == run.q.shape
    shorter = daebench.run(**settings | {"steps": run.steps}, sensitivities=["gravity"])
    assert np.array_equal(shorter.sensitivities["gravity"]["q"], run.sensitivities["gravity"]["q"])


def test_derivatives_that_overflow_end_a_run_whose_values_are_finite():
    """A pendulum that stands on its head stays there; what is next to it leaves it as exp(t)."""
    run = falling(q0=[0.0, 1.0], p0=[0.0, 0.0], h=0.1, steps=8000, every=1000)
    assert "derivatives of the states are no longer finite" in run.failure
    assert 700 < run.t[-1] < 720
    assert np.isfinite(derivatives(run)).all()


def test_output_of_the_end_alone_has_the_derivatives_of_start_and_end():
    whole, end = falling(h=0.1, steps=15), falling(h=0.1, steps=15, every=0)
    assert np.array_equal(derivatives(end), derivatives(whole)[[0, -1]])
    some = falling(h=0.1, steps=15, every=10)
    assert np.array_equal(derivatives(some), derivatives(whole)[[0, 10, 15]])


# ---- what is refused -----------------------------------------------------------------------------------------------------

REFUSED = [
    ({"sensitivities": ["gravty"]}, "gravty"),
    ({"sensitivities": ["y0"]}, "q0 or p0"),
    ({"sensitivities": ["gravity", "gravity"]}, "twice"),
    ({"problem": "pendulum_chain", "case": None, "sensitivities": ["links"]}, "whole number"),
    ({"method": "cvode:bdf", "h": None, "steps": None, "tol": 1e-8, "t_end": 1}, "cvode:bdf has no sensitivities"),
    ({"method": "ida:ode", "h": None, "steps": None, "tol": 1e-8, "t_end": 1}, "use ida:index2"),
    ({"method": lambda p, q, h: (p, q)}, "no sensitivities"),
    ({"problem": "pendulum_chain", "case": None, "parameters": {"links": 20}}, "arrays"),
    ({"precision": "float32"}, "float32"),
]


@pytest.mark.parametrize(("changed", "sentence"), REFUSED, ids=[sentence[:30] for _, sentence in REFUSED])
def test_what_cannot_be_differentiated_is_refused_in_a_sentence(changed, sentence):
    with pytest.raises(BadInput, match=sentence):
        daebench.run(**{**SWING, "h": 0.1, "steps": 1, "sensitivities": ["gravity"]} | changed)


@pytest.mark.exhaustive
def test_compensated_sums_are_differentiated():
    settings = {"case": "fig1.2", "method": "rattle", "h": 0.01, "steps": 100, "compensated": True}
    held_against_complex_step("spherical_pendulum", ["mass", "gravity"], **settings)


@pytest.mark.exhaustive
@pytest.mark.parametrize("scheme", ["rattle", "symplectic_euler", "lobatto2", "energy_momentum", "gauss2"])
@pytest.mark.parametrize("place", ["stretched-M", "stretched-H"])
def test_a_hamiltonian_that_is_not_separable_agrees_with_complex_step(place, scheme, get_ivp):
    where = get_ivp(place)
    held_against_complex_step(where, [*where.parameters, "q0"], method=scheme, h=0.01, steps=20)


@pytest.mark.exhaustive
def test_redundant_constraints_solved_by_least_squares_agree_with_complex_step():
    held_against_complex_step("four_bar", ["mass", "gravity"], method="rattle", h=0.01, steps=20, on_singular="least-squares")
