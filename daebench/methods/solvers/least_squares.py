"""The index-reduced ODE of a problem with redundant constraints: its multipliers are found by least squares."""

import types
from typing import Any

import numpy as np

from daebench.compiler.callbacks import SIGNATURES
from daebench.errors import DaebenchError
from daebench.methods.formulations.constrained import Dae, pose
from daebench.runs.ivp import ConstrainedIvp

COMPILED = True
"""Whether the right side is compiled."""


def reduced(ivp: ConstrainedIvp) -> Dae:
    """Return HLW (1.18), with lam by least squares where the initial value problem says so."""
    return by_least_squares(ivp) if ivp.on_singular == "least-squares" else pose(ivp, "ode")


def by_least_squares(ivp: ConstrainedIvp) -> Dae:
    """Return HLW (1.18) with y = (q, p), where lam is the least-squares solution of (1.12) of least norm.

    Where constraints depend on each other lam is not determined, but G^T lam is. The Jacobian is that of the right side, by complex
    steps.
    """
    par = np.array(ivp.par, dtype=float)
    y0 = np.concatenate([ivp.q0, ivp.p0])
    module = _module(ivp)
    rates = np.empty_like(y0)
    if not module.rhs(0.0, y0, rates, par) > 0.0:
        where = f"{ivp.problem}, case {ivp.case}"
        raise DaebenchError(f"{where}, has no finite rates at the start; check parameters and initial values.", "no-finite-rates-at-start")
    return Dae("ode", "plain", ivp, par, y0, rates, module, ivp.d, ivp.m)


def _module(ivp: ConstrainedIvp) -> types.ModuleType:
    """Return a module in place of the generated one of ``ode``, as :class:`daebench.methods.formulations.constrained.Dae` takes it.

    It has the functions of two, one in real numbers and one in complex ones: what C calls of each needs nothing of the other.
    """
    from daebench.methods.formulations.least_squares_residuals import PARTS, written

    module = types.ModuleType(f"{ivp.problem}_least_squares")
    for precision in PARTS:
        wrapper = written(precision, ivp.d, len(ivp.par), compiled=COMPILED)
        options: dict[str, Any] = {"precision": precision, "singular": "least-squares", "compiled": COMPILED}
        title = f"{ivp.problem} as ode, multipliers by least squares, {precision}."
        part = vars(ivp.source.linked(f"least_squares_{precision}", title, ["f"], wrapper=wrapper, **options))
        vars(module).update({name: part[name] for name in (*wrapper.roots, *SIGNATURES) if name in part})
    vars(module)["MECHANICAL"] = False
    return module
