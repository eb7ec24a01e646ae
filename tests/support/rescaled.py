"""Initial value problems in other units of length, mass and time, which are powers of two, so that nothing is rounded by the change."""

from dataclasses import replace

import numpy as np

UNITS = {"mass": (0, 1, 0), "length": (1, 0, 0), "gravity": (1, 0, -2)}
"""Powers of length, mass and time in the parameters of pendulums."""

CHANGES = {
    "long": (30, 0, 0),
    "short": (-30, 0, 0),
    "heavy": (0, 30, 0),
    "light": (0, -30, 0),
    "slow": (0, 0, 30),
    "fast": (0, 0, -30),
    "all": (-30, 8, 3),
}
"""Powers of two by which lengths, masses and times are multiplied."""


def factors(change):
    return tuple(2.0**power for power in CHANGES[change])


def rescaled(ivp, change, units=UNITS):
    """Return the same motion in other units."""
    L, M, T = factors(change)
    parameters = {}
    for name, value in ivp.parameters.items():
        of_length, of_mass, of_time = units[name]
        parameters[name] = value * L**of_length * M**of_mass * T**of_time
    return replace(ivp, p0=ivp.p0 * (M * L / T), q0=ivp.q0 * L, parameters=parameters)


def options(form, change):
    """Return alpha, beta or eps of a form in these units; g^T g / eps^2 is an energy, and g a length squared."""
    L, M, T = factors(change)
    return {"baumgarte": {"alpha": 10 / T, "beta": 10 / T}, "stiff": {"eps": 1e-3 * L * T / np.sqrt(M)}}.get(form, {})


def difference(run, other, change):
    """Return the largest difference of two runs, the second in other units, relative to the largest position and momentum."""
    L, M, T = factors(change)
    q, p = np.abs(other.q / L - run.q).max(), np.abs(other.p / (M * L / T) - run.p).max()
    return max(q / np.abs(run.q).max(), p / np.abs(run.p).max())
