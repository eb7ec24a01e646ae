"""The gradient of a functional of a run: what an optimiser or a fit wants to know of it."""

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.diagnostics.derivative import STEP, derivative
from daebench.errors import BadInput, DaebenchError
from daebench.methods.run import run
from daebench.runs.trajectory import Array, PoissonTrajectory, Trajectory

AGREED = 1e-4
"""A complex step that differs from a difference quotient by less than this part of it is that of a function which takes complex numbers."""

QUOTIENT = 2.0**-17
"""Step of that quotient, relative to the states."""


@dataclass(frozen=True, kw_only=True)
class Gradient:
    """The value of a functional and its derivatives.

    Parameters
    ----------
    value : float
        The value.
    derivatives : mapping of str to (float or ndarray, shape(d,))
        The derivative by each parameter, and by each entry of an initial value.
    trajectory : Trajectory or PoissonTrajectory
        The run, with its sensitivities.
    """

    value: float
    derivatives: Mapping[str, float | Array]
    trajectory: Trajectory | PoissonTrajectory


def gradient(functional: Callable[..., Any], problem: Any, *, sensitivities: Sequence[str], **settings: Any) -> Gradient:
    """Return a functional J of a run with its derivatives by parameters and initial values.

    ::

        J = J(t, q, p),      dJ/da = sum_n J_q(t_n) dq_n/da + J_p(t_n) dp_n/da

        >>> import daebench
        >>> fall = daebench.gradient(
        ...     lambda t, q, p: q[-1, 1], "planar_pendulum", sensitivities=["gravity"], method="rattle", h=0.01, t_end=1, every=0
        ... )
        >>> round(fall.value, 4), round(fall.derivatives["gravity"], 4)
        (-0.4758, -0.429)

    The derivatives are those of the numbers that the method computes: the discrete tangent of its steps, and the chain rule. J is
    differentiated by complex step, so it should be made of functions that are smooth and take complex numbers, as NumPy's arithmetic does
    and ``abs`` does not; where a difference quotient contradicts, differences are taken, and a warning says to how many digits.

    Parameters
    ----------
    functional : callable
        ``functional(t, q, p)``, or ``functional(t, y)`` on a Poisson system, returns a number, of the output times, shape(n,), and the
        states there, shape(n, d): ``q[-1, 0]`` is the end, ``numpy.trapezoid(q[:, 0] ** 2, t)`` an integral, a sum of squares a misfit.
        What of the run it depends on has to be output: ``every`` says how much, and 0 is enough for the end.
    problem : str, ConstrainedHamiltonian, PoissonSystem or InitialValueProblem
        As for :func:`daebench.run`.
    sensitivities : sequence of str
        Parameters and initial values to differentiate by, see :attr:`daebench.runs.trajectory.Outcome.sensitivities`. What J itself
        depends on besides the states is not known here, and its derivative is to be added.
    **settings
        All else that :func:`daebench.run` takes.

    Returns
    -------
    Gradient
        Value, derivatives, and the run.

    Raises
    ------
    BadInput
        If the request cannot be met, or the functional returns no finite number.
    RunFailed
        If the run stops before its end.
    """
    if not sensitivities:
        raise BadInput("a gradient needs something to differentiate by; give sensitivities, as ['gravity', 'q0'].")
    trajectory = run(problem, sensitivities=sensitivities, **settings).complete()
    parts = [name for name in trajectory.states if name != "lam"]
    shape = trajectory.states[parts[0]].shape

    def of_states(x: NDArray[Any]) -> Any:
        number = np.asarray(functional(trajectory.t, *(rows.reshape(shape) for rows in np.split(x, len(parts)))))
        if number.shape:
            raise BadInput(f"the functional returns an array of shape {number.shape}; it must return a number.")
        return number

    x = np.concatenate([trajectory.states[name].ravel() for name in parts])
    columns = {
        name: np.concatenate([by[part].reshape(x.size // len(parts), -1) for part in parts])
        for name, by in trajectory.sensitivities.items()
    }
    value, slopes = _value_and_slopes(of_states, x, np.concatenate(list(columns.values()), axis=1), len(parts))
    ends = np.cumsum([column.shape[1] for column in columns.values()])[:-1]
    derivatives: dict[str, float | Array] = {}
    for name, slope in zip(columns, np.split(slopes, ends), strict=True):
        derivatives[name] = float(slope[0]) if trajectory.sensitivities[name][parts[0]].ndim == 2 else slope
    return Gradient(value=value, derivatives=derivatives, trajectory=trajectory)


def _value_and_slopes(phi: Callable[[NDArray[Any]], Any], x: Array, X: Array, parts: int) -> tuple[float, Array]:
    """Return phi(x) and phi'(x) X, shape(k,), by complex step, or as :func:`derivative` has it where a difference quotient disagrees."""
    value = phi(x)
    if not np.isfinite(value):
        raise BadInput(f"the functional is {value} on this run; it must return a finite number.")
    slopes = _by_complex_step(phi, x, X)
    if slopes is None or not _confirmed(phi, x, X, slopes, float(np.real(value))):
        slopes = derivative(phi, x, X, parts).value.ravel()
    if not np.all(np.isfinite(slopes)):
        raise BadInput("the derivative of the functional is not finite on this run; see where its functions are smooth.")
    return float(np.real(value)), slopes


def _by_complex_step(phi: Callable[[NDArray[Any]], Any], x: Array, X: Array) -> Array | None:
    """Return phi'(x) X by complex step; None where phi does not take complex numbers."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", np.exceptions.ComplexWarning)  # what is dropped is seen by its effect
            return np.array([np.imag(phi(x + 1j * STEP * direction)) for direction in X.T], dtype=float) / STEP
    except DaebenchError:
        raise
    except Exception:  # noqa: BLE001 - whatever code of the user's own makes of complex numbers
        return None


def _confirmed(phi: Callable[[NDArray[Any]], Any], x: Array, X: Array, slopes: Array, value: float) -> bool:
    """Return whether a quotient of differences along one combination of the directions agrees with slopes."""
    weights = np.cos(1.0 + np.arange(X.shape[1])) / np.maximum(np.max(np.abs(X), axis=0), np.finfo(float).tiny)
    along = X @ weights
    step = QUOTIENT * float(np.max(np.abs(x), initial=0.0)) or QUOTIENT
    forth, back = (float(np.real(phi(x + sign * step * along))) for sign in (1.0, -1.0))
    quotient, slope = (forth - back) / (2.0 * step), float(slopes @ weights)
    rounding = 8.0 * float(np.finfo(float).eps) * abs(value) / step
    return abs(quotient - slope) <= AGREED * float(np.abs(slopes * weights).sum()) + rounding
