"""Errors that runs monitor: their names, and their values along states of any run."""

from collections.abc import Mapping, Sequence

import numpy as np

from daebench.runs.ivp import InitialValueProblem
from daebench.runs.trajectory import Array


def monitored_names(watch: Sequence[str], ivp: InitialValueProblem) -> list[str]:
    """Return the names of the errors that a run monitors, in order."""
    names: Mapping[str, Sequence[str]] = {
        "energy": ["energy"],
        "manifold": ["g", "Gv"],
        "casimirs": ivp.casimirs,
        "integrals": ivp.integrals,
        "samples": (),
    }
    return [name for quantity in watch for name in names[quantity]]


def monitored_errors(ivp: InitialValueProblem, watch: Sequence[str], *states: Array) -> Array:
    """Return the modulus of each monitored error along states.

    Shapes: states (n, ...).
    """
    columns = [np.empty((len(states[0]), 0))]
    for quantity in watch:
        if quantity == "manifold":
            columns += [_largest(ivp.along("g", states[1])), _largest(ivp.along("Gv", *states))]
        elif monitored_names([quantity], ivp):
            values = ivp.along("H" if quantity == "energy" else quantity, *states).reshape(len(states[0]), -1)
            with np.errstate(invalid="ignore"):  # infinite from the start on: the error is NaN, and is reported as such
                columns.append(np.abs(values - values[0]))
    return np.concatenate(columns, axis=1)


def _largest(values: Array) -> Array:
    """Return the largest modulus of each row, as a column."""
    largest: Array = np.max(np.abs(values), axis=1, keepdims=True, initial=0.0)
    return largest


def output_maxima(ivp: InitialValueProblem, watch: Sequence[str], *states: Array) -> dict[str, float]:
    """Return the largest modulus of each monitored error over outputs; arguments are those of :func:`monitored_errors`."""
    maxima = np.max(monitored_errors(ivp, watch, *states), axis=0)
    return dict(zip(monitored_names(watch, ivp), map(float, maxima), strict=True))
