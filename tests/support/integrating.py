"""Equations of motion that tests write out by hand, integrated by SciPy."""

import numpy as np
from scipy.integrate import solve_ivp


def by_dop853(rate, start, t, **settings):
    """Return the solution of y' = rate(t, y) at a time, or one row for each of several, to near rounding."""
    times = np.atleast_1d(t)
    found = solve_ivp(rate, (0, times[-1]), np.asarray(start, dtype=float), "DOP853", times, **{"rtol": 1e-13, "atol": 1e-14} | settings)
    assert found.success
    return found.y.T if np.ndim(t) else found.y[:, -1]
