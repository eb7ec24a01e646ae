"""Chaos over planes of starts: the starts, the verdicts on problems with known answers, and what is refused."""

import numpy as np
import pytest
from refusals import refused

import daebench
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.studies.chaos.cells import NO_ENERGY, NO_POSITION
from daebench.studies.chaos.plane import plane_of

INTEGRABLE = [
    ("spherical_pendulum", "fig1.2", "rattle", {"q1": (-0.6, 0.6), "p2": (-2, 2)}),
    ("rigid_body_rotation", "free", "rattle", {"q2": (-0.3, 0.3), "q3": (-0.3, 0.3)}),
    ("free_rigid_body", "hlw", "lie", {"y1": (0.1, 0.9), "y2": (-0.4, 0.4)}),
]
"""Integrable problems, whose exponents are zero."""


def on(problem, case, cells=12, **settings):
    return plane_of(initial_value_problem(problem, case), settings.pop("names", None), cells=cells, h=0.01, **settings)


def test_starts_have_the_coordinates_of_their_cells_exactly_and_are_on_the_manifold():
    plane = on("double_pendulum", "horizontal", names={"q1": (-1.2, 1.2), "p3": (-6, 6)}, energy=-5.0)
    p, q = plane.members.start
    np.testing.assert_array_equal(q[:, 0], np.tile(plane.across, 12)[plane.cells])
    np.testing.assert_array_equal(p[:, 2], np.repeat(plane.up, 12)[plane.cells])
    for name, arguments in (("g", (q,)), ("Gv", (p, q))):
        assert np.max(np.abs(plane.members.along(name, *arguments))) < 1e-12
    np.testing.assert_allclose(plane.members.along("H", p, q), -5.0, atol=1e-12)


def test_neighbours_are_on_one_branch():
    plane = on("spherical_pendulum", "fig1.2", cells=40, names={"q1": (-0.7, 0.7), "q2": (-0.6, 0.6)})
    height = plane.spread(plane.members.start[1][:, 2])
    assert len(plane.cells) == 1600
    assert len(np.unique(np.sign(height))) == 1


def test_empty_cells_say_why():
    plane = on("double_pendulum", "horizontal", names={"q1": (-1.2, 1.2), "p1": (-8, 8)}, energy="case")
    reasons = plane.reasons.reshape(plane.shape)
    outside = np.abs(plane.across) > 1
    assert np.all(reasons[:, outside] == NO_POSITION)
    assert np.any(reasons[:, ~outside] == NO_ENERGY)
    assert not np.any(reasons == "no momentum on the manifold")


def test_cells_without_a_start_of_the_energy_have_none_by_the_least_kinetic_energy():
    plane = on("spherical_pendulum", "fig1.1", names={"q1": (-0.5, 0.5), "q2": (-0.5, 0.5)}, energy=-0.95)
    x, y = np.meshgrid(plane.across, plane.up)
    possible = -np.sqrt(1 - x**2 - y**2) < -0.95  # U = z, of unit mass and gravity
    np.testing.assert_array_equal(plane.reasons.reshape(plane.shape) == "", possible)


def test_the_default_plane_has_two_independent_positions():
    assert on("double_pendulum", "horizontal").names == ("q2", "q4")
    assert on("planar_pendulum", "horizontal").names == ("q2", "p2")
    assert on("free_rigid_body", "hlw").names == ("y1", "y2")


@pytest.mark.sampled(by=lambda case: "rigid_body_rotation" not in case)
@pytest.mark.parametrize(("problem", "case", "method", "plane"), INTEGRABLE, ids=lambda x: x if isinstance(x, str) else "")
def test_nothing_is_chaotic_on_an_integrable_problem(problem, case, method, plane):
    t_end = 1000 if method == "lie" else 200  # its periods are long
    result = daebench.chaos(problem, case=case, method=method, h=0.02, t_end=t_end, plane=plane, cells=5)
    found = result.exponents
    assert not np.any(found.verdict == "chaotic")
    assert np.mean(found.verdict == "regular") > 0.9
    assert np.all(found.low == 0)
    assert np.median(found.megno) == pytest.approx(2, abs=0.3)


