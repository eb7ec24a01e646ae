"""A user's code against a certified reference: digits of agreement, and orders fitted to errors of runs with decreasing steps."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from daebench.diagnostics.order import OrderFit, fit_order
from daebench.errors import BadInput, positive, whole
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
        raise BadInput(f"{reference.name} has states {state.as_tuple}; give only {state.listed}.", "reference-state-of-other-kind")
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
        raise BadInput(f"t = {t!r} must be one time or a sequence of times.", "reference-times-malformed")
    return times


def _rows(reference: Reference, t: Array) -> NDArray[np.intp]:
    missing = t[~np.isin(t, reference.t)]
    if missing.size:
        stored = f"{reference.t[0]:g}, {reference.t[1]:g}, ..., {reference.horizon:g}"
        raise BadInput(f"t = {missing[0]:g} is not stored in {reference.name}, which has t = {stored}.", "reference-time-not-stored")
    return np.searchsorted(reference.t, t)


def _digits(solution: Array, reference_solution: Array, size: float) -> Array:
    with np.errstate(divide="ignore", invalid="ignore"):
        digits = -np.log10(np.abs(solution - reference_solution) / size)
    return np.where(np.isnan(digits), -np.inf, digits)


Solve = Callable[..., Any]
"""``solve(p, q, h, t)`` returns p and q at the times t, shape(n, d) each; for a Poisson system ``solve(y, h, t)`` returns y."""

ON_GRID = 1e-9
"""Tolerance, as a fraction of a step, within which a time counts as a whole number of steps."""

MOST_STEPS = 2**28
"""Largest number of steps of a run; a larger number is taken for a typing error."""

ROUNDINGS = 10.0
"""Effect of rounding, at the start and later, on a state before amplification, in units of one rounding."""

FAR = 1000.0
"""Factor above rounding: if errors stop falling at a larger multiple, rounding is not the reason."""


@dataclass(frozen=True, eq=False)
class Convergence:
    """The errors of one code over a sequence of step sizes."""

    reference: Reference
    """The reference that errors are measured against."""
    t: Array
    """Stored times at which errors are measured, s; shape (n,)."""
    h: Array
    """Step sizes, s, largest first; shape (k,)."""
    errors: dict[str, Array]
    """For "q" and "p", or "y": the largest Euclidean norm of the error over the times; shape (k,)."""
    floor: dict[str, float]
    """For each part, the sum of the reference's bound and of amplified rounding."""

    @cached_property
    def fits(self) -> dict[str, OrderFit]:
        """Order of each part."""
        return {part: fit_order(self.h, error, floor=self.floor[part]) for part, error in self.errors.items()}

    def table(self) -> str:
        """Return step sizes, errors, their local slopes, and reasons for omitted points, as text."""
        lines = [f"{'h':>12}" + "".join(f"{f'error of {part}':>14} {'slope':>6}  {'':<14}" for part in self.errors)]
        for k, h in enumerate(self.h):
            lines.append(f"{h:12.6g}" + "".join(self._cells(part, k) for part in self.errors))
        scale = ", ".join(f"{name} = {value:g}" for name, value in self.reference.parameters.items())
        lines.append(f"Errors are the largest at {len(self.t)} times up to t = {self.t[-1]:g} of {self.reference.name} ({scale}).")
        lines.append(f"Rounding is expected below {' and '.join(f'{floor:.1e} in {part}' for part, floor in self.floor.items())}.")
        return "\n".join(line.rstrip() for line in lines)

    def _cells(self, part: str, k: int) -> str:
        error = self.errors[part]
        return f"{error[k]:14.3e} {_slope(self.h, error, k):>6}  {self._reason(part, k):<14}"

    def faults(self, claimed: float, asked: float) -> list[str]:
        """Return a sentence for each part whose order is below the claim by more than two standard errors."""
        faults: dict[str, list[str]] = {}
        for part, fit in self.fits.items():
            if fit.note:
                faults.setdefault(self._advice(part), []).append(part)
        lines = [f"The order in {' and '.join(parts)} cannot be determined: {advice}" for advice, parts in faults.items()]
        return lines + [
            f"The order in {part} is {fit.slope:.2f} (standard error {fit.slope_error:.2g}), but {claimed:g} was claimed."
            for part, fit in self.fits.items()
            if fit.slope + 2 * fit.slope_error < asked
        ]

    def _advice(self, part: str) -> str:
        """Return why there is no asymptotic range, and what to change."""
        reasons = self.fits[part].reasons
        lost = {reason: reasons.count(reason) for reason in ("failed", "round-off", "pre-asymptotic")}
        finest = self.errors[part][np.isfinite(self.errors[part])][-1:]
        if lost["failed"] > len(reasons) / 2:
            return "most results are not finite; give a smaller h."
        if lost["round-off"] < lost["pre-asymptotic"]:
            return "the slopes have not converged; give a smaller h, or a shorter t_end."
        if self._is_high(part, finest):
            return (
                "the errors stop decreasing far above rounding; look for an equation that is not solved, parameters other than the "
                "reference's, the numbers of a state in the wrong order, or a tolerance that is too large."
            )
        return "the errors are at rounding; give a larger h, or a longer t_end."

    def _reason(self, part: str, k: int) -> str:
        reason = self.fits[part].reasons[k]
        return "plateau" if reason == "round-off" and self._is_high(part, self.errors[part][k]) else reason

    def _is_high(self, part: str, error: Any) -> bool:
        return bool(np.all(error > FAR * self.floor[part]))


