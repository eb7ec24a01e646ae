"""The closed forms of the pendulums, against integration in other coordinates, conservation and the equations of motion."""

import mpmath as mp
import numpy as np
import pytest
import sympy as sp
from integrating import by_dop853
from measures import error_of
from refusals import refused

from daebench.problems import planar_pendulum, spherical_pendulum

DEFINITIONS = {"planar": planar_pendulum.problem(), "spherical": spherical_pendulum.problem()}
ONES = {"mass": 1, "length": 1, "gravity": 1}
UNITS = {"mass": 0.7, "length": 2.5, "gravity": 9.81}
PLANAR = ["horizontal", "near_top", "rotating", "iftomm_a01"]
SPHERICAL = ["fig1.1", "fig1.2", "fig1.2b"]
CASES = [*(("planar", name) for name in PLANAR), *(("spherical", name) for name in SPHERICAL)]
CASE_IDS = ["-".join(case) for case in CASES]

# Starts on the unit sphere or circle, with velocities, that no case has: exact strings, projected below at any precision.
OTHER = {
    "planar": {
        "swinging up": (("0.6", "-0.8"), ("0.4", "0.3")),
        "swinging back": (("0.6", "-0.8"), ("-0.4", "-0.3")),
        "left, upper half": (("-0.8", "0.6"), ("0.06", "0.08")),
        "rotating backwards": (("0.6", "0.8"), ("-2.4", "1.8")),
        "rotating forwards from the left": (("-0.6", "0.8"), ("2.4", "1.8")),
        "from the top": (("0", "1"), ("-0.3", "0")),
        "small": (("0.00001", "-1"), ("0", "0")),
    },
    "spherical": {
        "rising": (("0.6", "0", "-0.8"), ("0.4", "0.5", "0.3")),
        "falling": (("0.6", "0", "-0.8"), ("-0.4", "0.5", "-0.3")),
        "clockwise": (("0", "-0.6", "0.8"), ("-0.7", "0.8", "0.6")),
        "hardly turning": (("0.6", "0", "-0.8"), ("0.4", "0.0001", "0.3")),
        "nearly over the top": (("0.6", "0", "0.8"), ("-1.6", "0.001", "1.2")),
    },
}
OTHER_STARTS = [(kind, name) for kind, starts in OTHER.items() for name in starts]
OTHER_IDS = [f"{kind}-{name}" for kind, name in OTHER_STARTS]


def given(kind, name):
    """Return q0, p0 and parameters of a case or of another start, the values at mpmath's working precision."""
    definition = DEFINITIONS[kind]
    if name in OTHER[kind]:
        return *start(kind, name, UNITS), UNITS
    case = definition.cases[name]
    parameters = {str(symbol): value for symbol, value in definition.parameters.items()} | dict(case.parameters)
    return *([mp.mpmathify(sp.N(sp.sympify(x), mp.mp.dps + 5)) for x in part] for part in (case.q, case.p)), parameters


def start(kind, name, parameters):
    """Return q0 and p0 of one of the other starts, in the units of these parameters."""
    m, length = mp.mpf(parameters["mass"]), mp.mpf(parameters["length"])
    x, v = ([mp.mpf(a) for a in part] for part in OTHER[kind][name])
    size = mp.norm(x)
    x = [a / size for a in x]
    along = mp.fdot(x, v)
    return [length * a for a in x], [m * 1.25 * (b - along * a) for a, b in zip(x, v, strict=True)]


def integrated(times, q0, p0, parameters):
    """Return q and p at these times from SciPy's DOP853 with the force of the rod written out: no angle, no elliptic function."""
    m, gravity = float(parameters["mass"]), float(parameters["gravity"])

    def field(_, y):
        q, v = np.split(y, 2)
        weight = np.zeros_like(q)
        weight[-1] = -gravity
        # the component of gravity along q is replaced by what keeps |q| constant
        return np.concatenate([v, weight - q * (weight @ q + v @ v) / (q @ q)])

    y0 = np.concatenate([np.array(q0, dtype=float), np.array(p0, dtype=float) / m])
    y = by_dop853(field, y0, times, max_step=0.01)
    return y[:, : len(q0)], m * y[:, len(q0) :]


