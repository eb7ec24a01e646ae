"""The references that come with daebench: one for every problem, whole, of today's definitions, and not too large."""

import mpmath as mp
import numpy as np
import pytest
from measures import error_of
from published import BARI_LAM, BARI_Q, FOUR_BAR_B0
from scipy.spatial.transform import Rotation

from daebench.diagnostics.nearby import exact_start
from daebench.methods.catalogue import find_problem, problems
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.reference.check.verify import verify
from daebench.reference.keep.definition import define
from daebench.reference.keep.dense_evaluation import states_at
from daebench.reference.keep.form import DATA
from daebench.reference.keep.record import EPS
from daebench.reference.keep.store import load, names

EXPECTED = {
    "planar_pendulum-horizontal": 100.0,
    "planar_pendulum-near_top": 100.0,
    "planar_pendulum-iftomm_a01": 100.0,
    "planar_pendulum-rotating": 100.0,
    "spherical_pendulum-fig1.1": 100.0,
    "spherical_pendulum-fig1.2": 100.0,
    "spherical_pendulum-fig1.2b": 100.0,
    "double_pendulum-horizontal": 32.0,
    "double_pendulum-swing": 50.0,
    "pendulum_chain-horizontal5": 20.0,
    "pendulum_chain-hanging": 20.0,
    "double_spherical_pendulum-swing": 32.0,
    "two_bodies_on_sphere-gni": 20.0,
    "butane-tumbling": 20.0,
    "ellipsoid_geodesic-round_short": 50.0,
    "torus-through_hole": 50.0,
    "rigid_water-tumbling": 20.0,
    "four_bar_spring-released": 20.0,
    "rigid_body_rotation-free": 32.0,
    "rigid_body_rotation-heavy_top": 2.0,
    "slider_crank-turning": 32.0,
    "four_bar-iftomm": 10.0,
    "rssr_four_bar-turning": 8.0,
    "double_wishbone-released": 2.0,
    "watt_six_bar-turning": 2.0,
    "andrews_squeezer-bari": 0.0625,
    "car_axis-bari": 5.0,
    "fekete-spiral": 20.0,
    "driven_slider_crank-turning": 20.0,
    "arevalo-exact": 5.0,
    "slider_crank_sundials-ida": 20.0,
    "bricard-iftomm": 5.0,
    "cyclohexane_ring-boat": 8.0,
    "knife_edge-turning": 12.0,
    "sleigh-turning": 20.0,
    "sleigh-backwards": 20.0,
    "rolling_disc-hante": 2.0,
    "rolling_disc-tilted": 2.0,
    "ball_on_turntable-beside": 20.0,
    "snakeboard-twisted": 20.0,
    "contact_oscillator-integrable": 100.0,
    "variable_transmission-swinging": 100.0,
    "lotka_volterra-4,2": 100.0,
    "lotka_volterra-6,2": 100.0,
    "lotka_volterra_3d-blow_up": 1.0,
    "free_rigid_body-hlw": 100.0,
    "heavy_top_lie_poisson-heavy_top": 10.0,
    "ablowitz_ladik-hlw16": 2.0,
}
"""Names, and a time that each reaches, s."""

ALIKE = {name for k, name in enumerate(EXPECTED) if name.split("-")[0] in {each.split("-")[0] for each in [*EXPECTED][:k]}}
LARGE = {"watt_six_bar-turning", "cyclohexane_ring-boat", "double_wishbone-released", "ablowitz_ladik-hlw16", "andrews_squeezer-bari"}
LARGE |= {"bricard-iftomm", "fekete-spiral", "rssr_four_bar-turning", "butane-tumbling", "rigid_body_rotation-heavy_top"}
"""Further cases of a problem, and problems whose definition takes long to derive."""


def test_every_problem_has_one_and_none_is_missing():
    exact = {name for name in problems("free") if initial_value_problem(name).facts.CLOSED_FORM}
    # Motors drive it under constraints on velocities: a second computation of such a motion needs a chart, which is for those on positions.
    uncertified = {"wheeled_robot"}
    assert {load(name).problem for name in names()} == set(problems()) - set(problems("free")) - uncertified | exact
    assert set(EXPECTED) <= set(names())


def test_they_are_below_20_megabytes():
    assert sum(path.stat().st_size for path in DATA.rglob("*") if path.is_file()) < 20e6


