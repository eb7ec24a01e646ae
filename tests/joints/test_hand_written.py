"""Mechanisms of ``daebench.joints`` against problems of the catalogue, which are written out by hand, and against minimal coordinates."""

import numpy as np
import pytest
import sympy as sp
from mechanisms import GRAVITY, accelerations, double_rod, four_bar, heavy_top, lagrange, moving, named, skew_four_bar, slider_crank

from daebench.joints import Distance, Mechanism, PointMass
from daebench.problems import double_pendulum, double_spherical_pendulum, rigid_body_rotation
from daebench.problems import four_bar as bars
from daebench.problems import slider_crank as crank


def masses_on_strings(*places):
    """Return point masses on massless rods, one hung from the other."""
    names = [f"P{k}" for k in range(1, len(places) + 1)]
    return Mechanism(
        ground={"O": [0] * len(places[0])},
        points=dict(zip(names, places, strict=True)),
        bodies={f"mass {name}": PointMass(name, 1) for name in names},
        joints=[Distance(a, b) for a, b in zip(["O", *names], names, strict=False)],
        gravity=[*[0] * (len(places[0]) - 1), "-" + GRAVITY],
    )


def top_by_hand():
    problem = rigid_body_rotation.problem(I1=15.234375, I2=0.46875, I3=15.234375, mass=15.0, gravity=9.81)
    return problem, lambda x: x.reshape(3, 3).T.ravel()


def as_it_is(problem):
    return problem, lambda x: x


PAIRS = {
    "slider crank": (slider_crank, lambda: as_it_is(crank.problem())),
    "double pendulum": (lambda: masses_on_strings((1, 0), (2, 0)), lambda: as_it_is(double_pendulum.problem())),
    "double spherical pendulum": (
        lambda: masses_on_strings(("0.6", 0, "-0.8"), ("0.6", 1, "-0.8")),
        lambda: as_it_is(double_spherical_pendulum.problem()),
    ),
    "four bar": (four_bar, lambda: as_it_is(bars.problem(bars=2).written_out())),
    "heavy top": (heavy_top, top_by_hand),
}


@pytest.mark.parametrize(("mechanism", "by_hand"), PAIRS.values(), ids=PAIRS)
def test_a_mechanism_accelerates_as_the_same_one_written_by_hand(random, mechanism, by_hand):
    problem, (hand, ordered) = mechanism().problem(), by_hand()
    assert (problem.d, problem.m) == (hand.d, hand.m)
    for _ in range(3):
        q, v = moving(problem, random)
        expected = accelerations(hand, ordered(q), ordered(v))
        assert np.abs(ordered(accelerations(problem, q, v)) - expected).max() < 1e-10 * max(1.0, np.abs(expected).max())


def test_two_rods_accelerate_as_lagrange_says_in_their_angles(random):
    a, b = xi = sp.symbols("a b")
    tip = sp.Matrix([sp.cos(a), sp.sin(a)])
    end = tip + sp.Rational(7, 10) * sp.Matrix([sp.cos(b), sp.sin(b)])
    centres = [(2, tip / 2, a, 1), (sp.Rational(1, 2), (tip + end) / 2, b, sp.Rational(49, 100))]

    def kinetic(rate):
        rates = dict(zip(xi, rate, strict=True))
        moved = [(m, c.jacobian(xi) * rate, rates[angle], square) for m, c, angle, square in centres]
        return sum(m * w.dot(w) / 2 + m * square / 24 * spin**2 for m, w, spin, square in moved)

    motion = lagrange(xi, tip.col_join(end), kinetic, sum(m * sp.Rational(GRAVITY) * c[1] for m, c, _, _ in centres))
    problem = double_rod().problem()
    for angles, rates in random.uniform(-3, 3, (3, 2, 2)):
        q, v, expected = motion(angles, rates)
        assert np.abs(accelerations(problem, q, v) - expected).max() < 1e-10 * np.abs(expected).max()


def test_a_corner_of_a_coupler_is_where_its_triangle_says(random):
    problem = skew_four_bar().problem()
    q, _ = moving(problem, random)
    at = named(problem, q)
    where = {name: np.array(place, dtype=float) for name, place in {**skew_four_bar().points, **skew_four_bar().ground}.items()}
    for a, b in (("A", "B"), ("A", "C"), ("B", "C"), ("O", "A"), ("Q", "B")):
        assert np.linalg.norm(at[a] - at[b]) == pytest.approx(np.linalg.norm(where[a] - where[b]), rel=1e-14)
    side = [np.linalg.det(np.array([x["B"] - x["A"], x["C"] - x["A"]])) for x in (at, where)]
    assert side[0] == pytest.approx(side[1], rel=1e-13)
    assert problem.d == 4
    assert problem.m == 3
