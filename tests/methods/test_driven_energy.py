"""A driven mechanism runs to its end in every formulation, and the work of its drivers is the energy that it gained."""

import numpy as np
import pytest
from measures import error_of

import daebench

HEAVY = {"stiffness": 6e4, "load_mass": 100.0}


@pytest.mark.sampled(by=lambda case: case == "index3")
@pytest.mark.parametrize("formulation", ["index1", "index3", "baumgarte"])
def test_the_energy_received_stays_that_of_the_motion_without_multipliers_in_the_error_test(formulation):
    """The oracle is the work in a run of SciPy's DOP853 on the equation without multipliers, which has p_t in its error test."""
    run = daebench.run("driven_slider_crank", method=f"ida:{formulation}", tol=1e-8, t_end=3, parameters=HEAVY).complete()
    exact = daebench.run("driven_slider_crank", method="scipy:DOP853", tol=1e-12, t_end=3, parameters=HEAVY).complete()
    assert error_of(run.q, exact.q) < 1e-4
    received, swing = -exact.p[:, -1], np.ptp(exact.p[:, -1])
    assert error_of(-run.p[:, -1], received) < 0.05 * swing


def test_a_fast_drive_is_no_singularity():
    assert daebench.run("driven_slider_crank", method="ida:index2", tol=1e-8, t_end=8, parameters={"speed": 60.0}).failure is None
