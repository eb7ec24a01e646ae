"""Derivatives by the variational equations that IDA solves: against a closed form, and against the tangent of fine steps."""

import numpy as np
import pytest
from differentiated import derivatives, states
from measures import error_of
from swinging import errors_of_swing, released

import daebench

SWING = {"problem": "planar_pendulum", "case": "horizontal", **released(1.0), "t_end": 5, "points": 6}


FORMULATIONS = ["index2", *(pytest.param(name, marks=pytest.mark.slow) for name in ("index1", "ggl", "baumgarte"))]


@pytest.mark.sampled(left_out=("index2", "ggl", "baumgarte"))
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_derivatives_of_a_pendulum_are_those_of_its_closed_form(formulation):
    run = daebench.run(**SWING, method=f"ida:{formulation}", tol=1e-12, sensitivities=["gravity", "q0"])
    assert run.failure is None
    assert errors_of_swing(run, 1.0).max() < 1e-8


def test_errors_of_derivatives_follow_the_tolerance():
    """Derivatives are in the error test: with the tolerance their errors fall as those of the states do."""
    runs = [daebench.run(**SWING, method="ida:index2", tol=tol, sensitivities=["gravity", "q0"]) for tol in (1e-5, 1e-8, 1e-11)]
    coarse, middle, fine = (errors_of_swing(run, 1.0).max() for run in runs)
    assert fine < 1e-3 * middle * 10 < 1e-5 * coarse * 10
    plain = daebench.run(**SWING, method="ida:index2", tol=1e-8)
    assert runs[1].steps > plain.steps


def test_python_callbacks_take_the_same_steps():
    settings = {**SWING, "method": "ida:index2", "tol": 1e-9, "sensitivities": ["gravity", "q0"]}
    native, python = (daebench.run(**settings, callbacks=callbacks) for callbacks in ("native", "python"))
    assert (native.steps, native.work) == (python.steps, python.work)
    assert error_of(derivatives(native), derivatives(python)) < 1e-14


ROWS = [
    ("slider_crank", "turning", "index2", ["crank", "slider_mass", "q0", "p0"]),
    ("double_pendulum", "swing", "index1", ["mass1", "length2", "gravity"]),
    ("spherical_pendulum", "fig1.2", "ggl", ["mass", "length", "p0"]),
    ("torus", "trough", "baumgarte", ["radius", "q0"]),
    ("free_rigid_body", None, "ode", ["I1", "y0"]),
    ("free_rigid_body", None, "casimirs", ["I1", "y0"]),
]


def difference_from_fine_steps(problem, case, formulation, names, scheme, h):
    """Return the largest difference of derivatives from those of a scheme with fine steps, relative to their size, at times up to 1."""
    settings = {"problem": problem, "case": case, "sensitivities": names, "t_end": 1}
    run = daebench.run(**settings, method=f"ida:{formulation}", tol=1e-12, points=5)
    fine = daebench.run(**settings, method=scheme, h=h, every=round(0.25 / h))
    assert run.failure is fine.failure is None
    assert list(run.sensitivities) == list(fine.sensitivities)
    found, expected = derivatives(run), derivatives(fine)
    assert np.array_equal(found[0], expected[0])
    return error_of(found, expected) / np.abs(expected).max()


@pytest.mark.sampled(by=lambda case: case == "free_rigid_body-casimirs", slow=("free_rigid_body-casimirs",))
@pytest.mark.parametrize(("problem", "case", "formulation", "names"), ROWS, ids=[f"{row[0]}-{row[2]}" for row in ROWS])
def test_derivatives_are_those_of_fine_steps(problem, case, formulation, names):
    scheme, h, bound = ("rattle/kahan_li8", 0.005, 1e-8) if case else ("strang/kahan_li8", 0.01, 1e-9)
    assert difference_from_fine_steps(problem, case, formulation, names, scheme, h) < bound


@pytest.mark.exhaustive
@pytest.mark.parametrize("tol", [1e-7, 1e-10])
def test_derivatives_at_index_3_are_as_far_off_as_its_states(tol):
    """With blocks on the diagonal of Newton's matrix alone it takes 800 times as many steps at 1e-10, and no digit is right."""
    settings = {"problem": "spherical_pendulum", "case": "fig1.2", "t_end": 1}
    plain, run = (daebench.run(**settings, method="ida:index3", tol=tol, points=5, sensitivities=s) for s in ((), ("gravity", "length")))
    fine = daebench.run(**settings, method="rattle/kahan_li8", h=0.005, every=50, sensitivities=("gravity", "length"))
    off, states_off = (error_of(a, b) / np.abs(b).max() for a, b in ((derivatives(run), derivatives(fine)), (states(run), states(fine))))
    assert off < 10 * states_off
    assert run.steps < 2 * plain.steps


@pytest.mark.exhaustive
@pytest.mark.parametrize("place", ["stretched-M", "stretched-H"])
def test_a_mass_matrix_that_moves_and_momenta_as_unknowns_are_differentiated(place, get_ivp):
    where = get_ivp(place)
    assert difference_from_fine_steps(where, None, "index2", [*where.parameters, "q0", "p0"], "lobatto4", 0.005) < 1e-8
