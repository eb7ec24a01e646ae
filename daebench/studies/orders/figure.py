"""The picture of an order study: error against step size in both logarithms, a panel for each component."""

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from daebench.draw.figures import QUIET, Stroke, drawing, grid_of_axes, legend_below
from daebench.draw.methods import name_of, strokes_of
from daebench.studies.orders.series import Series
from daebench.systems.lazily import matplotlib as mpl

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from daebench.studies.orders.study import Orders

COLUMNS = 3
PANEL_HEIGHT = 2.45
LEGEND_HEIGHT = 0.22
NAMES = 4
"""Names in a row of the legend."""

SIZE = 3.6
"""Size of a marker, pt."""

FAILED = (0.98, 0.93, 0.88, 0.83)
"""Heights of the crosses for failed runs, as parts of the panel's, by method in turn."""

DROPPED: dict[str, Any] = {"marker": "o", "markersize": SIZE, "markerfacecolor": "none", "markeredgecolor": QUIET}
SLOPE: dict[str, Any] = {"color": QUIET, "linewidth": 0.8}


def figure(study: "Orders") -> "Figure":
    """Return the picture of an order study.

    Points that were used are filled and joined by the fitted line; those that were dropped are open and grey, and step sizes at
    which a run failed are crosses at the top. The thin grey lines have the slopes that are claimed, or the nearest whole ones.
    """
    components = list(dict.fromkeys(series.component for series in study.series))
    strokes = strokes_of(series.method for series in study.series)
    columns = min(COLUMNS, len(components))
    rows = math.ceil(len(components) / columns)
    with drawing():
        height = PANEL_HEIGHT * rows + LEGEND_HEIGHT * math.ceil((len(strokes) + 3) / NAMES) + 0.3
        drawn, axes = grid_of_axes(rows, columns, height, sharex=True)
        for axis, component in zip(axes.flat, components, strict=False):
            _panel(axis, [series for series in study.series if series.component == component], strokes)
            axis.set_ylabel(f"error in {component}")
        for axis in axes.flat[len(components) :]:
            axis.set_visible(False)
        for axis in axes.T.flat:
            _label_lowest(axis, axes, len(components))
        drawn.suptitle(f"{study.ivp.problem}, case {study.ivp.case}, T = {study.t_end:g}", x=0.01, ha="left", fontsize=9.5)
        legend_below(drawn, axes[0, 0], NAMES, handles=_keys(strokes))
    return drawn


def _label_lowest(axis: Any, axes: Any, count: int) -> None:
    """Give the lowest visible panel of each column its numbers and label of h."""
    place = int(np.flatnonzero([other is axis for other in axes.flat])[0])
    if place < count <= place + axes.shape[1]:
        axis.set_xlabel("step size h")
        axis.tick_params(labelbottom=True)


def _keys(strokes: Mapping[str, Stroke]) -> list[Any]:
    methods = [mpl.lines.Line2D([], [], label=name_of(name), **_filled(stroke), **stroke.line()) for name, stroke in strokes.items()]
    line = mpl.lines.Line2D
    failed = line([], [], label="run failed", linestyle="none", marker="x", markersize=SIZE, color=QUIET)
    return [
        *methods,
        mpl.lines.Line2D([], [], label="not used", linestyle="none", **DROPPED),
        failed,
        mpl.lines.Line2D([], [], label="slope", **SLOPE),
    ]


def _filled(stroke: Stroke) -> dict[str, Any]:
    return {"marker": stroke.marker, "markersize": SIZE, "markerfacecolor": stroke.color, "markeredgecolor": stroke.color}


def _panel(axis: Any, series: Sequence[Series], strokes: Mapping[str, Stroke]) -> None:
    axis.set_xscale("log")
    axis.set_yscale("log")
    for curve in series:
        _curve(axis, curve, strokes[curve.method], FAILED[list(strokes).index(curve.method) % len(FAILED)])
    slopes: dict[int, Series] = {}
    for curve in series:
        if any(curve.fit.used):
            slopes.setdefault(curve.claimed or max(1, round(curve.fit.slope)), curve)
    for slope, curve in sorted(slopes.items()):
        _reference(axis, curve, slope)
    _at_least_two_decades(axis)


def _curve(axis: Any, series: Series, stroke: Stroke, height: float) -> None:
    h, error = np.array([point.h for point in series.points]), np.array(series.errors)
    used, failed = np.array(series.fit.used), ~np.isfinite(error)
    dropped = ~used & (error > 0)
    axis.plot(h[dropped], error[dropped], zorder=2, linestyle="none", **DROPPED | {"marker": stroke.marker})
    at_top = {"marker": "x", "color": stroke.color, "transform": axis.get_xaxis_transform()}
    axis.plot(h[failed], np.full(np.sum(failed), height), linestyle="none", markersize=SIZE, **at_top)
    if np.any(used):
        axis.plot(h[used], error[used], linestyle="none", zorder=4, **_filled(stroke))
        x, y = np.log(h[used]), np.log(error[used])
        axis.plot(h[used], np.exp(np.mean(y) + series.fit.slope * (x - np.mean(x))), zorder=3, **stroke.line())


def _reference(axis: Any, series: Series, slope: int) -> None:
    """Draw a slope a factor of 4 below the points that were used, and write it beside its middle."""
    used = np.array(series.fit.used)
    h, error = np.array([point.h for point in series.points])[used], np.array(series.errors)[used]
    top = int(np.argmax(h))
    x = h[top] * (np.min(h) / h[top]) ** np.array([0.0, 0.5, 1.0])
    y = error[top] / 4 * (x / x[0]) ** slope
    axis.plot(x, y, zorder=1, **SLOPE)
    beside = {"xytext": (3, -1), "textcoords": "offset points", "ha": "left", "va": "top", "fontsize": 8}
    axis.annotate(str(slope), (x[1], y[1]), color=QUIET, **beside)


def _at_least_two_decades(axis: Any) -> None:
    """Widen a narrow range of errors to two decades, so that ticks are powers of ten."""
    low, high = axis.get_ylim()
    if high < 30 * low:
        middle = math.sqrt(low * high)
        axis.set_ylim(middle / 10, middle * 10)
