"""Errors of conserved quantities along a trajectory: the difference from their value at its start."""

from typing import Any

import numpy as np

from daebench.runs.ivp import Array, InitialValueProblem
from daebench.runs.trajectory import Outcome


def energy_rounding(ivp: InitialValueProblem, eps: float) -> float:
    """Return the change of H if each coordinate at the start is changed by eps times the largest of its kind.

    ::

        eps ( sum_i |H_p|_i max |p| + sum_i |H_q|_i max |q| )        or, of a Poisson system,        eps sum_i |H_y|_i max |y|

    The rounding of a state explains an error of this size, also if H itself is zero because kinetic and potential energy cancel.

    Parameters
    ----------
    ivp : InitialValueProblem
        The problem with its numbers.
    eps : float
        Machine epsilon.
    """
    gradient = zip(ivp.state.gradient, ivp.start, strict=True)
    changes = [np.sum(np.abs(ivp.value(name, *ivp.start))) * np.max(np.abs(x)) for name, x in gradient]
    return eps * float(np.sum(changes))


def integral_errors(ivp: InitialValueProblem, trajectory: Outcome) -> dict[str, Array]:
    """Return the error of each first integral that the problem declares besides H, by name, each shape(n,) over the outputs.

    Parameters
    ----------
    ivp : InitialValueProblem
        The problem with its numbers.
    trajectory : Outcome
        A run on it.

    Returns
    -------
    dict of str to ndarray, shape(n,)
        I(x(t)) - I(x0), in the unit of the integral; empty if the problem declares no integrals.
    """
    return _errors(ivp, "integrals", ivp.integrals, trajectory.vectors)


def casimir_errors(ivp: InitialValueProblem, trajectory: Outcome) -> dict[str, Array]:
    """Return the error of each Casimir function of a Poisson system, HLW Def. 2.5, by name, each shape(n,) over the outputs.

    Parameters
    ----------
    ivp : InitialValueProblem
        The system with its numbers.
    trajectory : Outcome
        A run on it.

    Returns
    -------
    dict of str to ndarray, shape(n,)
        C(y(t)) - C(y0), in the unit of C; empty if the system declares no Casimirs.
    """
    return _errors(ivp, "casimirs", ivp.casimirs, trajectory.vectors)


def _errors(ivp: InitialValueProblem, function: str, names: tuple[str, ...], states: tuple[Array, ...]) -> dict[str, Any]:
    if not names:
        return {}
    values = ivp.along(function, *states)
    return dict(zip(names, (values - values[0]).T, strict=True))
