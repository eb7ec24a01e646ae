"""Derivatives of runs by other ways than dual numbers: by complex step through the kernel of complex numbers."""

from dataclasses import replace

import numpy as np

from daebench.methods.fixed_step.base import _complex_state
from daebench.methods.fixed_step.complex_step import complex_run
from daebench.methods.plan import plan
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


def complex_runs(problem, names, *, h, steps, every, **settings):
    """Yield the states of a run, shape(n, size), with their derivative in one direction after the other as the imaginary part."""
    planned = plan(problem, h=h, steps=steps, **settings)
    method, ivp = planned.method, planned.ivp
    chosen = directions(ivp, names)
    ends = np.cumsum([len(vector) for vector in ivp.start])[:-1]
    linked = method.linked(ivp, method.kernel(ivp, "complex128", (), count=False, singular=""), h)
    for par, start, unit in zip(chosen.par.T, chosen.start.T, chosen.units, strict=True):
        moved = moved_by(ivp, par)
        linked = replace(linked, par=(*moved.par, *linked.par[len(ivp.par) :]), enter=method._coordinates(moved)[0])
        begin = np.concatenate(ivp.start) + 1j * STEP * start
        _, rows, failure = complex_run(linked, ivp, _complex_state(linked, np.split(begin, ends)), h, steps, every=every)
        assert failure is None
        rows = np.concatenate([begin[None], rows])
        yield rows.real + 1j * rows.imag / unit


def by_complex_step(problem, names, *, steps, **settings):
    """Return the derivatives of the state at the end of a run, shape(size, k)."""
    return np.array([rows[-1].imag / STEP for rows in complex_runs(problem, names, steps=steps, every=steps, **settings)]).T