@pytest.mark.sampled(left_out=ALIKE | LARGE)
@pytest.mark.parametrize("name", EXPECTED, ids=str)
def test_each_begins_where_the_definition_of_today_says(name):
    found = load(name)
    assert found.certificate["definition"]["sha256"] == define(found.problem, found.case).hash
    ivp = found.ivp()
    with mp.workdps(40):
        for part, vector in zip(found.state.columns, exact_start(ivp)[0], strict=True):
            size = max(1.0, found.size(part))
            # the start in doubles has the rounding of its expressions, most of it in those of the ring
            np.testing.assert_allclose(found.values[part][0], getattr(ivp, f"{part}0"), rtol=5e-16, atol=5 * EPS * size)
            printed = [mp.mpf(found.text[f"{part}{i + 1}"][0]) for i in range(len(vector))]
            assert max(abs(x - y) for x, y in zip(printed, vector, strict=True)) < 1e-32 * size


def test_each_is_long_enough_and_its_bounds_have_all_digits_of_a_double():
    for name in EXPECTED:
        found = load(name)
        assert found.horizon >= EXPECTED[name]
        assert {*np.arange(1, np.floor(EXPECTED[name]) + 1), EXPECTED[name]} <= set(found.t)
        assert set(found.bound) in ({"q", "p", "lam"}, {"y"})
        for part, bound in found.bound.items():
            assert np.all(bound > 0), name
            assert np.all(bound <= 1e-17 * np.abs(found.values[part]).max()), name


def test_the_rigid_body_by_its_matrix_and_by_its_angular_momentum_is_one_motion_to_thirty_digits():
    matrix, momentum = load("rigid_body_rotation-free"), load("free_rigid_body-hlw")
    with mp.workdps(40):
        for k in (1, 100, len(matrix.t) - 1):
            assert matrix.t[k] == momentum.t[k]
            q, p = (np.array([mp.mpf(matrix.text[f"{part}{i + 1}"][k]) for i in range(9)]).reshape(3, 3) for part in "qp")
            hat = q.T @ p - p.T @ q
            for name, value in (("y1", hat[2, 1]), ("y2", hat[0, 2]), ("y3", hat[1, 0])):
                assert abs(value - mp.mpf(momentum.text[name][k])) < 1e-29


def test_the_four_bar_linkage_is_where_a_published_program_converges_to():
    """Its B_0 at t = 10 with steps of 2.5e-4 and 1.25e-4, extrapolated at order 2."""
    found = load("four_bar-iftomm")
    assert error_of(found.q[found.t == 10.0][0, :2], FOUR_BAR_B0) < 4e-8
    assert found.rank_losses[0] == pytest.approx(0.71, abs=0.005)


def test_the_heavy_top_has_the_published_energy_and_quaternion(plain_functions):
    """A Runge-Kutta computation gave (-.70828, .43878, .54573, .0894) at t = 0.2: five decimals, so that an entry of Q is good to 1e-5."""
    found = load("rigid_body_rotation-heavy_top")
    Q = Rotation.from_quat([-0.70828, 0.43878, 0.54573, 0.0894], scalar_first=True).as_matrix()
    assert error_of(states_at(found, [0.2]).states["q"][0].reshape(3, 3), Q) < 1e-5
    assert float(found.ivp().value("H", found.p[-1], found.q[-1])) == pytest.approx(5435.696790865546875, rel=1e-14)


@pytest.mark.slow
def test_the_squeezer_is_where_the_bari_test_set_says_but_for_a_shift_of_its_time(plain_functions):
    """The published positions are late by one shift of 1e-12 s, and the multipliers good to seven digits of the largest."""
    found = load("andrews_squeezer-bari")
    at = states_at(found, [0.03])
    v = found.ivp().along("H_p", at.states["p"], at.states["q"])[0]
    off = at.states["q"][0] - BARI_Q
    assert np.abs(off[2:]).max() < 5e-10
    assert f"{np.abs(off).max():.1e}" == "1.4e-09"
    shift = off @ v / (v @ v)
    assert shift == pytest.approx(-1e-12, rel=0.01)
    assert error_of(off, shift * v) < 1e-12
    assert f"{error_of(at.states['lam'][0], BARI_LAM):.1e}" == "1.5e-05"
    about = find_problem("andrews_squeezer").path.read_text(encoding="utf-8")
    assert all(number in about for number in ("1.4e-9", "1e-12", "1.5e-5"))


ONE_OF_A_KIND = ("planar_pendulum-iftomm_a01", "slider_crank-turning", "lotka_volterra-4,2")
"""References that have between them most of what is verified: a closed form, a start in algebraic numbers, a Poisson system."""


@pytest.mark.slow
@pytest.mark.parametrize("name", [pytest.param(x, marks=[pytest.mark.exhaustive] * (x not in ONE_OF_A_KIND)) for x in EXPECTED], ids=str)
def test_each_is_verified(name):
    assert verify(name).ok
