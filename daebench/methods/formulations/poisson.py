"""Pose a Poisson system for tolerance-driven solvers: as an ODE, or as a DAE that keeps its Casimir functions."""

import types
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from daebench.compiler.cache import generated
from daebench.compiler.callbacks import SINGULAR
from daebench.compiler.linear.compiled_solvers import eliminate
from daebench.errors import BadInput, DaebenchError, unknown
from daebench.methods.formulations.constrained import Array, Posed
from daebench.methods.formulations.table import POISSON_FORMULATIONS
from daebench.runs.ivp import PoissonIvp


@dataclass(frozen=True, eq=False)
class PoissonDae(Posed):
    """One Poisson system as F(t, y, y') = 0, with the unknowns (y, mu), or y alone for ``ode``.

    The multipliers mu vanish along the motion, for C_y B = 0. Those that are derivatives are those of Mu with Mu' = mu. The values
    C(y0) that are kept end ``par``.
    """

    ivp: PoissonIvp
    inside: Callable[..., bool] | None = field(default=None, repr=False)
    """``inside(y, par)`` says whether a state, a tuple of numbers, is in the domain; None where it is the whole space."""

    @property
    def blocks(self) -> dict[str, slice]:
        """Where the unknowns are: "y", and "mu" where there are multipliers."""
        size = self.ivp.size
        return {"y": slice(0, size)} | ({"mu": slice(size, self.n)} if self.n > size else {})

    def states(self, Y: Array) -> Array:
        """Return y, shape(rows, size), from rows of unknowns; as copies."""
        return Y[:, : self.ivp.size].copy()

    def outside(self, y: Array) -> str:
        """Return the domain in words where the state has left it, else ""."""
        if self.inside is None:
            return ""
        with np.errstate(all="ignore"):
            inside = self.inside(tuple(y[: self.ivp.size]), self.ivp.par)
        return "" if inside else f"the domain {' and '.join(f'{expression} > 0' for expression in self.ivp.facts.DOMAIN)}"


def pose_poisson(ivp: PoissonIvp, formulation: str, *, multipliers: str = "plain") -> PoissonDae:
    """Return the initial value problem in a formulation."""
    if formulation not in POISSON_FORMULATIONS:
        raise unknown("formulation of Poisson systems", formulation, POISSON_FORMULATIONS)
    if formulation == "casimirs" and not ivp.casimirs:
        raise BadInput(without_casimirs(ivp), "casimirs-missing")
    module = _module(ivp, formulation, multipliers if formulation == "casimirs" else "plain")
    rates = ivp.value("field", ivp.y0).astype(float)
    _require_finite(ivp, rates, np.asarray(ivp.value("H", ivp.y0), dtype=float))
    casimir_values = _kept(ivp) if formulation == "casimirs" else np.empty(0)
    none = np.zeros(len(casimir_values))
    par, y0, yp0 = (np.concatenate(parts) for parts in ((ivp.par, casimir_values), (ivp.y0, none), (rates, none)))
    inside: Any = ivp.functions("inside").inside if ivp.facts.DOMAIN else None
    return PoissonDae(formulation, multipliers, ivp, par, y0, yp0, module, inside)


def without_casimirs(ivp: Any) -> str:
    """Return why a system cannot be posed with its Casimir functions."""
    return f"{ivp.problem} declares no Casimir functions for multipliers to keep; use ida:ode."


def _module(ivp: PoissonIvp, formulation: str, multipliers: str) -> types.ModuleType:
    def build() -> str:
        from daebench.methods.formulations import poisson_residuals

        title = f"{ivp.problem} as {formulation}, multipliers {multipliers}."
        return poisson_residuals.source(title, ivp.source.derivation, formulation, multipliers)

    return generated(f"{ivp.problem}_{formulation}", f"{ivp.source.key} poisson dae {formulation} {multipliers}", build)


def _kept(ivp: PoissonIvp) -> Array:
    """Return the values of the Casimir functions at the start, shape(k,), where their gradients are independent there."""
    C, C_y = (ivp.value(name, ivp.y0).astype(float) for name in ("casimirs", "C_y"))
    _require_finite(ivp, C, C_y)
    pivot = eliminate(C_y @ C_y.T, np.zeros((len(C), 1)))
    if not pivot > SINGULAR:
        raise DaebenchError(
            f"the gradients of the Casimir functions of {ivp.problem} are dependent at y0 = {ivp.y0.tolist()} (relative pivot "
            f"{pivot:.1e}), so that their multipliers are not determined; use ida:ode.",
            "casimirs-dependent",
        )
    return C


def _require_finite(ivp: PoissonIvp, *values: Array) -> None:
    if not all(np.all(np.isfinite(value)) for value in values):
        where = f"{ivp.problem}, case {ivp.case}, has values at the start that are not finite"
        raise DaebenchError(f"{where}; check parameters and initial values.", "rates-not-finite-at-start")
