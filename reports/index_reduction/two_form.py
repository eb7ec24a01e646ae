"""Why index reduction breaks symplecticity: d(dq ^ dp)/dt = - sum dg_i ^ dlam_i on the flow of (1.18), compared with measurements."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd

from daebench.diagnostics.symplecticity import tangent_basis, tangent_path
from daebench.diagnostics.two_form_rate import two_form_rate
from daebench.draw.figures import BLACK, QUIET, grid_of_axes, save
from daebench.draw.methods import stroke_of
from daebench.methods.fixed_step.constrained import FixedStep
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.pages.report.claims import require
from daebench.reports.index_reduction.schemes import PROBLEM, SLOW, H
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.runs.make_ivp import constrained

T_END, H_FLOW = 3.0, 0.01
"""End of the runs, and the step of RK4, which replaces the exact flow of (1.18)."""


RK4_ERROR = 1e-10
"""Tolerance for the two-form of the exact flow, from which RK4 with its step differs by some 1e-11."""


@dataclass(frozen=True)
class Carried:
    """The two-form of vectors that are propagated along a run."""

    t: Array
    """Times; shape (n,)."""
    change: Array
    """dq ^ dp of every pair of propagated vectors, minus its initial value; shape (n, k, k)."""
    predicted: Array
    """The integral of - sum dg_i ^ dlam_i, by the trapezoidal rule; shape (n, k, k)."""
    dg: Array
    """Largest change of g along a propagated vector; shape (n,)."""

    @property
    def size(self) -> Array:
        """Spectral norm of the change, shape(n,)."""
        return np.asarray(np.linalg.norm(self.change, 2, axis=(1, 2)))

    @property
    def predicted_size(self) -> Array:
        """Spectral norm of the prediction, shape(n,)."""
        return np.asarray(np.linalg.norm(self.predicted, 2, axis=(1, 2)))

    @property
    def gap(self) -> float:
        """Largest norm of the change minus the prediction, relative to the largest change."""
        return float(np.linalg.norm(self.change - self.predicted, 2, axis=(1, 2)).max() / self.size.max())


def measure_two_form() -> dict[str, Carried]:
    """Return the two-form of tangents and across the manifold with the flow of (1.18), and of tangents with se and RATTLE."""
    ivp = constrained(initial_value_problem(PROBLEM, SLOW))
    along = tangent_basis(ivp, ivp.p0, ivp.q0)
    across = np.column_stack([along, np.concatenate([np.zeros(ivp.d), ivp.q0])])
    return {
        "along": carry(ivp, "rk4", H_FLOW, along),
        "across": carry(ivp, "rk4", H_FLOW, across),
        "se": carry(ivp, "se", H, along),
        "rattle": carry(ivp, "rattle", H, along),
    }


def carry(ivp: ConstrainedIvp, method: str, h: float, X: Array) -> Carried:
    """Return the two-form of vectors under a method, and the prediction from the rate of (1.18) along its own states and vectors."""
    steps, d = round(T_END / h), ivp.d
    states, carried, failure = tangent_path(FixedStep(method).path(ivp, h, steps), ivp.p0, ivp.q0, X)
    require(failure is None, f"{method} propagates the tangents to t = {T_END:g}", failure)
    half = np.swapaxes(carried[:, d:], 1, 2) @ carried[:, :d]
    form = half - np.swapaxes(half, 1, 2)
    rates = np.stack([two_form_rate(ivp, x[:d], x[d:], Y) for x, Y in zip(states, carried, strict=True)])
    predicted = np.concatenate([np.zeros_like(rates[:1]), np.cumsum(h * (rates[1:] + rates[:-1]) / 2, axis=0)])
    dg = [float(np.abs(ivp.value("G", tuple(x[d:])) @ Y[d:]).max()) for x, Y in zip(states, carried, strict=True)]
    return Carried(np.linspace(0.0, steps * h, steps + 1), form - form[0], predicted, np.array(dg))


def check_two_form(runs: Mapping[str, Carried]) -> SimpleNamespace:
    """Return the numbers of the text; the first that does not hold raises ClaimRefuted."""
    along, across, se, rattle = (runs[name] for name in ("along", "across", "se", "rattle"))
    along_most = float(along.size.max())
    require(along_most < RK4_ERROR, "the flow of (1.18) keeps the two-form of tangents of the manifold", along_most)
    require(across.size.max() > 1e-2, "the flow of (1.18) changes the two-form across the manifold", across.size.max())
    require(across.gap < 1e-3, "the change across the manifold is the integral of - dg ^ dlam", across.gap)
    require(se.dg[1] > 1e-6, "the first step of se takes tangents off the manifold", se.dg[1])
    require(se.size[1] < 1e-14 < se.size[2], "the first step of se keeps the two-form, the second does not", se.size[1:3])
    require(se.gap < 0.1, "the defect of se is the integral of - dg ^ dlam, up to terms of order h", se.gap)
    require(rattle.dg.max() < 1e-12, "RATTLE maps tangents to tangents", rattle.dg.max())
    require(rattle.size.max() < 1e-12, "RATTLE keeps the two-form", rattle.size.max())
    return SimpleNamespace(kept=along_most, across=across.size.max(), across_gap=across.gap, se=se.size[-1], se_gap=se.gap, se_dg=se.dg[1])


def draw_two_form(runs: Mapping[str, Carried], folder: Path) -> Path:
    """Draw how tangents leave the manifold, and how the two-form changes; return the path of the SVG."""
    figure, axes = grid_of_axes(1, 2, 3.3, x=r"time $t$  [$\sqrt{\ell/\gamma}$]")
    left, right = axes[0]
    se, rattle, flow = stroke_of("se").color, stroke_of("rattle").color, BLACK
    floor = 1e-17
    for ax, values in ((left, {name: run.dg for name, run in runs.items()}), (right, {name: run.size for name, run in runs.items()})):
        for name, color in (("across", QUIET), ("along", flow), ("rattle", rattle), ("se", se)):
            run = runs[name]
            ax.plot(run.t[1:], np.maximum(values[name][1:], floor), color=color, linestyle="--" if name == "along" else "-")
        ax.set(yscale="log", ylim=(floor, 100), xlim=(0, T_END))
    for name in ("across", "se"):
        run = runs[name]
        marks = slice(2, None, max(1, len(run.t) // 15))
        right.plot(run.t[marks], run.predicted_size[marks], "o", markersize=4, markerfacecolor="white", color="black", linestyle="none")
    left.set_title(r"tangents leave the manifold:  $|dg|$")
    right.set_title(r"$dq\wedge dp$ changes;  o  $-\int dg\wedge d\lambda\,dt$")
    words = {"va": "center", "fontsize": 8.5}
    for ax, heights in ((left, (12.0, 1e-4, 1e-9)), (right, (4.0, 3e-6, 1e-10))):
        ax.text(1.2, heights[0], "flow of (1.18), across", color=QUIET, **words)
        ax.text(1.2, heights[1], "se", color=se, fontweight="bold", **words)
        ax.text(1.2, heights[2], "flow of (1.18), tangents", color=flow, **words)
    for ax in (left, right):
        ax.text(1.2, 1e-14 if ax is left else 1.5e-14, "RATTLE", color=rattle, fontweight="bold", **words)
    return save(figure, folder, "two_form", two_form_table(runs))


def two_form_table(runs: Mapping[str, Carried]) -> pd.DataFrame:
    """Return the data of the figure, one row per run and time."""
    frames = [
        pd.DataFrame({"run": name, "t": run.t, "dg": run.dg, "change": run.size, "predicted": run.predicted_size})
        for name, run in runs.items()
    ]
    return pd.concat(frames, ignore_index=True)
