"""The largest step of a scheme at rest: up to where no small oscillation grows and the step can be made, by its derivative.

The derivative is by central differences: at rest Newton's iteration has converged before it begins, and would not carry a complex step.
"""

from collections.abc import Sequence

import numpy as np

from daebench.diagnostics.symplecticity import tangent_basis
from daebench.errors import DaebenchError
from daebench.methods.names import method_of
from daebench.runs.ivp import Array, ConstrainedIvp

METHODS = ("symplectic_euler", "rattle", "lobatto3", "rk4", "local:gauss2", "implicit_euler")
"""Schemes that are looked at where none are given."""

GROWS = 1e-6
"""A step that lets something grow by more than this part is not usable: equal frequencies come out as the root of round-off."""

SHIFT = 1e-5
"""Shift of the differences, in parts of 1 + max |q|: they are off by its square, and by round-off over it."""

MOST = 32.0
"""The largest step that is looked at, times the fastest frequency; who has no limit up to there is said to have none."""

TRIED = 64
"""Steps between which a limit is looked for, from the smallest up."""

HALVINGS = 20
"""Of the interval in which it is."""


def growth(ivp: ConstrainedIvp, name: str, q: Array, h: float) -> float:
    """Return the spectral radius of the derivative of one step at rest, infinite where the step cannot be made."""
    rest, step = np.concatenate([np.zeros(ivp.d), q]), SHIFT * (1.0 + float(np.max(np.abs(q))))
    basis = tangent_basis(ivp, rest[: ivp.d], q)
    flow = method_of(ivp, name).flow(ivp, h, 1)

    def end(x: Array) -> Array:
        return np.real(np.concatenate([np.asarray(part) for part in flow(tuple(x[: ivp.d]), tuple(x[ivp.d :]))]))

    try:
        carried = np.array([(end(rest + step * x) - end(rest - step * x)) / (2 * step) for x in basis.T]).T
    except DaebenchError:
        return float("inf")
    matrix = basis.T @ carried
    return float(np.max(np.abs(np.linalg.eigvals(matrix)))) if np.all(np.isfinite(matrix)) else float("inf")


def usable_steps(ivp: ConstrainedIvp, q: Array, fastest: float, names: Sequence[str] = METHODS) -> dict[str, float]:
    """Return the largest step size with which nothing grows at rest, s, by method; infinite where there is none up to :data:`MOST`.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem.
    q : ndarray, shape(d,)
        The position of rest.
    fastest : float
        The largest natural frequency, 1/s.
    names : sequence of str
        Names of fixed-step methods.
    """
    return {name: _limit(ivp, name, q, fastest) for name in names}


def _limit(ivp: ConstrainedIvp, name: str, q: Array, fastest: float) -> float:
    def fails(x: float) -> bool:
        return not growth(ivp, name, q, x / fastest) <= 1 + GROWS

    low = 0.0
    for high in np.geomspace(0.05, MOST, TRIED):
        if fails(float(high)):
            break
        low = float(high)
    else:
        return float("inf")
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        low, high = (low, middle) if fails(middle) else (middle, high)
    return low / fastest
