"""Gradients of functionals of a run."""

import numpy as np
import pytest
from refusals import refused

import daebench
from daebench.diagnostics.derivative import DerivativeWarning
from daebench.errors import RunFailed

SWING = {"problem": "planar_pendulum", "case": "horizontal", "method": "rattle", "h": 0.05, "steps": 60}


def test_the_gradient_of_an_integral_is_what_differences_of_runs_tend_to():
    def action(t, q, p):
        return np.trapezoid(0.5 * (p**2).sum(axis=1) - q[:, 1], t)

    found = daebench.gradient(action, **SWING, sensitivities=["gravity", "length"])
    assert found.value == action(found.trajectory.t, found.trajectory.q, found.trajectory.p)
    for name in ("gravity", "length"):
        forth, back = (daebench.run(**SWING, parameters={name: 1 + s}, project=True) for s in (1e-5, -1e-5))
        quotient = (action(forth.t, forth.q, forth.p) - action(back.t, back.q, back.p)) / 2e-5
        assert abs(found.derivatives[name] - quotient) < 1e-8


@pytest.mark.slow
def test_the_gradient_by_initial_values_is_a_vector_along_the_manifold():
    found = daebench.gradient(lambda t, q, p: q[-1, 1] ** 2, **SWING, sensitivities=["q0", "gravity"])
    run = found.trajectory
    assert np.array_equal(found.derivatives["q0"], 2 * run.q[-1, 1] * run.sensitivities["q0"]["q"][-1, 1])
    assert found.derivatives["q0"][0] == 0
    assert isinstance(found.derivatives["gravity"], float)


def test_a_functional_that_drops_imaginary_parts_is_differentiated_by_differences_with_a_warning():
    smooth = daebench.gradient(lambda t, q, p: -q[-1, 1], **SWING, sensitivities=["gravity"])
    with pytest.warns(DerivativeWarning, match="drops imaginary parts"):
        found = daebench.gradient(lambda t, q, p: -float(np.real(q[-1, 1])), **SWING, sensitivities=["gravity"])
    assert abs(found.derivatives["gravity"] - smooth.derivatives["gravity"]) < 1e-8


BAD = [
    (lambda t, q, p: q[-1], "functional-not-a-number", ["gravity"]),
    (lambda t, q, p: np.nan, "functional-not-finite", ["gravity"]),
    (lambda t, q, p: q[-1, 1], "gradient-without-quantities", []),
]


def test_what_has_no_gradient_is_refused():
    for functional, code, by in BAD:
        with refused(code):
            daebench.gradient(functional, **SWING, sensitivities=by)


@pytest.mark.slow
def test_a_run_that_stops_has_no_gradient():
    with pytest.raises(RunFailed, match="stopped at t"):
        daebench.gradient(
            lambda t, q, p: q[-1, 1],
            "spherical_pendulum",
            case="fig1.2",
            method="se",
            h=0.01,
            steps=1000,
            sensitivities=["gravity"],
        )
