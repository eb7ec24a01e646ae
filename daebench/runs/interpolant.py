"""States between the outputs of a run."""

from collections.abc import Mapping
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.errors import BadInput
from daebench.systems.lazily import scipy

Array = NDArray[np.float64]

DEGREE = 5
"""Degree of the splines if there are enough outputs."""


class Interpolant:
    """Splines through the states at the outputs of a run, of degree 5, or 3 or 1 if there are fewer than six or four outputs.

    For smooth motions the error of interpolation is of order dt^(degree + 1), where dt is the interval between outputs; :attr:`error`
    estimates it. States between outputs lie off the constraint manifold by as much. The error of the run itself is not included: states
    between outputs are no more accurate than those at outputs.

    The times t are of shape(n,), each of the states of shape(n, d).
    """

    def __init__(self, t: Array, states: Mapping[str, Array]) -> None:
        if len(t) < 2:
            raise BadInput(
                "the run has one state, so there is nothing to interpolate; run longer, or store more states.", "nothing-to-interpolate"
            )
        self._t, self._states = t, states

    def __call__(self, t: Any) -> dict[str, Array]:
        """Return the states by name at one time, shape(d,), or at several times, shape(k, d)."""
        times = np.asarray(t, dtype=float)
        outside = ~((times >= self._t[0]) & (times <= self._t[-1]))
        if outside.any():
            first = float(np.atleast_1d(times)[np.atleast_1d(outside)][0])
            raise BadInput(
                f"t = {first!r} is outside the run, which goes from {self._t[0]:.9g} to {self._t[-1]:.9g} s.", "time-outside-run"
            )
        return {name: spline(times) for name, spline in self._splines.items()}

    @cached_property
    def error(self) -> float:
        """Largest error that interpolation adds to a state, estimated.

        It is the error of splines through every second output at the other outputs, over 2^(degree + 1). It is NaN if there are fewer
        than three outputs.
        """
        if len(self._t) < 3:
            return float("nan")
        degree = _degree(len(self._t[::2]))
        # Without a last output that no second one follows: a spline would be extrapolated there.
        inner = slice(1, (len(self._t) - 1) // 2 * 2, 2)
        missed = [
            np.max(np.abs(_spline(self._t[::2], rows[::2])(self._t[inner]) - rows[inner]), initial=0.0) for rows in self._states.values()
        ]
        return float(max(missed)) / float(2 ** (degree + 1))

    @cached_property
    def _splines(self) -> dict[str, Any]:
        return {name: _spline(self._t, rows) for name, rows in self._states.items()}


def _degree(outputs: int) -> int:
    """Return the degree of splines through a number of outputs. It is odd, so that the knots are at the outputs."""
    return min(DEGREE, (outputs - 2) // 2 * 2 + 1)


def _spline(t: Array, rows: Array) -> Any:
    return scipy.interpolate.make_interp_spline(t, rows, k=_degree(len(t)))
