"""Digits in which a trajectory agrees with a certified reference, at each of its times and in each component."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from daebench.errors import BadInput
from daebench.reference.keep.record import EPS, Reference
from daebench.runs.external_state import external_state
from daebench.runs.ivp import Array


@dataclass(frozen=True, eq=False)
class Agreement:
    """Digits of agreement."""

    reference: Reference
    """The reference."""
    rows: NDArray[np.intp]
    """Rows of the reference; shape (n,)."""
    digits: Array
    """Digits of q1, q2, ..., p1, p2, ..., or y1, ...: -log10 of the error in units of the largest modulus of q, p or y in the reference.
    Infinite for zero error, and minus infinity for a number that is not finite; shape (n, size).
    """

    def lack(self, asked: float) -> str:
        """Return, as text, where there are fewer digits than requested: the first place and the worst."""
        first = int(np.flatnonzero(np.any(self.digits < asked, axis=1))[0])
        worst = int(np.argmin(np.min(self.digits, axis=1)))
        lines = [f"The trajectory does not agree with {self.reference.name} to {asked:g} digits."]
        return "\n".join([*lines, f"First: {self._place(first)}", f"Least: {self._place(worst)}"])

    def _place(self, row: int) -> str:
        column = int(np.argmin(self.digits[row]))
        name = [component for component in self.reference.text if component.rstrip("0123456789") in self.reference.state.columns][column]
        t, start = self.reference.t[self.rows[row]], -np.log10(EPS * self.reference.amplification[self.rows[row]])
        return f"{self.digits[row, column]:.1f} digits of {name} at t = {t:g}, where rounding of only the start leaves {start:.1f}."


def agreement(reference: Reference, t: ArrayLike, **states: ArrayLike) -> Agreement:
    """Return the digits in which a trajectory agrees with a reference.

    Shapes: t (n,); states (n, components).
    """
    state, rows = reference.state, _rows(reference, _times(t))
    if set(states) != set(state.columns):
        raise BadInput(f"{reference.name} has states {state.as_tuple}; give only {state.listed}.")
    sizes = [reference.values[part].shape[1] for part in state.vectors]
    duty = f"{state.listed} {'are' if len(sizes) > 1 else 'is'} needed at all times t"
    given = states[state.vectors[0]] if len(sizes) == 1 else [states[part] for part in state.vectors]
    trajectory = dict(zip(state.vectors, external_state(given, [(len(rows), size) for size in sizes], duty), strict=True))
    digits = [_digits(trajectory[part], reference.values[part][rows], reference.size(part)) for part in state.columns]
    return Agreement(reference, rows, np.hstack(digits))


def _times(t: ArrayLike) -> Array:
    try:
        times = np.atleast_1d(np.asarray(t, dtype=float))
    except (TypeError, ValueError):
        times = np.empty(0)
    if not times.size or times.ndim > 1:
        raise BadInput(f"t = {t!r} must be one time or a sequence of times.")
    return times


def _rows(reference: Reference, t: Array) -> NDArray[np.intp]:
    missing = t[~np.isin(t, reference.t)]
    if missing.size:
        stored = f"{reference.t[0]:g}, {reference.t[1]:g}, ..., {reference.horizon:g}"
        raise BadInput(f"t = {missing[0]:g} is not stored in {reference.name}, which has t = {stored}.")
    return np.searchsorted(reference.t, t)


def _digits(solution: Array, reference_solution: Array, size: float) -> Array:
    with np.errstate(divide="ignore", invalid="ignore"):
        digits = -np.log10(np.abs(solution - reference_solution) / size)
    return np.where(np.isnan(digits), -np.inf, digits)
