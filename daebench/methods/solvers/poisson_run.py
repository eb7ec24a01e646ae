"""What tolerance-driven methods on Poisson systems share: what they refuse, and the trajectory from what a solver gave."""

from collections.abc import Mapping

import numpy as np

from daebench.errors import BadInput
from daebench.methods.fixed_step.base import monitored_names
from daebench.methods.fixed_step.poisson import require_poisson
from daebench.methods.formulations.poisson import PoissonDae
from daebench.methods.solvers.drive import TOLERANCES, Array, Driven, check
from daebench.runs.ivp import InitialValueProblem, PoissonIvp
from daebench.runs.request import Request
from daebench.runs.trajectory import POISSON, PoissonTrajectory

ADVICE = "end the run earlier if the motion itself leaves all bounds there, or use another tol"
"""What to do where a run stops early."""


LARGEST = 2000
"""Coordinates up to which a solver may work with the whole Jacobian."""


def refused(name: str, ivp: InitialValueProblem, *, dense: bool) -> str | None:
    """Return why a method of this name cannot be used on what is no Poisson system, or on one too large for its Jacobian, or None."""
    if ivp.facts.KIND != "poisson":
        return f"{name} is asked for as a method for Poisson systems, and {ivp.problem} is a constrained problem."
    if dense and ivp.size > LARGEST:
        return (
            f"{name} solves with the whole Jacobian, and {ivp.problem} has {ivp.size} coordinates, more than {LARGEST}; "
            "use scipy:DOP853, or a fixed-step method such as strang."
        )
    return None


def accept(name: str, refusal: str | None, request: Request, least: float = TOLERANCES[0]) -> None:
    """Accept a request that can be met.

    Raises
    ------
    BadInput
        If the method refuses the system, or see :func:`daebench.methods.fixed_step.poisson.require_poisson` and
        :func:`daebench.methods.solvers.drive.check`.
    """
    if refusal:
        raise BadInput(refusal)
    require_poisson(name, request)
    check(name, request, least)


def poisson_trajectory(dae: PoissonDae, request: Request, found: Driven) -> PoissonTrajectory:
    """Return the trajectory, with the monitored quantities over all outputs.

    Parameters
    ----------
    dae : PoissonDae
        What was solved.
    request : Request
        What was asked for.
    found : Driven
        What the solver gave.
    """
    y = dae.states(found.Y)
    maxima = _maxima(dae.ivp, request.watched(POISSON), y)
    return PoissonTrajectory(**found.outcome, t=found.t[found.kept], y=y[found.kept], maxima=maxima)


def _maxima(ivp: PoissonIvp, watch: tuple[str, ...], Y: Array) -> Mapping[str, float]:
    """Return the largest moduli over all outputs, by name."""
    functions = {"energy": "H", "casimirs": "casimirs", "integrals": "integrals"}
    names = monitored_names(watch, ivp)
    if not names:
        return {}
    values = np.concatenate([ivp.along(functions[each], Y).reshape(len(Y), -1) for each in watch], axis=1)
    return dict(zip(names, map(float, np.max(np.abs(values - values[0]), axis=0)), strict=True))
