"""Drift laws: how |g|, the energy error and the position error of IDA grow with time, fitted as powers of it."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd

from daebench.diagnostics.energy_verdict import energy_error
from daebench.draw.figures import grid_of_axes, legend_below, save
from daebench.methods.solvers.ida import DEFAULT_TREATMENTS
from daebench.pages.report import count, power_of_ten, with_error
from daebench.pages.report.claims import require
from daebench.pages.report.tables import Table, part, text
from daebench.reports.index_reduction.ida import label
from daebench.reports.tolerances.accuracy import STROKE
from daebench.reports.tolerances.runs import FAST, FORMULATIONS, exact_of, ivp_of, solve
from daebench.runs.ivp import Array

T_LONG = 100.0
TOL = 1e-12
OTHER_TOLERANCES = (1e-8, 1e-10, 1e-14)
"""Further tolerances for index 1, in addition to ``TOL``."""

RUNS = (("index1", TOL), ("index2", TOL), ("ggl", TOL), ("index3", TOL), *(("index1", tol) for tol in OTHER_TOLERANCES))
QUANTITIES = ("g", "energy", "error")
HALF_OCTAVES = 11
"""Windows, half an octave of time long; the first begins after more than two swings."""

SATURATED = 0.1
"""An error from this on, in lengths of the rod, no longer grows by the law of small errors."""

CLEAR = 100.0
"""A value up to this many times its possible error is not used."""

FEWEST = 5
"""Smallest number of windows of a fit."""


@dataclass(frozen=True)
class Power:
    """A law c t^exponent fitted to windows."""

    exponent: float
    error: float
    """The exponent and its standard error; NaN if fewer than five windows are left."""
    factor: float
    """c."""
    windows: int
    """How many windows were used."""


def drift_run(formulation: str, tol: float) -> pd.DataFrame:
    """Return t, |g|, |energy error| and the largest position error on the fast pendulum; RunFailed where the run stops early."""
    ivp, reference = ivp_of(FAST), exact_of(FAST, T_LONG)
    run = solve(ivp, formulation, DEFAULT_TREATMENTS[formulation], tol, reference).complete()
    g = np.max(np.abs(ivp.along("g", run.q)), axis=1)
    error = np.max(np.abs(run.q - reference.q), axis=1)
    return pd.DataFrame(
        {"formulation": formulation, "tol": tol, "t": run.t, "g": g, "energy": np.abs(energy_error(ivp, run)), "error": error}
    )


def windows(t: Array, value: Array) -> tuple[Array, Array]:
    """Return the geometric middles of windows that are half an octave long, up to the last time, and the largest value in each."""
    edges = t[-1] * 2.0 ** (-np.arange(HALF_OCTAVES, -1, -1) / 2)
    inside = [(t > a) & (t <= b) for a, b in pairwise(edges)]
    return np.sqrt(edges[:-1] * edges[1:]), np.array([np.max(value[window]) for window in inside])


def fit_power(t: Array, value: Array, *, floor: float, ceiling: float = np.inf) -> Power:
    """Return the law of growth: the least-squares line through the windows' logarithms.

    A window is used if its value is above 100 times ``floor`` and no value so far has reached ``ceiling``.

    Shapes: t, value (n,).
    """
    used = (value > CLEAR * floor) & (np.maximum.accumulate(value) < ceiling)
    n = int(np.sum(used))
    if n < FEWEST:
        return Power(float("nan"), float("nan"), float("nan"), n)
    line, covariance = np.polyfit(np.log(t[used]), np.log(value[used]), 1, cov=True)
    return Power(float(line[0]), float(np.sqrt(covariance[0, 0])), float(np.exp(line[1])), n)


def laws(run: pd.DataFrame, floor: float) -> list[dict[str, Any]]:
    """Return one row per quantity: its law of growth along a run whose reference is known to ``floor``."""
    eps = float(np.finfo(float).eps)
    limits = {"g": (eps, np.inf), "energy": (eps, np.inf), "error": (floor, SATURATED)}
    rows = []
    for quantity, (least, most) in limits.items():
        law = fit_power(*windows(run["t"].to_numpy(), run[quantity].to_numpy()), floor=least, ceiling=most)
        rows.append({"formulation": run["formulation"].iloc[0], "tol": run["tol"].iloc[0], "quantity": quantity} | vars(law))
    return rows


EXPONENTS: Mapping[str, Mapping[str, float]] = {
    "index1": {"g": 2, "energy": 2, "error": 3},
    "index2": {"g": 1, "energy": 1, "error": 2},
    "ggl": {"energy": 1, "error": 2},
    "index3": {"energy": 1, "error": 2},
}
"""Powers of time that the text explains."""


BAND = 0.5
"""Tolerance for the agreement of a fitted exponent with a whole number."""


BOUNDED = 0.5
"""Growth with an exponent below this is called slow."""


def check_laws(laws: pd.DataFrame) -> SimpleNamespace:
    """Test the powers of time."""
    main = laws[laws["tol"] == TOL]
    for formulation, expected in EXPONENTS.items():
        for quantity, power in expected.items():
            fitted_power = exponent(main, formulation, quantity)
            require(abs(fitted_power - power) < BAND, f"{quantity} of {formulation} grows like t^{power}", f"{fitted_power:.3f}")
    for formulation in ("ggl", "index3"):
        fitted_power = exponent(main, formulation, "g")
        require(fitted_power < BOUNDED, f"g of {formulation} hardly grows", f"{fitted_power:.3f}")
    return SimpleNamespace(main={f: {q: law_of(main, f, q) for q in QUANTITIES} for f in FORMULATIONS})


def law_of(laws: pd.DataFrame, formulation: str, quantity: str) -> Any:
    """Return the row of a law from the rows of one tolerance."""
    return part(laws, formulation=formulation, quantity=quantity).iloc[0]


def exponent(laws: pd.DataFrame, formulation: str, quantity: str) -> float:
    """Return the exponent of a law."""
    return float(law_of(laws, formulation, quantity)["exponent"])


TIME = "time $t$  [s]"


def draw_drift(drift: pd.DataFrame, laws: pd.DataFrame, folder: Path) -> Path:
    """Draw the windows' largest constraint residual, energy error and position error against time, with the fitted powers."""
    figure, axes = grid_of_axes(1, 3, 3.6, sharex=True)
    titles = {"g": "constraint $|g|$  [m²]", "energy": "energy error  [J]", "error": "position error  [m]"}
    frames = []
    for formulation, stroke in STROKE.items():
        run = part(drift, formulation=formulation, tol=TOL)
        for ax, quantity in zip(axes[0], titles, strict=True):
            t, value = windows(run["t"].to_numpy(), run[quantity].to_numpy())
            ax.plot(t, value, label=label(formulation), **stroke.points() | {"linestyle": "none"})
            law = law_of(laws[laws["tol"] == TOL], formulation, quantity)
            ax.plot(t, law["factor"] * t ** law["exponent"], **stroke.line() | {"linewidth": 1.0})
            ax.text(
                t[-1] * 1.15,
                law["factor"] * t[-1] ** law["exponent"],
                f"{law['exponent']:.1f}",
                color=stroke.color,
                fontsize=8,
                va="center",
            )
            frames.append(pd.DataFrame({"formulation": formulation, "tol": TOL, "quantity": quantity, "t": t, "largest": value}))
    for ax, title in zip(axes[0], titles.values(), strict=True):
        ax.set(xscale="log", yscale="log", title=title, xlabel=TIME, xlim=(2, 160))
        ax.set_xticks([3, 10, 30, 100], ["3", "10", "30", "100"])
        ax.minorticks_off()
    legend_below(figure, axes[0, 0], 4)
    return save(figure, folder, "drift", pd.concat(frames, ignore_index=True))


def laws_table(laws: pd.DataFrame) -> Table:
    """Return the fitted powers of time."""
    rows: list[dict[str, Any]] = []
    for formulation in FORMULATIONS:
        for tol, tol_laws in reversed(list(laws[laws["formulation"] == formulation].groupby("tol"))):
            laws_by_quantity = tol_laws.set_index("quantity")
            powers = {name: with_error(laws_by_quantity["exponent"][name], laws_by_quantity["error"][name]) for name in QUANTITIES}
            rows.append({"formulation": label(formulation), "tol": tol} | powers | {"windows": int(laws_by_quantity["windows"]["error"])})
    return Table(
        pd.DataFrame(rows, dtype=object),  # text that is HTML must not become a string of pandas
        {
            "formulation": text,
            "tol": (power_of_ten, "tolerance"),
            "g": "|<i>g</i>|",
            "energy": "energy error",
            "error": "position error",
            "windows": (count, "windows<small>of the last</small>"),
        },
        laws,
    )