def _slope(h: Array, error: Array, k: int) -> str:
    if k == 0 or not np.all(np.isfinite(error[k - 1 : k + 1]) & (error[k - 1 : k + 1] > 0)):
        return ""
    return f"{np.log(error[k - 1] / error[k]) / np.log(h[k - 1] / h[k]):.2f}"


def convergence(solve: Solve, reference: Reference, *, t_end: float, h: float, halvings: int) -> Convergence:
    """Return the errors of a solver for h, h/2, h/4, ... from the reference's initial values."""
    __tracebackhide__ = True
    rows = _common(reference, positive("t_end", t_end), positive("h", h), whole("halvings", halvings))
    t, sizes = reference.t[rows], [h / 2**k for k in range(halvings + 1)]
    solutions = list(map(partial(_solved, solve, reference, t), sizes))
    parts = reference.state.columns
    errors = {part: np.array([_largest(solution[part] - reference.values[part][rows]) for solution in solutions]) for part in parts}
    return Convergence(reference, t, np.array(sizes), errors, {part: _floor(reference, part, rows) for part in parts})


def _common(reference: Reference, t_end: float, h: float, halvings: int) -> NDArray[np.intp]:
    """Return the rows of the stored times up to t_end that are multiples of the largest step."""
    name, steps = reference.name, reference.t / h
    if halvings < 2:
        raise BadInput(f"halvings = {halvings} must be at least 2: an order needs three step sizes.", "halvings-below-two")
    if halvings > np.log2(MOST_STEPS) or t_end / h * 2.0**halvings > MOST_STEPS:
        raise BadInput(
            f"h = {h:g}, halved {halvings} times, needs more than 2^28 steps up to t = {t_end:g}; give fewer halvings.",
            "halved-steps-too-many",
        )
    if t_end > reference.horizon:
        raise BadInput(
            f"t_end = {t_end:g} is beyond the horizon of {name}, t = {reference.horizon:g}; give a shorter t_end.", "end-beyond-horizon"
        )
    if t_end >= reference.double_horizon:
        raise BadInput(
            f"no run in double precision can follow {name} up to t_end = {t_end:g}; give one below t = {reference.double_horizon:g}.",
            "end-beyond-double-precision",
        )
    rows = np.flatnonzero((reference.t > 0) & (reference.t <= t_end) & (np.abs(steps - np.rint(steps)) < ON_GRID))
    if not rows.size or reference.t[rows[-1]] != t_end:
        raise BadInput(
            f"t_end = {t_end:g} must be a time stored in {name} (t = {reference.t[1]:g}, {reference.t[2]:g}, ...) and a whole number of "
            f"steps of h = {h:g}.",
            "end-not-a-stored-time",
        )
    return np.asarray(rows, dtype=np.intp)


def _solved(solve: Solve, reference: Reference, t: Array, h: float) -> dict[str, Array]:
    __tracebackhide__ = True
    state = reference.state
    try:
        solution = solve(*(reference.values[part][0].copy() for part in state.vectors), h, t.copy())
    except Exception as error:
        error.add_note(f"This was raised in the run with h = {h:g}.")
        raise
    shapes = [(len(t), reference.values[part].shape[1]) for part in state.vectors]
    return dict(zip(state.vectors, external_state(solution, shapes, f"solve must return {state.as_tuple} at the times t"), strict=True))


def _largest(error: Array) -> float:
    """Return the largest Euclidean norm of rows; an overflow counts as infinite."""
    with np.errstate(over="ignore", invalid="ignore"):
        return float(np.max(np.sqrt(np.sum(error**2, axis=1))))


def _floor(reference: Reference, part: str, rows: NDArray[np.intp]) -> float:
    rounding = ROUNDINGS * EPS * reference.size(part) * float(np.max(reference.worst_amplification[rows]))
    return _largest(reference.bound[part][rows]) + rounding
