"""The index-reduced ODE of a problem with redundant constraints: its multipliers are found by least squares."""

import types
from typing import Any

import numpy as np

from daebench.errors import DaebenchError
from daebench.methods.formulations.constrained import Array, Dae, pose
from daebench.runs.ivp import ConstrainedIvp

COMPILED = True
"""Whether the right side is handed to numba."""

STEP = 1e-30
"""Imaginary part in which the Jacobian is carried: far below what the real part could notice."""


def reduced(ivp: ConstrainedIvp) -> Dae:
    """Return HLW (1.18), with lam by least squares where the initial value problem says so."""
    return by_least_squares(ivp) if ivp.on_singular == "least-squares" else pose(ivp, "ode")


def by_least_squares(ivp: ConstrainedIvp) -> Dae:
    """Return HLW (1.18) with y = (q, p), where lam is the least-squares solution of (1.12) of least norm.

    Where constraints depend on each other lam is not determined, but G^T lam is. The Jacobian is that of the right side, by complex
    steps.

    Raises
    ------
    DaebenchError
        If the right side is not finite at the start.
    """
    par = np.array(ivp.par, dtype=float)
    y0 = np.concatenate([ivp.q0, ivp.p0])
    module = _module(ivp)
    rates = np.empty_like(y0)
    if not module.rhs(0.0, y0, rates, par) > 0.0:
        where = f"{ivp.problem}, case {ivp.case}"
        raise DaebenchError(f"{where}, has no finite rates at the start; check parameters and initial values.")
    return Dae("ode", "plain", ivp, par, y0, rates, module, ivp.d, ivp.m)


def _module(ivp: ConstrainedIvp) -> types.ModuleType:
    """Return what :class:`daebench.methods.formulations.constrained.Dae` takes for the generated functions of ``ode``."""
    from daebench.methods.formulations.residuals import IMPLICIT

    real, complex_ = _right_side(ivp, "float64"), _right_side(ivp, "complex128")

    def rhs(t: float, y: Array, out: Array, par: Array) -> float:
        return float(real(y, out, par))

    def rhs_jacobian(t: float, y: Array, JJ: Array, par: Array) -> float:
        health, column = np.inf, np.empty(len(y), dtype=complex)
        for j in range(len(y)):
            moved = y.astype(complex)
            moved[j] += STEP * 1j
            health = min(health, float(complex_(moved, column, par)))
            JJ[:, j] = column.imag / STEP
        return health

    module = types.ModuleType(f"{ivp.problem}_least_squares")
    vars(module).update(rhs=rhs, rhs_jacobian=rhs_jacobian, MECHANICAL=False)
    exec(IMPLICIT, vars(module))
    return module


def _right_side(ivp: ConstrainedIvp, precision: str) -> Any:
    """Return the compiled function of (y, out, par) that fills out with (q', p') and returns the smallest pivot, NaN if a rate is."""
    from daebench.compiler import codegen
    from daebench.compiler.definition import Wrapper

    d, n = ivp.d, len(ivp.par)
    q, p = (codegen.pack(f"y[{i}]" for i in range(start, start + d)) for start in (0, d))
    lines = [f"dp, dq, pivot = reduced_f({p}, {q}, {codegen.pack(f'par[{k}]' for k in range(n))})"]
    lines += [f"out[{i}], out[{d + i}] = dq[{i}], dp[{i}]" for i in range(d)]
    lines += [f"pivot += 0.0 * abs(out[{i}])" for i in range(2 * d)]
    text = codegen.function("right_side(y, out, par)", *lines, "return pivot")

    title = f"Right side of {ivp.problem} by least squares, {precision}."
    options: dict[str, Any] = {"precision": precision, "singular": "least-squares", "compiled": COMPILED}
    return ivp.source.linked(f"least_squares_{precision}", title, ["f"], wrapper=Wrapper(text, ("right_side",)), **options).right_side
