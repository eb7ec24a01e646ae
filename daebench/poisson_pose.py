"""Pose a Poisson system for tolerance-driven solvers: as an ODE, or as a DAE that keeps its Casimir functions."""

import types
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from daebench.cache import generated
from daebench.elimination import SINGULAR, eliminate
from daebench.errors import BadInput, DaebenchError, unknown
from daebench.pose import Array, Posed
from daebench.scene import PoissonScene

FORMULATIONS = {
    "casimirs": "y' = B H_y + C_y^T mu with 0 = C(y) - C(y0): index 2, with a multiplier for each Casimir function",
    "ode": "HLW (2.12): y' = B H_y",
}
"""The formulations, each in a line."""


@dataclass(frozen=True, eq=False)
class PoissonDae(Posed):
    """One Poisson system as F(t, y, y') = 0, with the unknowns (y, mu), or y alone for ``ode``.

    The multipliers mu vanish along the motion, for C_y B = 0. Those that are derivatives are those of Mu with Mu' = mu. The values
    C(y0) that are kept end ``par``.

    Parameters
    ----------
    inside : callable, optional
        ``inside(y, par)`` says whether a state, a tuple of numbers, is in the domain; None where it is the whole space.
    """

    scene: PoissonScene
    inside: Callable[..., bool] | None = field(default=None, repr=False)

    @property
    def blocks(self) -> dict[str, slice]:
        """Where the unknowns are: "y", and "mu" where there are multipliers."""
        size = self.scene.size
        return {"y": slice(0, size)} | ({"mu": slice(size, self.n)} if self.n > size else {})

    def states(self, Y: Array) -> Array:
        """Return y, shape(rows, size), from rows of unknowns; as copies."""
        return Y[:, : self.scene.size].copy()

    def outside(self, y: Array) -> str:
        """Return the domain in words where the state has left it, else ""."""
        if self.inside is None:
            return ""
        with np.errstate(all="ignore"):
            inside = self.inside(tuple(y[: self.scene.size]), self.scene.par)
        return "" if inside else f"the domain {' and '.join(f'{each} > 0' for each in self.scene.sheet.DOMAIN)}"


def pose_poisson(scene: PoissonScene, formulation: str, *, multipliers: str = "plain") -> PoissonDae:
    """Return the scene in a formulation.

    Parameters
    ----------
    scene : PoissonScene
        The system with the numbers of one case.
    formulation : str
        One of ``FORMULATIONS``.
    multipliers : str
        "plain" or "derivative", see :class:`PoissonDae`.

    Raises
    ------
    BadInput
        If the formulation is unknown, or ``casimirs`` is asked for where there is no Casimir function.
    DaebenchError
        If the gradients of the Casimir functions are dependent at the start, or a value is not finite there.
    """
    if formulation not in FORMULATIONS:
        raise unknown("formulation of Poisson systems", formulation, FORMULATIONS)
    if formulation == "casimirs" and not scene.casimirs:
        raise BadInput(without_casimirs(scene))
    module = _module(scene, formulation, multipliers if formulation == "casimirs" else "plain")
    rates = scene.value("field", scene.y0).astype(float)
    _require_finite(scene, rates, np.asarray(scene.value("H", scene.y0), dtype=float))
    kept = _kept(scene) if formulation == "casimirs" else np.empty(0)
    none = np.zeros(len(kept))
    par, y0, yp0 = (np.concatenate(parts) for parts in ((scene.par, kept), (scene.y0, none), (rates, none)))
    inside: Any = scene.functions("inside").inside if scene.sheet.DOMAIN else None
    return PoissonDae(formulation, multipliers, scene, par, y0, yp0, module, inside)


def without_casimirs(scene: Any) -> str:
    """Return why a system cannot be posed with its Casimir functions."""
    return f"{scene.problem} declares no Casimir functions for multipliers to keep; use ida:ode."


def _module(scene: PoissonScene, formulation: str, multipliers: str) -> types.ModuleType:
    def build(cached: bool) -> str:
        from daebench import poisson_residuals

        title = f"{scene.problem} as {formulation}, multipliers {multipliers}."
        return poisson_residuals.source(title, scene.source.derivation, formulation, multipliers, cached=cached)

    return generated(f"{scene.problem}_{formulation}", f"{scene.source.key} poisson dae {formulation} {multipliers}", build)


def _kept(scene: PoissonScene) -> Array:
    """Return the values of the Casimir functions at the start, shape(k,), where their gradients are independent there."""
    C, C_y = (scene.value(name, scene.y0).astype(float) for name in ("casimirs", "C_y"))
    _require_finite(scene, C, C_y)
    pivot = eliminate(C_y @ C_y.T, np.zeros((len(C), 1)))
    if not pivot > SINGULAR:
        raise DaebenchError(
            f"the gradients of the Casimir functions of {scene.problem} are dependent at y0 = {scene.y0.tolist()} (relative pivot "
            f"{pivot:.1e}), so that their multipliers are not determined; use ida:ode."
        )
    return C


def _require_finite(scene: PoissonScene, *values: Array) -> None:
    if not all(np.all(np.isfinite(each)) for each in values):
        where = f"{scene.problem}, case {scene.case}, has values at the start that are not finite"
        raise DaebenchError(f"{where}; check parameters and initial values.")