def invariants(q, p, parameters):
    """Return g, G H_p, H and, in space, L3."""
    m, length, gravity = (mp.mpf(parameters[name]) for name in ("mass", "length", "gravity"))
    found = [mp.fdot(q, q) - length**2, 2 * mp.fdot(q, p) / m, mp.fdot(p, p) / (2 * m) + m * gravity * q[-1]]
    return [*found, q[0] * p[1] - q[1] * p[0]] if len(q) == 3 else found


def assert_invariants_kept(kind, t, q0, p0, parameters, digits):
    q, p = DEFINITIONS[kind].closed_form(t, q0, p0, parameters)
    before, after = invariants(q0, p0, parameters), invariants(q, p, parameters)
    scale = max(1, *(abs(a) for a in before))
    assert max(abs(a - b) for a, b in zip(before, after, strict=True)) < scale * mp.mpf(10) ** -digits


@pytest.mark.sampled(by=lambda case: case.endswith(("near_top", "fig1.2", "back", "backwards", "clockwise", "over the top")))
@pytest.mark.parametrize(("kind", "name"), [*CASES, *OTHER_STARTS], ids=[*CASE_IDS, *OTHER_IDS])
def test_the_closed_form_agrees_with_an_integration_in_cartesian_coordinates(kind, name):
    start, times = given(kind, name), np.array([0, 0.7, 3.1, 5])
    # near the upper equilibrium an error grows as e^t
    tolerance = {"near_top": 1e-9}.get(name, 5e-11 if (kind, name) in CASES else 2e-10)
    with mp.workdps(20):
        found = np.array([np.concatenate(DEFINITIONS[kind].closed_form(t, *start)) for t in times], dtype=float)
    assert error_of(found, np.hstack(integrated(times, *start))) < tolerance


@pytest.mark.parametrize(("kind", "case"), [*CASES, *OTHER_STARTS], ids=[*CASE_IDS, *OTHER_IDS])
def test_the_closed_form_keeps_every_invariant_to_working_precision(kind, case):
    with mp.workdps(50):
        for t in ("3.7", "100", "-41.5"):
            assert_invariants_kept(kind, mp.mpf(t), *given(kind, case), digits=46 if case in OTHER[kind] else 47)


@pytest.mark.parametrize(("kind", "name"), OTHER_STARTS, ids=OTHER_IDS)
def test_the_closed_form_solves_the_equations_of_motion(kind, name):
    """The rate of q is p/m, and p' + m gravity e is along q, by differences at 30 digits."""
    with mp.workdps(30):
        start, m, step = given(kind, name), mp.mpf(UNITS["mass"]), mp.mpf("1e-8")
        for t in (0, 17):
            behind, now, ahead = (np.concatenate(DEFINITIONS[kind].closed_form(t + k * step, *start)) for k in (-1, 0, 1))
            (q, p), (q_rate, force) = np.split(now, 2), np.split((ahead - behind) / (2 * step), 2)
            force[-1] += m * UNITS["gravity"]
            scale = 1 + np.abs([*q_rate, *force]).max() ** 3
            assert error_of(q_rate, p / m) < 1e-13 * scale
            assert error_of(force, q * (force @ q) / (q @ q)) < 1e-13 * scale


@pytest.mark.parametrize(("kind", "case"), CASES, ids=CASE_IDS)
def test_a_second_working_precision_gives_the_same_state_at_time_100(kind, case):
    found = []
    for digits in (40, 60):
        with mp.workdps(digits):
            found.append(np.concatenate(DEFINITIONS[kind].closed_form(100, *given(kind, case))))
    assert np.abs(np.subtract(*found)).max() < 1e-35


