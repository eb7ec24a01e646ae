"""The cost of accuracy: powers of the tolerance, calls of the residual, and an estimate of the error at a tenth of the tolerance."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd

from daebench.draw.figures import QUIET, grid_of_axes, save
from daebench.pages.report.claims import require
from daebench.pages.report.tables import part
from daebench.reports.index_reduction.ida import label
from daebench.reports.tolerances.accuracy import ERROR, STROKE, WANTED, to_ask
from daebench.reports.tolerances.runs import IVPS, SMALL

CLOSE = 2.0
"""An estimate is close if it is within this factor of the true error, either way."""


def slopes(bands: pd.DataFrame) -> pd.DataFrame:
    """Test that errors fall more slowly than tolerances; return, by formulation, the least and the largest power over the problems."""
    small = bands[bands["error"] < SMALL]
    rows = []
    for (formulation, ivp), group in small.groupby(["formulation", "scene"]):
        power = np.polyfit(np.log(group["tol"]), np.log(group["error"]), 1)[0]
        rows.append({"formulation": formulation, "scene": ivp, "power": power})
    power_ranges: pd.DataFrame = pd.DataFrame(rows).groupby("formulation")["power"].agg(["min", "max"])
    require(power_ranges["max"].max() < 1, "the error falls more slowly than the tolerance everywhere", power_ranges["max"].to_dict())
    return power_ranges


def last_decade(bands: pd.DataFrame) -> pd.DataFrame:
    """Return cost and error of the tightest tolerance relative to one decade before; medians over the starts."""
    columns = ["residuals", "error"]
    tols = sorted(bands["tol"].unique())
    end, before = (bands[bands["tol"] == tol].set_index(["scene", "formulation"])[columns] for tol in tols[:2])
    ratio = (end / before).dropna().reset_index()
    ordered: pd.DataFrame = ratio.sort_values("residuals", ascending=False)
    return ordered


def check_cost(bands: pd.DataFrame) -> SimpleNamespace:
    """Test that index 3 is the most expensive way to a given accuracy; return by what factor, and where it does not reach it."""
    calls = {key: calls_for(rows, WANTED) for key, rows in bands.groupby(["scene", "formulation"])}
    table = pd.Series(calls).unstack().reindex(list(IVPS))
    require(table.drop(columns="index3").notna().all().all(), f"all but index 3 reach {WANTED:g} m on every system", table.to_dict())
    ratio = table["index3"] / table.min(axis=1)
    dearest = (table["index3"] >= table.max(axis=1)) | table["index3"].isna()
    require(dearest.all(), f"index 3 is the most expensive way to {WANTED:g} m on every system", table.to_dict())
    never = [IVPS[str(ivp)] for ivp in ratio.index[ratio.isna()]]
    return SimpleNamespace(least=ratio.min(), most=ratio.max(), never=never)


def calls_for(rows: pd.DataFrame, wanted: float) -> float:
    """Return the residual calls of the run with the loosest tolerance that reaches an accuracy, NaN if there is none."""
    calls = rows["residuals"][rows["tol"] == to_ask(rows, wanted)]
    return float(calls.iloc[0]) if len(calls) else float("nan")


def check_estimate(done: pd.DataFrame) -> SimpleNamespace:
    """Test that the difference from the run at a tenth of the tolerance estimates the error."""
    rows = done[done["estimate"].notna() & (done["error"] < SMALL)]
    ratio = rows["estimate"] / rows["error"]
    close = int(np.sum((ratio > 1 / CLOSE) & (ratio < CLOSE)))
    require(close > 0.9 * len(ratio), "the estimate is within a factor of two in nine cases of ten", f"{close} of {len(ratio)}")
    low, high = ratio.quantile(0.01), ratio.quantile(0.99)
    return SimpleNamespace(n=len(ratio), close=close, low=low, high=high, least=ratio.min(), most=ratio.max(), median=ratio.median())


FEWEST = 20
"""Smallest number of runs in a decade of errors for which percentiles are drawn."""


def draw_cost(bands: pd.DataFrame, folder: Path) -> Path:
    """Draw residual calls against the error reached, medians over the starts: one panel per problem."""
    done = bands[bands["error"].notna()]
    figure, axes = grid_of_axes(2, 3, 5.2, x=ERROR, y="calls of the residual", sharex=True, sharey=True)
    for ax, (ivp, title) in zip(axes.flat, IVPS.items(), strict=False):
        for formulation, stroke in STROKE.items():
            rows = part(done, scene=ivp, formulation=formulation)
            ax.plot(rows["error"], rows["residuals"], label=label(formulation), **stroke.points())
        ax.set(xscale="log", yscale="log", title=title, xlim=(2e1, 1e-13))
        ax.set_xticks([1e0, 1e-3, 1e-6, 1e-9, 1e-12])
        ax.minorticks_off()
    legend_panel(axes, ERROR)
    return save(figure, folder, "cost", done)


def legend_panel(axes: Any, x: str) -> None:
    """Turn the last of six panels into the legend of the others, and label the axis above it."""
    axes[0, 2].tick_params(labelbottom=True)
    axes[0, 2].set_xlabel(x)
    axes[1, 2].axis("off")
    axes[1, 2].legend(*axes[0, 0].get_legend_handles_labels(), loc="center left", labelspacing=0.8)


def draw_estimate(runs: pd.DataFrame, folder: Path) -> Path:
    """Draw the ratio of the estimate at a tenth of the tolerance to the true error: medians and percentiles by decade."""
    rows = runs[runs["default"] & runs["estimate"].notna() & (runs["error"] < SMALL)]
    figure, axes = grid_of_axes(1, 1, 3.4)
    ax = axes[0, 0]
    ax.axhspan(1 / CLOSE, CLOSE, color="#eeeeee", zorder=0, linewidth=0)
    ax.axhline(1, color=QUIET, linewidth=1.0)
    for formulation, stroke in STROKE.items():
        chosen = rows[rows["formulation"] == formulation]
        decades = (chosen["estimate"] / chosen["error"]).groupby(np.floor(np.log10(chosen["error"])))
        parts = decades.quantile(np.array([0.01, 0.5, 0.99])).unstack()[decades.size() >= FEWEST]
        middle = 10 ** (parts.index.to_numpy() + 0.5)
        ax.fill_between(middle, parts[0.01], parts[0.99], color=stroke.color, alpha=0.22, linewidth=0)
        ax.plot(middle, parts[0.5], label=label(formulation), **stroke.points())
    ax.set(xscale="log", yscale="log", xlabel=f"true error: {ERROR}", ylabel="estimate / true error", xlim=(2e-1, 1e-12))
    ax.set_yticks([0.1, 0.5, 1, 2, 10], ["0.1", "0.5", "1", "2", "10"])
    ax.minorticks_off()
    figure.legend(loc="outside lower center", ncols=4)
    return save(figure, folder, "estimate", rows[["scene", "start", "formulation", "tol", "error", "estimate"]])
