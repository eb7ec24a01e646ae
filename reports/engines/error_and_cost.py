"""The pictures of the report on engines: errors at equal cost, and errors against seconds of stepping, one panel per motion."""

from dataclasses import replace
from pathlib import Path
from textwrap import fill
from typing import Any

import pandas as pd

from daebench.draw.figures import BLACK, QUIET, STROKES, grid_of_axes, legend_below, save
from daebench.reports.engines.adapters import ENGINES
from daebench.reports.engines.measured import IDA, KAHAN, OWN, RATTLE
from daebench.reports.engines.motions import BY_KEY, MOTIONS

COLUMNS = 3
"""Panels side by side."""

TITLE = 26
"""Largest number of letters in a line of a panel's title."""

DASHES = {RATTLE: "-", IDA: "--", KAHAN: "-."}
"""Dashes of daebench's own methods."""

BROWN = "#7a5230"
"""Colour of the engine whose colour would be black, the colour of daebench's own curves."""

STYLES = {
    engine.name: replace(stroke, color=BROWN) if stroke.color == BLACK else stroke for engine, stroke in zip(ENGINES, STROKES, strict=False)
}
"""Colours and marks of engines."""


def draw_cost(runs: pd.DataFrame, folder: Path) -> Path:
    """Draw errors against seconds, a panel for each motion."""
    runs = runs[runs["failure"] == ""]
    motions = list(dict.fromkeys(runs["motion"]))
    rows = -(-len(motions) // COLUMNS)
    figure, axes = grid_of_axes(rows, COLUMNS, 1.0 + 2.2 * rows, x="seconds of stepping", y="error at $t$ = 10")
    for axis in axes.flat[len(motions) :]:
        axis.set_axis_off()
    for axis, key in zip(axes.flat, motions, strict=False):
        panel(axis, runs[runs["motion"] == key])
        axis.set_title(fill(BY_KEY[key].title, TITLE))
        axis.axvline(BY_KEY[key].budget, color=QUIET, linewidth=0.8, linestyle=":")
    handles = {label: handle for axis in axes.flat for handle, label in zip(*axis.get_legend_handles_labels(), strict=True)}
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=5)
    return save(figure, folder, "cost", runs)


def draw_answer(best: pd.DataFrame, folder: Path) -> Path:
    """Draw errors at equal cost, a row for each motion."""
    figure, axes = grid_of_axes(1, 1, 1.1 + 0.42 * best["motion"].nunique(), x="error at $t$ = 10 within the same CPU time")
    equal_cost(axes[0, 0], best)
    legend_below(figure, axes[0, 0], 4)
    return save(figure, folder, "answer", best)


def most_accurate(chosen: pd.DataFrame) -> pd.DataFrame:
    """Return the most accurate run within the budget of each engine on each motion, with constraints and without, and that of RATTLE."""
    within = chosen[(chosen["failure"] == "") & chosen["within"] & ((chosen["engine"] != OWN) | (chosen["setting"] == RATTLE))]
    best: pd.DataFrame = within.loc[within.groupby(["motion", "engine", "constrained"], sort=False)["error"].idxmin()]
    return best[["motion", "engine", "setting", "variant", "constrained", "knob", "value", "error", "seconds"]]


def equal_cost(axis: Any, best: pd.DataFrame) -> None:
    """Draw a row for each motion: RATTLE as a black bar, and a mark for each engine, filled where it has constraints."""
    motions = [motion.key for motion in MOTIONS if motion.key in set(best["motion"])]
    rows = {key: k for k, key in enumerate(motions)}
    ours = best[best["engine"] == OWN]
    bar = {"marker": "|", "s": 260, "linewidths": 2.4, "color": BLACK}
    axis.scatter(ours["error"], ours["motion"].map(rows), label="RATTLE of daebench", zorder=4, **bar)
    for engine, stroke in STYLES.items():
        marks = best[best["engine"] == engine]
        for tied, part in marks.groupby("constrained"):
            face = stroke.color if tied else "none"
            settings = {"marker": stroke.marker, "facecolors": face, "edgecolors": stroke.color, "s": 30}
            axis.scatter(part["error"], part["motion"].map(rows), label="_", zorder=3, **settings)
        if len(marks):
            axis.scatter([], [], marker=stroke.marker, color=stroke.color, s=30, label=engine)
    axis.scatter([], [], marker="o", facecolors="none", edgecolors=QUIET, s=30, label="open: no constraints")
    axis.set_xscale("log")
    axis.set_yticks(range(len(motions)), [BY_KEY[key].title for key in motions])
    axis.set_ylim(len(motions) - 0.5, -0.5)


def thumbnail(axis: Any, best: pd.DataFrame) -> None:
    """Draw the errors at equal cost without a legend."""
    equal_cost(axis, best)
    axis.minorticks_off()
    axis.tick_params(axis="y", labelsize=6)
    axis.set_title("error at equal cost; bar: RATTLE of daebench", loc="right", fontsize=7)


def panel(axis: Any, runs: pd.DataFrame) -> None:
    """Draw the contenders of a motion: engines in their colours, methods of daebench in black, RATTLE full."""
    for (engine, setting), curve in runs.groupby(["engine", "setting"], sort=False):
        points = curve.sort_values("seconds")
        if engine == OWN:
            look = {"color": BLACK, "linestyle": DASHES[str(setting)], "linewidth": 1.8, "zorder": 5}
            label = f"daebench, {setting}"
        else:
            stroke = STYLES[str(engine)]
            tied = bool(curve["constrained"].iloc[0])
            look = stroke.points() | {"linestyle": "-" if tied else ":", "linewidth": 0.9, "markersize": 3.2}
            label = str(engine)
        axis.plot(points["seconds"], points["error"], label=label, **look)
    axis.set(xscale="log", yscale="log")
