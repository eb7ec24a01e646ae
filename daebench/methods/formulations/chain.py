"""Pose a problem whose vectors are arrays: a residual whose Jacobian is banded, in a number of operations linear in the nodes."""

import types
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from daebench.compiler.cache import generated
from daebench.methods.formulations.constrained import Array, Dae, Kernel, free_numbers, require_determined
from daebench.runs.ivp import ConstrainedIvp


@dataclass(frozen=True, eq=False)
class BandedDae(Dae):
    """One problem as F(t, y, y') = 0 with y = (q, v, lam[, mu]), evaluated node by node, so that neighbours stand side by side.

    ``residual`` takes and fills arrays in the order of the nodes, y[order]; everything else is in the order of the blocks.
    """

    order: Any = field(repr=False)
    """Index in y of each unknown in the order of the nodes; shape (n,)."""

    @property
    def band(self) -> tuple[int, int]:
        """Widths, below and above the diagonal, of the band of dF/dy + cj dF/dy' in the order of the nodes."""
        return int(self.module.LOWER), int(self.module.UPPER)

    def momenta(self, q: Array, v: Array) -> Array:
        """Return p = M v, shape(rows, d)."""
        p = np.empty_like(v)
        for one, other in zip(v, p, strict=True):
            self.module.momenta(one, other, self.par)
        return p


def pose_banded(
    ivp: ConstrainedIvp, formulation: str, options: Mapping[str, float] | None = None, *, multipliers: str = "plain"
) -> BandedDae:
    """Return an initial value problem with arrays in a formulation; see :func:`daebench.methods.formulations.constrained.pose`.

    Unknowns whose derivatives are the multipliers begin at 1: where they begin is free, and a difference quotient takes its increments from
    their size. From 0 they would be so small that round-off makes up the columns of the Jacobian that belong to them.

    At the start lam solves HLW (1.12), and v' = -M^-1 (U_q + G^T lam), both by banded elimination; mu = 0.
    """
    par = np.array([*ivp.par, *free_numbers(formulation, options or {}).values()], dtype=float)
    module = _module(ivp, formulation, multipliers)
    slopes, starts = np.array(module.PLACES).T
    order = (np.arange(module.NODES)[:, None] * slopes + starts).ravel()[module.MISSING :]
    y0, yp0 = _start(ivp, formulation, multipliers, module.residual, order, par)
    return BandedDae(formulation, multipliers, ivp, par, y0, yp0, module, ivp.d, ivp.m, order)


def refused(method: str, ivp: ConstrainedIvp) -> str | None:
    """Return why a method that solves HLW (1.18) cannot be used where vectors are arrays, as a sentence; None where they are not."""
    if not ivp.arrays:
        return None
    return (
        f"{method} solves the index-reduced ODE, in which lam joins all {ivp.facts.NODES} nodes of {ivp.problem}, so that its Jacobian "
        "is full; use ida:index1, which has the same rates and a banded Jacobian."
    )


def _module(ivp: ConstrainedIvp, formulation: str, multipliers: str) -> types.ModuleType:
    def build() -> str:
        from daebench.methods.formulations import chain_residuals

        title = f"{ivp.problem} as {formulation}, multipliers {multipliers}, node by node."
        return chain_residuals.source(title, ivp.source.derivation.chain, formulation, multipliers)

    return generated(f"{ivp.problem}_{formulation}_chain", f"{ivp.source.key} banded dae {formulation} {multipliers}", build)


def _start(ivp: ConstrainedIvp, formulation: str, multipliers: str, residual: Kernel, order: Any, par: Array) -> tuple[Array, Array]:
    """Return consistent y0 and yp0."""
    d, p0, q0 = ivp.d, ivp.p0, ivp.q0
    pivot = float(ivp.value("independence", p0, q0))
    lam, v = ivp.value("lam", p0, q0), ivp.value("H_p", p0, q0)
    forces = np.concatenate([lam, np.zeros(ivp.m * (formulation == "ggl"))])
    plain = multipliers == "plain"
    given, others = (forces, np.zeros(len(forces))) if plain else (np.ones(len(forces)), forces)
    y0, yp0 = np.concatenate([q0, v, given]), np.concatenate([v, np.zeros(d), others])
    res, still = np.empty((2, len(y0)))
    residual(0.0, y0[order], yp0[order], res, par)
    still[order] = res  # of v' = 0: its rows of momenta are U_q + G^T lam
    yp0[d : 2 * d] = ivp.value("H_p", -still[d : 2 * d], q0)
    require_determined(ivp, pivot + 0.0 * float(np.sum(y0) + np.sum(yp0)))
    return y0, yp0
