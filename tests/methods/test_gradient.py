"""Gradients of functionals of a run."""

import numpy as np
import pytest
from differentiated import complex_runs

import daebench
from daebench.diagnostics.derivative import DerivativeWarning
from daebench.errors import BadInput, RunFailed
from daebench.runs.directions import STEP

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


LONG = [
    ("spherical_pendulum", "fig1.2", 0.01, ["mass", "length", "gravity"]),
    ("slider_crank", "turning", 0.005, ["crank", "rod", "slider_mass", "gravity"]),
]


@pytest.mark.sampled(left_out=("spherical_pendulum",))
@pytest.mark.slow
@pytest.mark.parametrize(
    ("problem", "case", "h", "names"),
    [pytest.param(*row, id=row[0], marks=[pytest.mark.exhaustive] * i) for i, row in enumerate(LONG)],
)
def test_the_gradient_over_a_hundred_thousand_steps_is_that_of_complex_step(problem, case, h, names):
    """Complex numbers round values otherwise, and the motion makes 1e-10 to 1e-9 of that: hence the scale, of what is added up."""
    settings = {"case": case, "method": "rattle", "h": h, "steps": 100_000, "every": 1}
    found = daebench.gradient(lambda t, q, p: np.trapezoid(q[:, -1], t) / t[-1], problem, sensitivities=names, **settings)
    t = found.trajectory.t
    for name, rows in zip(names, complex_runs(problem, names, **settings), strict=True):
        slopes = rows[:, -1].imag / STEP
        expected, size = (np.trapezoid(values, t) / t[-1] for values in (slopes, np.abs(slopes)))
        assert abs(found.derivatives[name] - expected) < min(1e-12 * size, 1e-9 * abs(expected))


@pytest.mark.slow
def test_the_gradient_by_initial_values_is_a_vector_along_the_manifold():
    found = daebench.gradient(lambda t, q, p: q[-1, 1] ** 2, **SWING, sensitivities=["q0", "gravity"])
    run = found.trajectory
    assert np.array_equal(found.derivatives["q0"], 2 * run.q[-1, 1] * run.sensitivities["q0"]["q"][-1, 1])
    assert found.derivatives["q0"][0] == 0
    assert isinstance(found.derivatives["gravity"], float)


@pytest.mark.sampled(left_out=("abs",), slow=("real",))
@pytest.mark.parametrize("drops", [lambda t, q, p: abs(q[-1, 1]), lambda t, q, p: -float(np.real(q[-1, 1]))], ids=["abs", "real"])
def test_a_functional_that_drops_imaginary_parts_is_differentiated_by_differences_with_a_warning(drops):
    smooth = daebench.gradient(lambda t, q, p: -q[-1, 1], **SWING, sensitivities=["gravity"])
    with pytest.warns(DerivativeWarning, match="drops imaginary parts"):
        found = daebench.gradient(drops, **SWING, sensitivities=["gravity"])
    assert abs(found.derivatives["gravity"] - smooth.derivatives["gravity"]) < 1e-8


BAD = [
    (lambda t, q, p: q[-1], "an array of shape \\(2,\\)"),
    (lambda t, q, p: np.nan, "the functional is nan on this run"),
]


@pytest.mark.parametrize(("functional", "sentence"), BAD, ids=["array", "nan"])
def test_a_functional_that_is_no_finite_number_is_refused(functional, sentence):
    with pytest.raises(BadInput, match=sentence):
        daebench.gradient(functional, **SWING, sensitivities=["gravity"])


def test_a_gradient_by_nothing_is_refused():
    with pytest.raises(BadInput, match="needs quantities to differentiate by"):
        daebench.gradient(lambda t, q, p: q[-1, 1], **SWING, sensitivities=[])


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
