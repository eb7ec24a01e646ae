"""The planar pendulum in closed form, by Jacobi's elliptic functions in 40 digits, and its derivatives."""

import mpmath as mp
import numpy as np


def swing(angle, length, gravity, t):
    """Return the positions of a planar pendulum released at rest, at an angle from the vertical."""
    k = mp.sin(angle / 2)
    turned = 2 * mp.asin(k * mp.ellipfun("cd", mp.sqrt(gravity / length) * t, k=k))
    return length * mp.sin(turned), -length * mp.cos(turned)


def slopes(f, x):
    """Return the derivatives of two numbers f(x)."""
    with mp.workdps(40):
        return np.array([float(mp.diff(lambda s, i=i: f(s)[i], mp.mpf(x))) for i in range(2)])


def released(angle):
    """Return the start at rest at an angle from the vertical."""
    return {"q0": [np.sin(angle), -np.cos(angle)], "p0": [0.0, 0.0]}


def errors_of_swing(run, angle):
    """Return the largest errors of dq/dgravity and of dq/dangle, by dq/dq0, over the outputs of a run from :func:`released`."""
    tangent, errors = np.array([np.cos(angle), np.sin(angle)]), []
    for n, t in enumerate(map(mp.mpf, map(float, run.t[1:])), start=1):
        by_gravity = slopes(lambda gravity, t=t: swing(mp.mpf(angle), 1, gravity, t), 1)
        by_angle = slopes(lambda turned, t=t: swing(turned, 1, 1, t), angle)
        found = run.sensitivities["gravity"]["q"][n], run.sensitivities["q0"]["q"][n] @ tangent
        errors.append([np.abs(found[0] - by_gravity).max(), np.abs(found[1] - by_angle).max()])
    return np.max(errors, axis=0)
