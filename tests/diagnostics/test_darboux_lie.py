"""Canonical coordinates of three-dimensional systems by following lines, against those that are known in closed form."""

import numpy as np
import pytest
import sympy as sp
from refusals import refused

from daebench.diagnostics.darboux_lie import darboux_lie
from daebench.problems.free_rigid_body import problem as free_rigid_body
from daebench.problems.heavy_top_lie_poisson import problem as heavy_top
from daebench.problems.lotka_volterra_3d import problem as three_species
from daebench.systems.poisson import PoissonSystem

PLACES = {"sphere": (free_rigid_body, (0.3, 0.5, 0.9)), "pole": (free_rigid_body, (0, 0, -1)), "species": (three_species, (0.5, 0.7, 0.9))}


def near(y0, random):
    return np.array(y0) + random.uniform(-0.25, 0.25, 3)


@pytest.mark.parametrize("place", PLACES)
def test_the_brackets_are_canonical_around_the_point(place, random):
    build, y0 = PLACES[place]
    found = darboux_lie(build(), y0)
    for _ in range(5):
        assert found.defect(near(y0, random)) < 1e-10


@pytest.mark.parametrize("place", PLACES)
def test_at_the_point_itself_the_coordinates_are_those_of_the_definition(place):
    build, y0 = PLACES[place]
    found = darboux_lie(build(), y0)
    assert (found.Q(y0), found.P(y0), found.C(y0)) == (y0[found.i], 0, y0[found.k])
    assert found.defect(y0) < 1e-10


def test_around_the_north_pole_of_a_sphere_the_coordinates_are_known(random):
    """There Q = y1, and y' = (0, -y3, y2) is a rotation: P is minus the angle from the plane y2 = 0, and C the radius."""
    found = darboux_lie(free_rigid_body(), (0, 0, 1))
    for _ in range(5):
        y = near((0, 0, 1), random)
        assert found.Q(y) == y[0]
        assert found.P(y) == pytest.approx(-np.arctan2(y[1], y[2]), abs=1e-11)
        assert found.C(y) == pytest.approx(np.linalg.norm(y), abs=1e-11)


def test_states_with_one_value_of_the_casimir_function_have_one_value_of_C(random):
    """Of three species: y3/(y1 y2) is moved along its level set, and off it."""
    y0 = np.array([0.5, 0.7, 0.9])
    found = darboux_lie(three_species(), y0)
    for _ in range(5):
        y1, y2 = y0[:2] * random.uniform(0.8, 1.2, 2)
        level = np.array([y1, y2, y0[2] / (y0[0] * y0[1]) * y1 * y2])
        assert found.C(level) == pytest.approx(y0[found.k], abs=1e-11)
        assert abs(found.C(level * [1, 1, 1.1]) - y0[found.k]) > 0.01


def test_a_wrong_structure_matrix_shows_in_the_brackets():
    """Handed a B without the Jacobi identity the flows do not commute, and C is none."""
    found = darboux_lie(free_rigid_body(), (0.3, 0.5, 0.9))
    right = found.B

    def wrong(y):
        scaled = right(y)
        scaled[0, 2], scaled[2, 0] = 2 * y[1] * y[0], -2 * y[1] * y[0]
        return scaled

    object.__setattr__(found, "B", wrong)
    assert found.defect((0.4, 0.4, 0.8)) > 1e-3


def flat(z):
    x, y = sp.symbols("x y", real=True)
    return PoissonSystem(y=(x, y, z), B=sp.Matrix([[0, z, 0], [-z, 0, 0], [0, 0, 0]]), H=x**2 + y**2, domain=(4 - x**2,))


@pytest.mark.parametrize(
    ("build", "y0", "code"),
    [
        (heavy_top, (0, 0, 0), "darboux-not-three-dimensional"),
        (free_rigid_body, (0, 0), "darboux-point-malformed"),
        (free_rigid_body, (0, 0, np.nan), "darboux-point-malformed"),
        (three_species, (1, -1, 1), "darboux-point-outside-domain"),
        (free_rigid_body, (0, 0, 0), "darboux-matrix-vanishes"),
    ],
    ids=["six coordinates", "two numbers", "NaN", "outside", "rank zero"],
)
def test_a_point_or_system_without_the_theorem_is_refused(build, y0, code):
    with refused(code):
        darboux_lie(build(), y0)


@pytest.mark.parametrize(
    ("build", "y0", "y"),
    [
        (free_rigid_body, (0, 0, 1), (0, 1, -0.5)),
        (three_species, (0.5, 0.7, 0.9), (0.001, 0.001, 0.9)),
        (three_species, (0.5, 0.7, 0.9), (-1, 0.7, 0.9)),
        (lambda: flat(sp.Symbol("z", real=True)), (0, 0, 1), (3, 0, 1)),
    ],
    ids=["past the equator", "too far", "negative", "off the domain"],
)
def test_a_line_that_leaves_the_neighbourhood_is_refused(build, y0, y):
    found = darboux_lie(build(), y0)
    with refused("darboux-lines-leave"):
        found.C(y)
