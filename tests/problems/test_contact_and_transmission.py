"""Oscillators whose coupling a third coordinate sets: against their equations written by hand, and what leads back along a motion."""

import numpy as np
import pytest
from integrating import by_dop853
from measures import error_of

import daebench
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import parse
from daebench.runs.request import Request

pytestmark = pytest.mark.usefixtures("plain_functions")

CONTACT, TRANSMISSION = "contact_oscillator", "variable_transmission"
CASES = [
    (CONTACT, "integrable"),
    (CONTACT, "perturbed"),
    (CONTACT, "shifted"),
    (TRANSMISSION, "even"),
    (TRANSMISSION, "coupled"),
    (TRANSMISSION, "uneven"),
    (TRANSMISSION, "uneven_coupled"),
    (TRANSMISSION, "swinging"),
]
TURNED = np.array([1, 1, 1, -1, -1, -1])
MIRRORED = np.array([-1, -1, 1, 1, 1, -1])
T = 4.0


def by_hand(ratio, slope, pull, together):
    """Return the rates of (x, y, z, v): x' + ratio(y) z' = 0, pull(y) is the force on y, x and z are coupled by x^2 z^2 / 2."""

    def rates(_, state):
        (x, y, z), (vx, vy, vz) = state.reshape(2, 3)
        fx, fz, r = -x - together * x * z**2, -z - together * x**2 * z, ratio(y)
        reaction = (fx + r * fz + slope(y) * vy * vz) / (1 + r**2)
        return [vx, vy, vz, fx - reaction, pull(y), fz - r * reaction]

    return rates


def unity(y):
    return 1.0


def oracle(problem, parameters):
    if problem == CONTACT:
        return by_hand(lambda y: y, unity, lambda y: -y, parameters["perturbation"])
    return by_hand(np.sin, np.cos, lambda y: -np.sin(y) - parameters["asymmetry"] * np.cos(2 * y), parameters["coupling"])


def ivp_of(problem, case):
    return initial_value_problem(problem, *(("integrable", {"momenta": 2}) if case == "shifted" else (case,)))


def moved(ivp, t_end, state=None):
    """Return the state (q, p) at the end of a run from a start, with a very small tolerance."""
    start = {} if state is None else {"q0": state[:3], "p0": state[3:]}
    run = parse("scipy:DOP853").solve(initial_value_problem(ivp, **start), Request(value=1e-13, t_end=t_end, points=2, watch=())).complete()
    return np.concatenate([run.q[-1], run.p[-1]])


@pytest.mark.sampled(by=lambda case: case.endswith(("perturbed", "uneven_coupled", "swinging")))
@pytest.mark.parametrize(("problem", "case"), CASES, ids=lambda name: name)
def test_the_motion_is_that_of_the_equations_written_by_hand(problem, case):
    ivp = ivp_of(problem, case)
    velocities = np.asarray(ivp.value("H_p", ivp.p0, ivp.q0), dtype=float)
    start = np.concatenate([ivp.q0, velocities])
    expected = by_dop853(oracle(problem, ivp.parameters), start, T)
    end = moved(ivp, T)
    assert end[:3] == pytest.approx(expected[:3], abs=1e-10)
    assert np.asarray(ivp.value("H_p", end[3:], end[:3]), dtype=float) == pytest.approx(expected[3:], abs=1e-10)


def test_starts_are_those_of_the_sources():
    x0, y0, z0 = initial_value_problem(CONTACT, "perturbed").q0
    assert z0 == pytest.approx(np.linspace(-0.9, 0.9, 10)[5] * np.sqrt(2), rel=1e-14)
    assert (x0**2 + y0**2 + z0**2 + 0.3 * (x0 * z0) ** 2) / 2 == pytest.approx(1.5, rel=1e-14)


def test_other_momenta_leave_positions_alone_and_differ_by_the_gradient():
    plain, shifted = (moved(ivp_of(CONTACT, case), T) for case in ("integrable", "shifted"))
    gradient = [0, 0, np.sin(plain[2])]
    assert shifted == pytest.approx(plain + np.concatenate([np.zeros(3), gradient]), abs=1e-10)
    assert abs(gradient[2]) > 0.1


@pytest.mark.sampled(by=lambda case: any(name in case for name in ("perturbed", "shifted", "coupled")))
@pytest.mark.parametrize(
    ("problem", "case", "signs", "leads_back"),
    [
        (CONTACT, "integrable", TURNED, True),
        (CONTACT, "perturbed", TURNED, True),
        (CONTACT, "shifted", TURNED, False),
        (TRANSMISSION, "uneven", TURNED, True),
        (TRANSMISSION, "even", MIRRORED, True),
        (TRANSMISSION, "coupled", MIRRORED, True),
        (TRANSMISSION, "uneven", MIRRORED, False),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_a_map_leads_back_along_the_motion_where_the_problem_is_reversible_by_it(problem, case, signs, leads_back):
    ivp = ivp_of(problem, case)
    start = np.concatenate([ivp.q0, ivp.p0])
    turned = signs * moved(ivp, T)
    if leads_back:
        assert signs * moved(ivp, T, turned) == pytest.approx(start, abs=1e-10)
    else:
        # The turned state may be off the constraint or lead elsewhere; in either case it is not the way back.
        projected = initial_value_problem(ivp, q0=turned[:3], p0=turned[3:], project=True)
        assert error_of(signs * moved(projected, T), start) > 0.1


@pytest.mark.sampled(left_out=("even", "swinging"))
@pytest.mark.parametrize("case", ["even", "uneven", "swinging"])
def test_gni_keeps_a_quadratic_energy_of_equal_linear_springs(case):
    """|v|^2 + x_k . x_{k+1} of both oscillators, v = (x_{k+1} - x_k)/h: leapfrog keeps it, and so does a reflection of velocities."""
    h = 0.2
    run = daebench.run("variable_transmission", case=case, method="gni", h=h, t_end=200)
    x = run.q[:, [0, 2]]
    kept = (np.diff(x, axis=0) ** 2).sum(axis=1) / h**2 + (x[:-1] * x[1:]).sum(axis=1)
    assert error_of(kept, kept[0]) < 1e-11
    # With the pendulum's coordinate, whose potential is not quadratic, there is no such thing.
    y = run.q
    other = (np.diff(y, axis=0) ** 2).sum(axis=1) / h**2 + (y[:-1] * y[1:]).sum(axis=1)
    assert error_of(other, other[0]) > 1e-3
