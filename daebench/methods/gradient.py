"""The gradient of a functional of a run, for an optimiser or a fit."""

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daebench.diagnostics.derivative import ALLOWED, NEAR, ROUGH, STEP, derivative
from daebench.errors import BadInput, DaebenchError
from daebench.methods.run import run
from daebench.runs.trajectory import Array, PoissonTrajectory, Trajectory

States = Sequence[NDArray[Any]]
"""q and p, or y, at the output times, each shape(n, d)."""

Functional = Callable[[States], Any]
"""A functional of states, real or complex."""


@dataclass(frozen=True, kw_only=True)
class Gradient:
    """The value of a functional and its derivatives.

    Parameters
    ----------
    value : float
        The value.
    derivatives : mapping of str to (float or ndarray, shape(d,))
        The derivative with respect to each parameter, and to each entry of an initial value.
    trajectory : Trajectory or PoissonTrajectory
        The run, with its sensitivities.
    """

    value: float
    derivatives: Mapping[str, float | Array]
    trajectory: Trajectory | PoissonTrajectory


def gradient(functional: Callable[..., Any], problem: Any, *, sensitivities: Sequence[str], **settings: Any) -> Gradient:
    """Return a functional J of a run with its derivatives with respect to parameters and initial values.

    ::

        J = J(t, q, p),      dJ/da = sum_n J_q(t_n) dq_n/da + J_p(t_n) dp_n/da

        >>> import daebench
        >>> fall = daebench.gradient(
        ...     lambda t, q, p: q[-1, 1], "planar_pendulum", sensitivities=["gravity"], method="rattle", h=0.01, t_end=1, every=0
        ... )
        >>> round(fall.value, 4), round(fall.derivatives["gravity"], 4)
        (-0.4758, -0.429)

    The derivatives of the states are those of the run, see :func:`daebench.run`; the rest is the chain rule. J is differentiated by complex
    step, so it should consist of smooth functions that accept complex numbers, such as NumPy's arithmetic, but not ``abs``. If a difference
    quotient does not agree, differences are used, and a warning gives their accuracy.

    Parameters
    ----------
    functional : callable
        ``functional(t, q, p)``, or ``functional(t, y)`` on a Poisson system, returns a number, of the output times, shape(n,), and the
        states there, shape(n, d): ``q[-1, 0]`` is the end, ``numpy.trapezoid(q[:, 0] ** 2, t)`` an integral, a sum of squares a misfit.
        The states that it depends on must be outputs: ``every`` determines them, and 0 is enough for the end.
    problem : str, ConstrainedHamiltonian, PoissonSystem or InitialValueProblem
        As for :func:`daebench.run`.
    sensitivities : sequence of str
        Parameters and initial values to differentiate by, see :attr:`daebench.runs.trajectory.Outcome.sensitivities`. If J depends on
        parameters other than through the states, that part of the derivative has to be added.
    **settings
        All other parameters of :func:`daebench.run`.

    Returns
    -------
    Gradient
        Value, derivatives, and the run.

    Raises
    ------
    BadInput
        If the request cannot be met, or the functional does not return a finite number.
    RunFailed
        If the run stops before its end.
    """
    if not sensitivities:
        raise BadInput(
            "a gradient needs quantities to differentiate by; give sensitivities, for example ['gravity', 'q0'].",
            "gradient-without-quantities",
        )
    trajectory = run(problem, sensitivities=sensitivities, **settings).complete()
    parts = [name for name in trajectory.states if name != "lam"]
    directions = {name: _directions([by[part] for part in parts]) for name, by in trajectory.sensitivities.items()}
    value, slopes = _value_and_slopes(
        lambda states: _number(functional(trajectory.t, *states)),
        [trajectory.states[part] for part in parts],
        [direction for several in directions.values() for direction in several],
    )
    ends = np.cumsum([len(several) for several in directions.values()])[:-1]
    derivatives: dict[str, float | Array] = dict(zip(directions, np.split(slopes, ends), strict=True))
    derivatives |= {name: float(slopes[0]) for name, slopes in derivatives.items() if name in trajectory.parameters}  # type: ignore[index]
    return Gradient(value=value, derivatives=derivatives, trajectory=trajectory)


