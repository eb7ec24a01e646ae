"""Runs of the report on Poisson systems, their errors, and the defect of a method."""

from dataclasses import replace
from typing import Any

import numpy as np

from daebench.diagnostics.energy import energy_drift
from daebench.diagnostics.energy_verdict import energy_error
from daebench.diagnostics.integrals import casimir_errors, integral_errors
from daebench.diagnostics.poisson import poisson_defect
from daebench.methods.fixed_step.lifted import Lifted
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import POISSON, parse
from daebench.runs.ivp import Array, PoissonIvp
from daebench.runs.request import Request
from daebench.runs.trajectory import PoissonTrajectory

ROUND_OFF = 1e-12
"""An error of a conserved quantity of size one, or a defect, up to this is round-off."""


VISIBLE = 1e-8
"""A larger defect at the largest step is not round-off."""


def ivp_of(problem: str, case: str, parameters: dict[str, float] | None = None, y0: tuple[float, ...] | None = None) -> PoissonIvp:
    """Return a case of a Poisson system of the catalogue."""
    ivp = initial_value_problem(problem, case, parameters, y0=y0)
    assert isinstance(ivp, PoissonIvp)
    return ivp


def method(name: str, *, compiled: bool = False) -> Any:
    """Return a method for any class of B, uncompiled: most runs are so short that compilation would take longer."""
    integrator: Any = parse(name, kind=POISSON, anyway=True)
    return (
        Lifted(replace(integrator.method, compiled=compiled)) if isinstance(integrator, Lifted) else replace(integrator, compiled=compiled)
    )


def solve(ivp: PoissonIvp, name: str, h: float, steps: int) -> PoissonTrajectory:
    """Return the run of a method, all of its states; it may have ended early."""
    run: PoissonTrajectory = method(name).solve(ivp, Request(value=h, steps=steps, watch=()))
    return run


def errors(ivp: PoissonIvp, run: PoissonTrajectory) -> dict[str, Array]:
    """Return the errors of energy, Casimir functions and integrals at the outputs of a run, by name, each shape(n,)."""
    return {"energy": energy_error(ivp, run)} | casimir_errors(ivp, run) | integral_errors(ivp, run)


def kind(t: Array, error: Array) -> str:
    """Return the verdict on an error: "kept", or the short form of :func:`daebench.diagnostics.energy.energy_drift`."""
    if np.max(np.abs(error)) <= ROUND_OFF:
        return "kept"
    return energy_drift(t, error).brief


def defect(ivp: PoissonIvp, name: str, h: float, steps: int) -> float:
    """Return the Poisson defect of a number of steps from the start of an initial value problem."""
    return poisson_defect(method(name).flow(ivp, h, steps), ivp.y0, lambda y: ivp.value("B", y))
