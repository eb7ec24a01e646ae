"""The error that is reached against the tolerance: medians and deciles over the starts, and the panels that show them."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup

from daebench.draw.figures import QUIET, grid_of_axes, save
from daebench.draw.methods import stroke_of
from daebench.pages.report import number, power_of_ten
from daebench.pages.report.claims import require
from daebench.pages.report.tables import Of, Table, finite, once, part, text
from daebench.reports.index_reduction.ida import label
from daebench.reports.tolerances.runs import FAST, FORMULATIONS, IVPS, REACHED

LOW, HIGH = 0.1, 0.9
"""Quantiles over the starts at the lower and upper edge of a band."""


def typical(runs: pd.DataFrame) -> pd.DataFrame:
    """Return one row for each problem, formulation and tolerance: medians over the starts, and deciles of the error.

    A run that did not reach its end counts as an infinite error; a median or a decile among such runs is NaN.
    """
    keys = ["scene", "formulation", "tol"]
    # Without the runs that failed, a tolerance would look the better the more starts it fails from.
    groups = runs.assign(error=runs["error"].fillna(np.inf)).groupby(keys, sort=False)
    # Interpolation towards an infinite error is infinite itself; the error below is one that was measured.
    quantiles = {
        name: groups["error"].quantile(part, interpolation="lower") for name, part in (("low", LOW), ("error", 0.5), ("high", HIGH))
    }
    frame = pd.DataFrame(quantiles | {"residuals": groups["residuals"].median(), "floor": groups["floor"].max()})
    frame["done"] = (runs["end"] == REACHED).groupby([runs[key] for key in keys], sort=False).mean()
    bands: pd.DataFrame = frame.replace(np.inf, np.nan).reset_index()
    return bands


TIGHT = 1e-12
"""A tolerance that is usually considered safe."""


MOST = 0.9
"""Fraction of the starts that counts as most."""


def check_headline(default: pd.DataFrame, done: pd.DataFrame) -> SimpleNamespace:
    """Test that the error of each run exceeds its tolerance; return by what factors."""
    beyond = int(np.sum(done["error"] > done["tol"]))
    require(beyond == len(done), "every position error is larger than its tolerance", f"{beyond} of {len(done)}")
    ratio = done["error"] / done["tol"]
    return SimpleNamespace(
        runs=len(default),
        done=len(done),
        starts=default["start"].nunique(),
        failed=default[default["end"] != REACHED],
        least=ratio.min(),
        median=float(f"{ratio.median():.2g}"),
        useless=done[done["error"] > 1],
    )


def check_tight(rows: pd.DataFrame, bands: pd.DataFrame) -> SimpleNamespace:
    """Test the statements about the tolerance 1e-12, problem by problem and start by start."""
    errors = bands.pivot(index="scene", columns="formulation", values="error").reindex(list(IVPS))
    require((bands["done"] == 1).all(), "every formulation reaches the end at 1e-12 from every start", bands["done"].min())
    require(errors.min().min() > 10 * TIGHT, "at 1e-12 every median error is over ten times that", errors.min().min())
    by_start = rows.pivot(index=["scene", "start"], columns="formulation", values="error")
    worst = float(np.mean(by_start.idxmax(axis=1) == "index3"))
    best = float(np.mean(by_start.idxmin(axis=1).isin(["index2", "ggl"])))
    require(worst > MOST, "index 3 is the least accurate at 1e-12 from most starts", worst)
    require(best > MOST, "index 2 or GGL is the most accurate at 1e-12 from most starts", best)
    require((errors.idxmax(axis=1) == "index3").all(), "index 3 is the least accurate in the median", errors.idxmax(axis=1).to_dict())
    require(errors.idxmin(axis=1).isin(["index2", "ggl"]).all(), "index 2 or GGL is the most accurate in the median", errors.to_dict())
    off = rows[rows["scene"] == FAST].groupby("formulation")["g"].median()
    require(off["index1"] > 100 * off["index3"], "index 3 stays on the constraint a hundred times closer than index 1", off.to_dict())
    require(
        cell(errors, FAST, "index3") > cell(errors, FAST, "index1"), "index 3 is nevertheless less accurate", errors.loc[FAST].to_dict()
    )
    low, high = errors.min(axis=1), errors.max(axis=1)
    return SimpleNamespace(
        errors=errors,
        best=low.min(),
        best_worst=low.max(),
        worst=high.max(),
        worst_best=high.min(),
        g=off,
        share_worst=worst,
        share_best=best,
    )


def luck(done: pd.DataFrame, bands: pd.DataFrame) -> SimpleNamespace:
    """Return the spread of errors over the starts, and the ratio of the error from the case's start to the median."""
    spread = (bands["high"] / bands["low"])[bands["done"] == 1]
    keys = ["scene", "formulation", "tol"]
    one = done[done["start"] == 0].set_index(keys)["error"] / bands.set_index(keys)["error"]
    one = one.dropna()
    factor = np.exp(np.abs(np.log(one)))
    return SimpleNamespace(median=spread.median(), most=spread.max(), factor=factor.max(), astray=np.mean(factor > 2))


