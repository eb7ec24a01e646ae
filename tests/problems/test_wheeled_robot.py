"""The robot on two wheels against its reduced equations, integrated by SciPy."""

import numpy as np
import pytest
from integrating import by_dop853
from measures import error_of

import daebench

M, INERTIA, WHEEL, R, TRACK, AHEAD, TORQUE, DAMPING = 10.0, 0.4, 0.01, 0.1, 0.4, 0.05, 0.5, 0.1
START = 0.1 + TRACK / 2, 1.0
"""Speed of the middle of the axle, and rate of turning: the left wheel is slower by half the track."""


def slope(t, state):
    """Return rates of place, heading and wheels, and of speed u and turning w, by Newton and Euler for the middle of the axle.

    ::

        (m + 2 J/r^2) u' = m a w^2 + (left + right)/r        (I + m a^2 + J b^2/(2 r^2)) w' = -m a u w + b/2 (right - left)/r
    """
    _, _, phi, _, _, u, w = state
    left, right = (u - TRACK / 2 * w) / R, (u + TRACK / 2 * w) / R
    pushes = TORQUE * (1 + np.sin(t)) - DAMPING * left, TORQUE * (1 + np.cos(t)) - DAMPING * right
    du = (M * AHEAD * w**2 + sum(pushes) / R) / (M + 2 * WHEEL / R**2)
    dw = (-M * AHEAD * u * w + TRACK / 2 * (pushes[1] - pushes[0]) / R) / (INERTIA + M * AHEAD**2 + WHEEL * TRACK**2 / (2 * R**2))
    return [u * np.cos(phi), u * np.sin(phi), w, left, right, du, dw]


def motion(times):
    start = [0, 0, 0, 0, 0, *START]
    x, y, phi, left, right, _, _ = by_dop853(slope, start, times).T
    across = TRACK / 2 * np.array([-np.sin(phi), np.cos(phi)])
    return np.column_stack([x + across[0], y + across[1], x - across[0], y - across[1], left, right, phi])


@pytest.mark.usefixtures("uncompiled_schemes")
def test_a_fixed_step_scheme_converges_to_them_at_its_order():
    expected = motion([0.0, 1.0])[-1]
    errors = [error_of(daebench.run("wheeled_robot", case="turning", method="dla", h=h, t_end=1).q[-1, :7], expected) for h in (0.04, 0.02)]
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.1)
