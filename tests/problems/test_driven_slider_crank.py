"""The driven slider crank against the one equation that is left where the crank's angle is known, and against the motor's power."""

import numpy as np
import pytest
from integrating import by_dop853
from measures import error_of

from daebench.methods.initial_value_problem import initial_value_problem
from daebench.reference.solution import reference_solution

OTHERS = {"crank": 0.4, "rod": 1.1, "load_mass": 0.6, "stiffness": 35.0, "damping": 3.5, "speed": 4.0, "ripple": -0.5, "gravity": 3.0}
TINY = 1e-20


def places(t, at):
    """Return x1, y1 and x2 at a time, which may be complex."""
    phi = at["speed"] * t + at["ripple"] * (1 - np.cos(at["speed"] * t))
    x, y = at["crank"] * np.cos(phi), at["crank"] * np.sin(phi)
    return np.array([x, y, x + np.sqrt(at["rod"] ** 2 - y**2)])


def speeds(t, at):
    """Return their rates, by complex step."""
    return places(t + 1j * TINY, at).imag / TINY


def load(at, times):
    """Return the place and the velocity of the load, and the energy that the damper has taken, at times."""

    def f(t, z):
        slider, rate = places(t, at)[2], speeds(t, at)[2]
        closing = z[1] - rate
        return [
            z[1],
            -(at["stiffness"] * (z[0] - slider - at["rod"]) + at["damping"] * closing) / at["load_mass"],
            at["damping"] * closing**2,
        ]

    start = [at["crank"] + 2 * at["rod"], 0, 0]
    return by_dop853(f, start, times)


def rod_energy(v):
    """Return the kinetic energy of a uniform rod of mass 1: of its centre, and of its turning about it."""
    centre, across = np.array([v[0] + v[2], v[1]]) / 2, np.array([v[2] - v[0], -v[1]])
    return centre @ centre / 2 + across @ across / 24


def momenta(v, at):
    """Return p of these velocities, by the slope of a kinetic energy that is quadratic."""
    rod = np.array([(rod_energy(v[:3] + e) - rod_energy(v[:3] - e)) / 2 for e in np.eye(3)]) * at["rod_mass"]
    return np.array([rod[0], rod[1], rod[2] + at["slider_mass"] * v[2], at["load_mass"] * v[3]])


def test_the_load_moves_as_an_oscillator_behind_a_slider_that_is_known(plain_functions):
    where, times = initial_value_problem("driven_slider_crank", "turning", OTHERS), np.array([0.4, 1.0])
    at = where.parameters
    states = reference_solution(where, times).states
    for t, q, p, (x, rate, _) in zip(times, states["q"], states["p"], load(at, times), strict=True):
        assert error_of(q, [*places(t, at), x, t]) < 1e-10
        assert error_of(p[:4], momenta(np.array([*speeds(t, at), rate]), at)) < 1e-9


def test_what_is_received_is_the_work_of_the_motor_less_the_loss_in_the_damper(plain_functions):
    """The motor's force at the tip is that of the first two multipliers, -lam: g1 and g2 are displacements of the tip."""
    where = initial_value_problem("driven_slider_crank", "turning")
    at = where.parameters
    nodes, weights = np.polynomial.legendre.leggauss(30)
    t, part = (nodes + 1) / 4, weights / 4
    states = reference_solution(where, [*t, 0.5]).states
    power = [-lam[:2] @ speeds(time, at)[:2] for time, lam in zip(t, states["lam"], strict=False)]
    lost = load(at, [0.5])[0, 2]
    assert lost > 0.1
    assert -states["p"][-1, 4] == pytest.approx(part @ power - lost, rel=1e-9)