def check_floor(done: pd.DataFrame) -> SimpleNamespace:
    """Test that no error is below the resolution of its reference."""
    clear = float((done["error"] / done["floor"]).min())
    require(clear > 10, "every error is over ten times the error bound of its reference", f"{clear:.3g}")
    growth = done[done["start"] == 0].groupby("scene")["amplification"].max().reindex(list(IVPS)).rename(IVPS).sort_values()
    return SimpleNamespace(
        largest=done["floor"][done["start"] == 0].max(),
        beside=done["floor"].max(),
        clear=clear,
        least_growth=growth.iloc[0],
        most_growth=growth.iloc[-1],
        growth=growth,
    )


def cell(frame: pd.DataFrame, row: str, column: str) -> float:
    """Return one number of a table."""
    value: Any = frame.loc[row, column]
    return float(value)


STROKE = {formulation: stroke_of(f"ida:{formulation}") for formulation in FORMULATIONS}


EDGE = (3e1, 1e4)
"""Where runs without a result are marked, above all errors."""


ERROR, ASKED = "largest position error  [m]", "tolerance asked for"


def draw_accuracy(bands: pd.DataFrame, folder: Path) -> Path:
    """Draw the error reached against the tolerance asked for: a panel a problem, a band over the starts for each formulation."""
    figure, axes = grid_of_axes(2, 3, 5.4, x=ASKED, y=ERROR, sharex=True, sharey=True)
    for ax, (ivp, title) in zip(axes.flat, IVPS.items(), strict=False):
        diagonal(ax, bands["tol"])
        for k, (formulation, stroke) in enumerate(STROKE.items()):
            rows = part(bands, scene=ivp, formulation=formulation)
            ax.fill_between(rows["tol"], rows["low"], rows["high"], color=stroke.color, alpha=0.22, linewidth=0)
            ax.plot(rows["tol"], rows["error"], label=label(formulation), **stroke.points())
            mark_losses(ax, rows, stroke.color, k, len(STROKE))
        finish(ax, title)
    axes[0, 0].text(1e-9, 4e-10, "error = tolerance", color=QUIET, fontsize=7.5, rotation=34, rotation_mode="anchor", va="top")
    axes[0, 2].tick_params(labelbottom=True)
    axes[0, 2].set_xlabel(ASKED)
    explain(axes[1, 2], axes[0, 0])
    return save(figure, folder, "accuracy", bands)


def mark_losses(ax: Any, rows: pd.DataFrame, color: str, k: int, of: int) -> None:
    """Mark, at the upper edge, tolerances at which some starts have no result, with their fraction."""
    y = EDGE[0] * (EDGE[1] / EDGE[0]) ** ((k + 0.5) / of)
    for tol, done in rows.loc[rows["done"] < 1, ["tol", "done"]].to_numpy():
        ax.plot(tol, y, linestyle="none", marker="x", markersize=4, markeredgewidth=1.2, color=color)
        ax.text(
            tol * (0.5 if tol > 1e-8 else 2),
            y,
            f"{100 * (1 - done):.0f} %",
            color=color,
            fontsize=6.5,
            va="center",
            ha="right" if tol > 1e-8 else "left",
        )


def diagonal(ax: Any, tolerances: "pd.Series[float]") -> None:
    """Draw the diagonal, where error and tolerance are equal."""
    ends = np.array([tolerances.min(), tolerances.max()])
    ax.plot(ends, ends, color=QUIET, linewidth=1.0)


def finish(ax: Any, title: str) -> None:
    """Set scales, limits and title of a panel of errors against tolerances."""
    ax.axhspan(*EDGE, color="#eeeeee", zorder=0, linewidth=0)
    ax.set(xscale="log", yscale="log", xlim=(4e-15, 2.5e-3), ylim=(3e-15, EDGE[1]), title=title)
    ax.set_xticks([1e-14, 1e-11, 1e-8, 1e-5])
    ax.set_yticks([1e-14, 1e-11, 1e-8, 1e-5, 1e-2])
    ax.minorticks_off()