@pytest.mark.parametrize(
    ("q0", "p0"), [((1, 0, 0), (0, 0, 0)), ((0, 0, -1), ("1.5", "0.5", 0)), ((0, 0, -1), (3, -2, 0))], ids=["rest", "pole", "over"]
)
def test_without_angular_momentum_the_spherical_pendulum_is_a_planar_one_through_the_poles(q0, p0):
    with mp.workdps(30):
        p0, times = [mp.mpf(b) for b in p0], [0.0, 2.0, 9.0]
        found = np.array([np.concatenate(DEFINITIONS["spherical"].closed_form(t, q0, p0, ONES)) for t in times], dtype=float)
        assert error_of(found, np.hstack(integrated(np.array(times), q0, p0, ONES))) < 1e-10
        for t in (2, 9):
            assert_invariants_kept("spherical", t, q0, p0, ONES, digits=27)


def test_a_little_angular_momentum_changes_the_planar_motion_a_little():
    with mp.workdps(30):
        planar = np.concatenate(DEFINITIONS["spherical"].closed_form(7, (1, 0, 0), (0, 0, 0), ONES))
        for size, bound in (("1e-6", 1e-5), ("1e-12", 1e-11), ("1e-20", 1e-19), ("1e-28", 1e-27)):
            beside = np.concatenate(DEFINITIONS["spherical"].closed_form(7, (1, 0, 0), (0, mp.mpf(size), 0), ONES))
            assert mp.norm(beside - planar) < 3 * bound


def test_the_conical_pendulum_goes_round_evenly():
    with mp.workdps(40):
        z, rho = mp.mpf("-0.8"), mp.mpf("0.6")
        rate = 1 / mp.sqrt(-z)
        q, p = DEFINITIONS["spherical"].closed_form(50, (rho, 0, z), (0, rho * rate, 0), ONES)
        expected = [rho * mp.cos(50 * rate), rho * mp.sin(50 * rate), z, -rho * rate * mp.sin(50 * rate), rho * rate * mp.cos(50 * rate), 0]
        assert mp.norm([a - b for a, b in zip([*q, *p], expected, strict=True)]) < 1e-35


def test_the_separatrix_is_hyperbolic():
    with mp.workdps(30):
        q, p = DEFINITIONS["planar"].closed_form(4, (0, -1), (2, 0), ONES)
        theta = 4 * mp.atan(mp.tanh(mp.mpf(4) / 2))
        expected = [mp.sin(theta), -mp.cos(theta), 2 / mp.cosh(4) * mp.cos(theta), 2 / mp.cosh(4) * mp.sin(theta)]
        assert mp.norm([a - b for a, b in zip([*q, *p], expected, strict=True)]) < 1e-27


@pytest.mark.parametrize("kind", list(DEFINITIONS))
@pytest.mark.parametrize("height", [-1, 1], ids=["lower", "upper"])
def test_an_equilibrium_stays_where_it_is(kind, height):
    q0 = [0] * (1 if kind == "planar" else 2) + [height]
    q, p = DEFINITIONS[kind].closed_form(5, q0, [0] * len(q0), ONES)
    assert q == q0
    assert p == [0] * len(q0)


@pytest.mark.parametrize(("q0", "p0"), [((1.001, 0), (0, 0)), ((1, 0), (0.01, 1))], ids=["off the circle", "off the tangent"])
def test_a_start_off_the_manifold_is_refused(q0, p0):
    with refused("pendulum-start-inconsistent"):
        DEFINITIONS["planar"].closed_form(1, q0, p0, ONES)


@pytest.mark.parametrize("kind", list(DEFINITIONS))
def test_a_start_that_is_off_by_rounding_is_projected_first(kind):
    name = next(iter(OTHER[kind]))
    with mp.workdps(40):
        q0, p0 = (np.array(part) for part in start(kind, name, ONES))
        q, p = np.array([mp.mpf(float(a)) for a in q0]), np.array([mp.mpf(float(b)) for b in p0]) + mp.mpf("1e-14") * q0
        q1 = q / mp.norm(q)
        found, expected = (np.concatenate(DEFINITIONS[kind].closed_form(9, [*a], [*b], ONES)) for a, b in ((q, p), (q1, p - q1 * (q1 @ p))))
        assert mp.norm(found - expected) < 1e-35