def _directions(by: Sequence[Array]) -> list[States]:
    """Return derivatives by one number each, given those of q and p by one or several."""
    if by[0].ndim == 2:
        return [by]
    return [[rows[:, :, j] for rows in by] for j in range(by[0].shape[2])]


def _number(value: Any) -> Any:
    """Return the value of a functional, which has to be a number."""
    if np.shape(value):
        raise BadInput(f"the functional returns an array of shape {np.shape(value)}; it must return a number.", "functional-not-a-number")
    return value


def _value_and_slopes(phi: Functional, states: States, directions: Sequence[States]) -> tuple[float, Array]:
    """Return the value of a functional of states and its derivatives, by complex step.

    Where a difference quotient contradicts they are as :func:`daebench.diagnostics.derivative.derivative` has them.
    """
    value = float(np.real(phi(states)))
    if not np.isfinite(value):
        raise BadInput(f"the functional is {value} on this run; it must return a finite number.", "functional-not-finite")
    slopes = _by_complex_step(phi, states, directions)
    if slopes is None or not _confirmed(phi, states, directions, slopes, value):
        flat, ends = np.concatenate([rows.ravel() for rows in states]), np.cumsum([rows.size for rows in states])[:-1]
        shape, X = states[0].shape, np.array([np.concatenate([rows.ravel() for rows in direction]) for direction in directions]).T
        slopes = derivative(lambda x: phi([part.reshape(shape) for part in np.split(x, ends)]), flat, X, len(states)).value.ravel()
    if not np.all(np.isfinite(slopes)):
        raise BadInput(
            "the derivative of the functional is not finite on this run; check where its functions are smooth.",
            "functional-slope-not-finite",
        )
    return value, slopes


def _by_complex_step(phi: Functional, states: States, directions: Sequence[States]) -> Array | None:
    """Return the derivatives of a functional by complex step; None where it does not take complex numbers."""
    slopes, moved = [], [x.astype(complex) for x in states]
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", np.exceptions.ComplexWarning)  # what is dropped is seen by its effect
            for direction in directions:
                for z, x, dx in zip(moved, states, direction, strict=True):
                    z.real = x  # whatever a functional may have written there
                    np.multiply(dx, STEP, out=z.imag)
                slopes.append(np.imag(phi(moved)) / STEP)
    except DaebenchError:
        raise
    except Exception:  # noqa: BLE001 - whatever code of the user's own makes of complex numbers
        return None
    return np.array(slopes, dtype=float)


def _confirmed(phi: Functional, states: States, directions: Sequence[States], slopes: Array, value: float) -> bool:
    """Return whether a difference quotient along one combination of the directions agrees with slopes, as far as it can tell."""
    sizes = [max(float(np.max(np.abs(dx), initial=0.0)) for dx in direction) for direction in directions]
    # Weights without a pattern: with equal ones, wrong derivatives of opposite signs would cancel in the sum and pass.
    weights = [np.cos(1.0 + k) / (size or 1.0) for k, size in enumerate(sizes)]
    along = [sum((w * direction[i] for w, direction in zip(weights, directions, strict=True)), 0.0 * x) for i, x in enumerate(states)]
    step = NEAR * max(float(np.max(np.abs(x), initial=0.0)) for x in states) or NEAR
    forth, back = (float(np.real(phi([x + sign * step * dx for x, dx in zip(states, along, strict=True)]))) for sign in (1.0, -1.0))
    quotient, terms = (forth - back) / (2.0 * step), slopes * np.array(weights)
    rounding = ALLOWED * float(np.finfo(float).eps) * abs(value) / step
    return abs(quotient - float(terms.sum())) <= ROUGH * float(np.abs(terms).sum()) + rounding
