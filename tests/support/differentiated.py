"""Derivatives of runs by other ways than dual numbers: by complex step through the kernel of complex numbers."""

from dataclasses import replace

import numpy as np

from daebench.methods.fixed_step.base import _complex_state
from daebench.methods.fixed_step.complex_step import complex_run
from daebench.methods.run import prepare
from daebench.runs.directions import STEP, directions, moved_by


def states(trajectory):
    """Return the states of a trajectory in one array, shape(n, size): momenta first."""
    parts = ("y",) if "y" in trajectory.states else ("p", "q")
    return np.concatenate([trajectory.states[part] for part in parts], axis=1)


def derivatives(trajectory):
    """Return the derivatives of :func:`states`, shape(n, size, k), in the order in which they were asked for."""
    parts = ("y",) if "y" in trajectory.states else ("p", "q")
    columns = [[by[part].reshape(*by[part].shape[:2], -1) for part in parts] for by in trajectory.sensitivities.values()]
    return np.concatenate([np.concatenate(column, axis=1) for column in columns], axis=2)


def by_complex_step(problem, names, *, h, steps, **settings):
    """Return the derivatives of the state at the end of a run, shape(size, k)."""
    method, ivp, _ = prepare(problem, h=h, steps=steps, **settings)
    chosen = directions(ivp, names)
    ends = np.cumsum([len(vector) for vector in ivp.start])[:-1]
    linked = method._linked(ivp, method.kernel(ivp, "complex128", (), count=False, singular=""), h)
    columns = []
    for par, start in zip(chosen.par.T, chosen.start.T, strict=True):
        moved = moved_by(ivp, par)
        linked = replace(linked, par=(*moved.par, *linked.par[len(ivp.par) :]), enter=method._coordinates(moved)[0])
        vectors = np.split(np.concatenate(ivp.start) + 1j * STEP * start, ends)
        _, rows, failure = complex_run(linked, ivp, _complex_state(linked, vectors), h, steps, every=steps)
        assert failure is None
        columns.append(rows[-1].imag / STEP)
    return np.array(columns).T / chosen.units