def test_the_exponent_of_an_integrable_problem_falls_with_time():
    settings = {"case": "fig1.2", "method": "rattle", "h": 0.02, "plane": INTEGRABLE[0][3], "cells": 4}
    medians = [np.median(daebench.chaos("spherical_pendulum", t_end=t, **settings).exponents.exponent) for t in (50, 500)]
    assert medians[1] < 0.2 * medians[0]


def test_the_double_pendulum_at_high_energy_is_chaotic():
    result = daebench.chaos(
        "double_pendulum", case="horizontal", method="rattle", h=0.01, t_end=60, plane={"q2": (0.5, 0.9), "q4": (0.6, 1.2)}, cells=5
    )
    found = result.exponents
    assert np.all(found.verdict == "chaotic")
    assert np.all(found.low > 0.3)
    assert np.all(found.high < 3)
    assert result.summary()["exponent"]["verdict"] == "chaotic"


@pytest.mark.exhaustive
def test_false_rates_on_known_answers():
    """Of starts of integrable problems none is called chaotic, of chaotic ones at most two in a hundred regular."""
    settings = {"h": 0.02, "t_end": 100, "cells": 10}
    for problem, case, method, plane in INTEGRABLE:
        verdicts = daebench.chaos(problem, case=case, method=method, plane=plane, **settings).exponents.verdict
        assert not np.any(verdicts == "chaotic")
        assert np.mean(verdicts == "regular") > 0.95
    plane = {"q2": (0.6, 0.99), "q4": (0.6, 1.6)}
    sea = daebench.chaos("double_pendulum", case="horizontal", method="rattle", h=0.005, t_end=60, plane=plane, cells=10)
    assert np.mean(sea.exponents.verdict == "regular") <= 0.02
    assert np.mean(sea.exponents.verdict == "chaotic") > 0.9


def test_a_section_cuts_where_the_coordinate_has_the_value(tmp_path):
    result = daebench.chaos(
        "double_pendulum",
        case="horizontal",
        method="rattle",
        h=0.01,
        t_end=6,
        plane={"q1": (-0.6, 0.6), "p1": (-2, 2)},
        cells=3,
        energy=-20,
        section={"q3": 0.0},
    )
    assert result.section is not None
    assert len(result.section.start) > 10
    assert np.all(result.plane.members.start[1][:, 2] == 0)
    assert np.max(np.abs(result.section.across)) < 1
    assert {path.suffix for path in result.write(tmp_path) if path.is_file()} == {".csv", ".svg"}


REFUSED = [
    ("plane-not-two-coordinates", {"plane": {"q1": (0, 1)}}),
    ("unknown-name", {"plane": {"q1": (0, 1), "q9": None}}),
    ("bounds-out-of-order", {"plane": {"q1": (1, 0), "p1": None}}),
    ("plane-without-starts", {"plane": {"q1": (2, 3), "q3": (0, 1)}}),
    ("plane-energy-malformed", {"energy": "high"}),
    ("cells-out-of-range", {"cells": 1}),
    ("exponent-of-few-steps", {"t_end": 0.1}),
    ("section-without-energy", {"section": {"q3": 0.0}}),
    ("not-a-fixed-step-method", {"method": "ida:index2"}),
    ("below-least", {"seed": -1}),
]


def test_what_cannot_be_done_is_refused():
    for code, changed in REFUSED:
        with refused(code):
            daebench.chaos("double_pendulum", **{"case": "horizontal", "method": "rattle", "h": 0.01, "t_end": 1, "cells": 4, **changed})


def test_a_poisson_system_has_no_energy_to_be_moved_to():
    with refused("poisson-not-constrained"):
        daebench.chaos("free_rigid_body", method="lie", h=0.01, t_end=1, energy=0.3, cells=4)
