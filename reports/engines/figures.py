"""The picture of the report on engines: error at the end against seconds of stepping, one panel per motion."""

from dataclasses import replace
from pathlib import Path
from textwrap import fill
from typing import Any

import pandas as pd

from daebench.draw.figures import BLACK, QUIET, STROKES, drawing, grid_of_axes, save
from daebench.pages.report.thumbnail import draw_thumbnail
from daebench.reports.engines.adapters import ENGINES
from daebench.reports.engines.motions import BY_KEY
from daebench.reports.engines.numbers import OWN, RATTLE, Numbers

COLUMNS = 3
"""Panels side by side."""

TITLE = 26
"""Largest number of letters in a line of a panel's title."""

BROWN = "#7a5230"
"""Colour of the engine whose colour would be black, the colour of daebench's own curves."""

STYLES = {
    engine.name: replace(stroke, color=BROWN) if stroke.color == BLACK else stroke for engine, stroke in zip(ENGINES, STROKES, strict=False)
}
"""Colours and marks of engines."""


def draw(numbers: Numbers, folder: Path) -> dict[str, Path]:
    """Draw errors against seconds into a folder; return the path of the SVG file by stem, none if no engine ran."""
    if not numbers.engines:
        return {}
    runs = numbers.runs[numbers.runs["failure"] == ""]
    motions = list(dict.fromkeys(runs["motion"]))
    rows = -(-len(motions) // COLUMNS)
    with drawing():
        figure, axes = grid_of_axes(rows, COLUMNS, 1.0 + 2.2 * rows, x="seconds of stepping", y="error at $t$ = 10")
        for axis in axes.flat[len(motions) :]:
            axis.set_axis_off()
        for axis, key in zip(axes.flat, motions, strict=False):
            panel(axis, runs[runs["motion"] == key])
            axis.set_title(fill(BY_KEY[key].title, TITLE))
            axis.axvline(BY_KEY[key].budget, color=QUIET, linewidth=0.8, linestyle=":")
        handles = {label: handle for axis in axes.flat for handle, label in zip(*axis.get_legend_handles_labels(), strict=True)}
        figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=5)
        path = save(figure, folder, "cost", runs)
    draw_thumbnail(folder, lambda axis: thumbnail(axis, runs))
    return {"cost": path}


def thumbnail(axis: Any, runs: pd.DataFrame) -> None:
    """Draw the first motion as in the large picture, without a legend."""
    key = str(runs["motion"].iloc[0])
    panel(axis, runs[runs["motion"] == key])
    axis.minorticks_off()
    axis.set_title(f"error against time: {BY_KEY[key].title}", loc="right", fontsize=7)
    axis.set_xlabel("seconds of stepping; black: daebench", loc="right")


def panel(axis: Any, runs: pd.DataFrame) -> None:
    """Draw the contenders of a motion: engines in their colours, daebench's RATTLE full and its IDA dashed in black."""
    for (engine, setting), curve in runs.groupby(["engine", "setting"], sort=False):
        points = curve.sort_values("seconds")
        if engine == OWN:
            look = {"color": BLACK, "linestyle": "-" if setting == RATTLE else "--", "linewidth": 1.8, "zorder": 5}
            label = f"daebench, {setting}"
        else:
            stroke = STYLES[str(engine)]
            tied = bool(curve["constrained"].iloc[0])
            look = stroke.points() | {"linestyle": "-" if tied else ":", "linewidth": 0.9, "markersize": 3.2}
            label = str(engine)
        axis.plot(points["seconds"], points["error"], label=label, **look)
    axis.set(xscale="log", yscale="log")
