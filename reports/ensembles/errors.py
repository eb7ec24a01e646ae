"""Errors of each method from all starts of an energy, and the method with the smallest one, beside those from the start of the case."""

from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from daebench.draw.figures import QUIET, grid_of_axes, save
from daebench.draw.methods import name_of, stroke_of
from daebench.pages.report.claims import require
from daebench.pages.report.tables import part
from daebench.reports.ensembles.motions import FRACTIONS, METHODS, MIDDLE

TWICE = 2.0
"""An error differs from the median if it is more than this factor above or below it."""


LOW, HIGH = 0.05, 0.95
"""Quantiles that enclose nine tenths of the starts."""


ROUND_OFF = 1e-12
"""Smaller errors are round-off, and are not compared."""


def errors(runs: pd.DataFrame) -> pd.DataFrame:
    """Return one row per motion, method and cost: the case's own error, quantiles over all starts, and the fraction with less error."""
    rows = []
    for (motion, method, fraction), some in runs.groupby(["motion", "method", "price"], sort=False):
        size = some["size"].to_numpy()
        case_error, (low, median, high) = size[0], np.quantile(size, (LOW, 0.5, HIGH), method="inverted_cdf")
        rows.append({"motion": motion, "method": method, "price": fraction, "h": some["h"].iloc[0], "own": case_error})
        rows[-1] |= {"low": low, "median": median, "high": high, "rank": float(np.mean(size < case_error)), "largest": float(np.max(size))}
        rows[-1]["stopped"] = float(np.mean(some["failure"] != ""))
    return pd.DataFrame(rows)


def spread(sizes: pd.DataFrame) -> SimpleNamespace:
    """Return how far the case's own error differs from those of other starts, if all are known and above round-off."""
    known = sizes[np.isfinite(sizes["largest"]) & (sizes["low"] > ROUND_OFF)]
    off = known["own"] / known["median"]
    range_of = known["high"] / known["low"]
    worst = known.iloc[int((known["high"] / known["own"]).to_numpy().argmax())]
    require((known["low"] <= known["median"]).all() and (known["median"] <= known["high"]).all(), "quantiles are in order", known)
    return SimpleNamespace(
        n=len(known),
        off=((off > TWICE) | (off < 1 / TWICE)).sum(),
        spread=range_of.median(),
        most=range_of.max(),
        worst=worst,
        factor=worst["high"] / worst["own"],
        over=(known["high"] > TWICE * known["own"]).sum(),
    )


def winners(runs: pd.DataFrame) -> pd.DataFrame:
    """Return one row per motion and cost: the fraction of starts from which each method is best, and the best from the case's start.

    Runs that stopped have no error; a start from which all stop has no winner, and fractions are of the starts with a winner.
    """
    rows = []
    for (motion, fraction), some in runs.groupby(["motion", "price"], sort=False):
        sizes = np.stack([some.loc[some["method"] == method, "size"].to_numpy(dtype=float) for method in METHODS], axis=1)
        best = np.where(np.isfinite(sizes).any(axis=1), np.argmin(sizes, axis=1), -1)
        parts = np.array([np.mean(best[best >= 0] == k) if (best >= 0).any() else 0.0 for k in range(len(METHODS))])
        most = int(np.argmax(parts))
        row = {"motion": motion, "price": fraction, "own": METHODS[best[0]] if best[0] >= 0 else "", "most": METHODS[most]}
        row |= {"part": parts[most], "own_part": parts[best[0]] if best[0] >= 0 else 0.0}
        row |= {"error": float(np.sqrt(parts[most] * (1 - parts[most]) / max(1, (best >= 0).sum()))), "none": float(np.mean(best < 0))}
        rows.append(row | dict(zip(METHODS, parts, strict=True)))
    table = pd.DataFrame(rows)
    totals = table[list(METHODS)].sum(axis=1)
    require(np.all(np.abs(totals - 1) < 1e-12), "fractions of the starts add up to one", totals.tolist())
    return table


def order(first: pd.DataFrame) -> SimpleNamespace:
    """Return how often the best method from the start of the case is the best from the most starts, and from how many."""
    wrong = first[first["own"] != first["most"]]
    return SimpleNamespace(
        n=len(first),
        wrong=wrong,
        least=first["part"].min(),
        unanimous=(first["part"] == 1).sum(),
        divided=first.iloc[int(first["part"].to_numpy().argmin())],
    )


COLOR = {method: stroke_of(method).color for method in METHODS}


NAMES = [name_of(method) for method in METHODS]


ERROR = "largest energy error\nover mean kinetic energy"


CASE: dict[str, Any] = {"marker": "D", "markersize": 5, "markerfacecolor": "white", "markeredgecolor": "black", "linestyle": "none"}
"""Mark of the start of the case."""

HATCHES = {"suzuki4": "////", "kahan_li8": "...."}


def draw_errors(sizes: Any, titles: dict[str, str], folder: Path) -> Path:
    """Draw nine tenths of the errors and the case's own: one panel per motion, one row per method, at the middle cost."""
    rows = sizes[sizes["price"] == MIDDLE]
    figure, axes = grid_of_axes(4, 2, 7.0, sharey=True)
    for ax, (key, title) in zip(axes.flat, titles.items(), strict=False):
        _errors(ax, rows[rows["motion"] == key])
        ax.set_title(title)
    _explain(axes.flat[len(titles)])
    axes[-1, 0].set_xlabel(ERROR)
    axes[-2, 1].set_xlabel(ERROR)
    return save(figure, folder, "errors", rows)


