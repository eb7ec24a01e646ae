"""The picture of a work-precision study over many starts: bands of errors against time, and in words which method is the cheapest."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from textwrap import fill as wrapped
from typing import Any

import numpy as np

from daebench.draw.bands import LEVELS, column, fill
from daebench.draw.figures import QUIET, drawing, grid_of_axes, save
from daebench.draw.methods import short_name_of, strokes_of
from daebench.errors import DaebenchError
from daebench.studies.work_precision.figure import COSTS, HIGHEST, MARGIN, OTHERS
from daebench.studies.work_precision.starts import Curves
from daebench.systems.lazily import pandas as pd

ROOM = 15.0
"""Factor between the largest time and the frame, for the legend."""

LETTERS = 125
"""Letters of a line of the title."""


def bands(curves: Sequence[Curves]) -> "pd.DataFrame":
    """Return quantiles of errors over starts, a row each of method and step size or tolerance.

    Columns are method, knob, value, starts, failed, the number of runs that stopped early, whose errors count as infinite; seconds, the
    median; q05 to q95, errors of which each is at least the bound of its reference; and reference and reference_q95, the median of these
    bounds and their quantile.
    """
    rows = []
    for some in curves:
        reference, high = np.quantile(some.bound, (0.5, 0.95), method="inverted_cdf")
        for k, value in enumerate(some.values):
            spent = some.seconds[k][np.isfinite(some.seconds[k])]
            row = {"method": some.method, "knob": some.knob, "value": value, "starts": some.starts, "failed": some.failed[k]}
            row |= {"seconds": np.median(spent) if len(spent) else np.nan}
            levels = np.quantile(some.errors[k], LEVELS, method="inverted_cdf")
            row |= {column(level): x for level, x in zip(LEVELS, levels, strict=True)}
            rows.append(row | {"reference": reference, "reference_q95": high})
    return pd.DataFrame(rows)


def draw_bands(out: Path, table: "pd.DataFrame", families: Mapping[str, list[str]], label: str, title: Sequence[str], stem: str) -> Path:
    """Write ``STEM.svg``, PNG and CSV into a folder; return the path of the SVG.

    A panel has one family; bands are the middle 90 % and 50 % of starts, lines the medians, those of other families grey. The area in
    which the references of 5 % of the starts or more are no better is hatched, and the median of their errors dotted; a line ends there.
    """
    most = table.iloc[int(table["starts"].argmax())]
    floor, high = float(most["reference"]), float(most["reference_q95"])
    shown = table[(table["q50"] > table["reference"]) & np.isfinite(table["q50"]) & (table["seconds"] > 0)]
    if shown.empty:
        raise DaebenchError(f"there is nothing to draw: no method has an error above that of its reference, {floor:.1e}, and a time.")
    columns = min(2, len(families))
    rows = -(-len(families) // columns)
    with drawing():
        shared: Any = {"sharex": True, "sharey": True}
        height = 0.8 + 0.2 * len(title) + 2.9 * rows
        figure, axes = grid_of_axes(rows, columns, height, x=COSTS["seconds"], y=label, **shared)
        for axis, (family, names) in zip(axes.flat, families.items(), strict=False):
            axis.set(xscale="log", yscale="log", title=family.replace("\n", " "))
            _panel(axis, shown, names)
        bottom = min(floor, float(shown["q05"].min())) / MARGIN
        axes[0, 0].set_xlim(right=ROOM * float(shown["seconds"].max()))
        axes[0, 0].set_ylim(bottom, min(HIGHEST, MARGIN * float(shown["q95"].max())))
        for axis in axes.flat[: len(families)]:
            if np.isfinite(high):
                axis.axhspan(bottom, high, facecolor="none", edgecolor=OTHERS, hatch="///", linewidth=0.0, zorder=0)
            axis.axhline(floor, color=QUIET, linestyle=":", linewidth=1.0, label="error of references")
            axis.tick_params(labelbottom=True)
            axis.legend(loc="upper right", fontsize=7, handlelength=2.0, labelspacing=0.25, borderaxespad=0.1)
        for axis in axes.flat[len(families) :]:
            axis.set_visible(False)
        figure.suptitle("\n".join(wrapped(sentence, LETTERS, subsequent_indent="   ") for sentence in title), fontsize=8, x=0.02, ha="left")
        return save(figure, out, stem, table)


def _panel(axis: Any, table: "pd.DataFrame", names: Sequence[str]) -> None:
    """Draw the bands of a family, and the medians of all others."""
    curves = {str(name): rows.sort_values("value", ascending=False) for name, rows in table.groupby("method", sort=False)}
    for name, rows in curves.items():
        if name not in names:
            axis.plot(rows["seconds"], rows["q50"], color=OTHERS, linewidth=0.7, zorder=1)
    strokes = strokes_of(curves)
    for name in (name for name in names if name in curves):
        rows, style = curves[name], strokes[name].points()
        errors = {level: rows[column(level)].clip(upper=HIGHEST * MARGIN) for level in LEVELS}
        fill(axis, rows["seconds"], errors.__getitem__, style["color"], zorder=2)
        fixed = (rows["knob"] == "h").all()
        label = f"{short_name_of(name)} ({rows['starts'].iloc[0]})"
        line = {"linestyle": "-" if fixed else (0, (4, 1.5)), "linewidth": 1.1, "markersize": 3.5}
        axis.plot(rows["seconds"], rows["q50"], label=label, zorder=3, **style | line)
