"""The largest usable step: found where it is known, told where there is none, and gaps above it are seen."""

from dataclasses import replace

import pytest
from refusals import refused

from daebench.studies.grid.measure import row_of
from daebench.studies.grid.run_specification import GridRun
from daebench.studies.stability.step_limit import PART, completes, keeps_energy, largest_step

CELL = GridRun(problem="planar_pendulum", case="rotating", method="rattle", value=1.0, t_end=4.0, metrics=("energy",))


def limited(limit, *again):
    """Return runs that pass up to a step size, and in intervals above it."""
    return lambda specification: {
        "failure": "" if specification.value <= limit or any(a <= specification.value <= b for a, b in again) else "too large"
    }


def test_a_known_limit_is_found_to_the_digits_asked_for():
    for limit in [0.9, 0.3217, 1e-3, 1e-7]:
        found = largest_step(CELL, completes, largest=1.0, digits=5, run=limited(limit))
        assert found.h == pytest.approx(limit, rel=1e-5)
        assert found.h <= limit < found.fails
        assert (found.why, found.gaps) == ("too large", False)


def test_what_passes_above_the_limit_again_is_told():
    assert largest_step(CELL, completes, largest=1.0, run=limited(0.4, (0.54, 0.56))).gaps
    assert not largest_step(CELL, completes, largest=1.0, run=limited(0.4)).gaps


def test_where_all_pass_there_is_no_edge_and_where_none_does_there_is_no_step():
    whole, none = (largest_step(CELL, completes, largest=1.0, run=limited(limit)) for limit in (2.0, 0.0))
    assert (whole.h, whole.fails, whole.tried) == (1.0, float("inf"), 1)
    assert (none.h, none.why) == (0.0, "too large")


def test_rattle_on_the_pendulum_ends_where_its_equations_have_no_solution():
    found = largest_step(CELL, completes, largest=1.0)
    assert row_of(CELL.at(found.h))["failure"] == ""
    assert "did not converge" in found.why or "singular" in found.why
    tight = largest_step(CELL, keeps_energy, largest=1.0)
    assert tight.h < found.h
    within, beyond = (row_of(CELL.at(h)) for h in (tight.h, tight.fails))
    assert within["energy_error"] <= PART * within["energy_scale"]
    assert beyond["energy_error"] > PART * beyond["energy_scale"]


def test_what_cannot_be_bisected_is_refused():
    for code, specification, largest in [
        ("largest-step-own-steps", replace(CELL, method="scipy:RK45", value=1e-3), 1.0),
        ("largest-step-out-of-range", CELL, 2.0),
        ("largest-step-out-of-range", CELL, 0.0),
    ]:
        with refused(code):
            largest_step(specification, completes, largest=largest)