def explain(ax: Any, source: Any) -> None:
    """Turn a panel into the legend of the others."""
    ax.axis("off")
    handles, labels = source.get_legend_handles_labels()
    lost = ax.plot([], [], linestyle="none", marker="x", color="black", markeredgewidth=1.2)[0]
    line, band = ax.plot([], [], color=QUIET)[0], ax.fill_between([], [], color="black", alpha=0.22, linewidth=0)
    texts = [*labels, "error = tolerance", f"{100 * LOW:.0f} to {100 * HIGH:.0f} % of the starts", "no result, part of the starts"]
    ax.legend([*handles, line, band, lost], texts, loc="center left", labelspacing=0.7)


def thumbnail(axis: Any, bands: pd.DataFrame) -> None:
    """Draw the error reached against the tolerance, on the first problem."""
    ivp = next(iter(IVPS))
    for formulation, stroke in STROKE.items():
        rows = part(bands, scene=ivp, formulation=formulation)
        axis.plot(rows["tol"], rows["error"], label=label(formulation).split(",")[0], color=stroke.color, linewidth=1.6)
    ends = [bands["tol"].min(), bands["tol"].max()]
    axis.plot(ends, ends, color=QUIET, linewidth=0.8, linestyle=(0, (4, 3)))
    axis.set(xscale="log", yscale="log")
    axis.minorticks_off()
    axis.set_title(f"error of IDA, {IVPS[ivp]}  [m]", loc="left")
    axis.set_xlabel("tolerance asked for", loc="right")
    axis.legend(fontsize=6.5, loc="upper left", handlelength=1.2, ncols=2, columnspacing=0.8)


SHOWN_TOLERANCES = (1e-6, 1e-9, 1e-12)


WANTED = 1e-6
"""Accuracy, m, for which the table gives the required tolerance."""


def to_ask(rows: pd.DataFrame, wanted: float) -> float:
    """Return the loosest tolerance such that it and every tighter one give the wanted accuracy, NaN if there is none.

    A run without a result does not give the accuracy.
    """
    rows = rows.sort_values("tol")
    good = np.cumprod((rows["error"] <= wanted).to_numpy(dtype=int)).astype(bool)
    return float(rows["tol"][good].max()) if good.any() else float("nan")


def reached(runs: pd.DataFrame) -> pd.DataFrame:
    """Return one row for each problem and formulation, errors at chosen tolerances, and the required tolerance."""
    bands, rows = typical(runs), list[dict[str, Any]]()
    for ivp, name in IVPS.items():
        for formulation in FORMULATIONS:
            chosen = part(bands, scene=ivp, formulation=formulation).set_index("tol")
            row: dict[str, Any] = {"scene": name, "formulation": label(formulation)}
            for tol in SHOWN_TOLERANCES:
                row |= {f"{what}_{tol:.0e}": float(chosen[what].get(tol, np.nan)) for what in ("error", "low", "high")}
            best = chosen["error"].dropna().sort_values()
            rows.append(row | {"ask": to_ask(chosen.reset_index(), WANTED), "best": best.iloc[0], "best_tol": best.index[0]})
    return pd.DataFrame(rows)


def reached_table(frame: pd.DataFrame) -> Table:
    """Return the errors reached, problem by problem: medians, and deciles below them."""
    at = {f"{tol:.0e}": tol for tol in SHOWN_TOLERANCES}
    errors = {
        f"error_{name}": (
            Of(_with_deciles, *(f"{part}_{name}" for part in ("error", "low", "high"))),
            f"error at<small>{power_of_ten(tol)}, m</small>",
        )
        for name, tol in at.items()
    }
    shown = {"scene": "problem", "formulation": text} | errors
    shown |= {
        "ask": (finite(power_of_ten), f"ask for<small>to get {power_of_ten(WANTED)} m</small>"),
        "best": (number, "best<small>of all, m</small>"),
        "best_tol": (finite(power_of_ten), "at<small>tolerance</small>"),
    }
    return Table(frame.assign(scene=once(frame["scene"])), shown, frame)


def _with_deciles(error: float, low: float, high: float) -> Markup:
    """Return a median with the deciles in small below it; a dash if it is not finite."""
    return Markup("{}<br><small>{} to {}</small>").format(number(error), number(low), number(high))