def _errors(ax: Any, rows: Any) -> None:
    """Draw the errors of one motion, a row a method."""
    some = rows.set_index("method")
    finite = some[["low", "median", "high", "own"]].to_numpy()
    finite = finite[np.isfinite(finite)]
    ax.set(xscale="log", xlim=(0.5 * finite.min(), 3 * finite.max()))
    for k, method in enumerate(METHODS):
        _row(ax, k, some.loc[method], COLOR[method])
    ax.set(yticks=range(len(METHODS)), yticklabels=NAMES, ylim=(len(METHODS) - 0.4, -0.6))
    ax.grid(visible=False, axis="y")


def _row(ax: Any, k: int, one: Any, color: str) -> None:
    """Draw the starts of one method: a bar, to the edge if some have no error, the median, and the start of the case."""
    whole, edge = np.isfinite(one["high"]), ax.get_xlim()[1]
    ax.plot([one["low"], one["high"] if whole else edge], [k, k], color=color, linewidth=7, alpha=0.35, solid_capstyle="butt")
    if np.isfinite(one["median"]):
        ax.plot([one["median"]] * 2, [k - 0.3, k + 0.3], color=color, linewidth=2)
    if np.isfinite(one["own"]):
        ax.plot(one["own"], k, **CASE)
    if one["stopped"]:
        share = f"{100 * one['stopped']:.0f} %" if one["stopped"] >= 0.005 else "under 1 %"
        ax.text(1.01, k, f"{share} stop", fontsize=7, va="center", transform=ax.get_yaxis_transform())


def _explain(ax: Any) -> None:
    """Turn a panel into the legend of the others."""
    ax.axis("off")
    bar = ax.plot([], [], color=QUIET, linewidth=7, alpha=0.5)[0]
    median = ax.plot([], [], color="black", linestyle="none", marker="|", markersize=11, markeredgewidth=2)[0]
    case = ax.plot([], [], **CASE)[0]
    ax.legend([bar, median, case], ["nine tenths of the starts", "median", "start of the case"], loc="center", labelspacing=0.8)


def draw_winners(first: Any, titles: dict[str, str], folder: Path) -> Path:
    """Draw the fraction of the starts from which each method has the smallest error: one bar for each motion and cost."""
    figure, axes = grid_of_axes(1, 1, 4.6, x="fraction of the starts from which the method has the smallest energy error  [%]")
    ax, y, ticks = axes[0, 0], 0.0, {}
    for key, title in titles.items():
        ticks[y + 1] = title
        for row in first[first["motion"] == key].to_dict("records"):
            bar(ax, y, [(100 * row[method], COLOR[method], _hatch(method)) for method in METHODS])
            if row["own"]:
                mark_case(ax, row, METHODS, row["own"], y, 1.2)
            y += 1
        y += 0.7
    _finish(figure, ax, ticks, [(name_of(method), COLOR[method], _hatch(method)) for method in METHODS], "start of the case")
    return save(figure, folder, "winners", first)


def mark_case(ax: Any, row: Any, keys: Sequence[str], key: str, y: float, margin: float) -> None:
    """Mark the start of the case in the middle of its part of a bar."""
    left = 100 * sum(row[other] for other in keys[: keys.index(key)])
    ax.plot(min(100 - margin, max(margin, left + 50 * row[key])), y, **CASE)


def _hatch(method: str) -> str:
    """Return the hatch by which a composition differs from its scheme, whose colour it has."""
    return HATCHES.get(method.partition("/")[2], "")


def bar(ax: Any, y: float, parts: list[tuple[float, str, str]]) -> None:
    """Draw a bar of parts, each a length, a colour and a hatch."""
    left = 0.0
    for length, color, hatch in parts:
        ax.barh(y, length, left=left, height=0.82, facecolor=color, edgecolor="white", hatch=hatch, linewidth=0)
        left += length


def _finish(figure: Any, ax: Any, ticks: dict[float, str], colors: list[tuple[str, str, str]], mark: str) -> None:
    ax.set(yticks=list(ticks), yticklabels=ticks.values(), xlim=(0, 100))
    ax.invert_yaxis()
    ax.grid(visible=False)
    ax.tick_params(axis="y", length=0)
    legend(figure, colors, mark, loc="outside lower center", ncols=len(FRACTIONS))


def legend(place: Any, colors: list[tuple[str, str, str]], mark: str, **settings: Any) -> None:
    """Draw the legend of the parts of bars, and of the mark of the case."""
    handles: list[Any] = [Patch(facecolor=color, edgecolor="white", hatch=hatch, linewidth=0, label=name) for name, color, hatch in colors]
    handles.append(Line2D([], [], **CASE, label=mark))
    place.legend(handles=handles, **settings)


def thumbnail(axis: Any, conclusions: SimpleNamespace) -> None:
    """Draw the errors of the first motion from all its starts."""
    sizes, (key, title) = conclusions.sizes, next(iter(conclusions.titles.items()))
    _errors(axis, part(sizes, price=MIDDLE, motion=key))
    axis.minorticks_off()
    axis.set_title(f"energy error, {conclusions.starts} starts: {title}", loc="right", fontsize=7)
