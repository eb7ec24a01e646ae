"""The picture of stabilised constraints: maps of errors over alpha h and beta h with the predicted limit, IDA, and a penalty."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from daebench.draw.figures import BLACK, QUIET, curve, drawing, grid_of_axes, legend_below
from daebench.draw.tiles import edges
from daebench.studies.baumgarte.cells import IMPEDANCE, Cell, grid
from daebench.studies.baumgarte.limits import SLOWEST, Array, contraction, growth
from daebench.studies.baumgarte.run import BaumgarteMap

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHOWN = {"energy": "energy error", "g": "largest |g|", "Gv": "largest |G v|"}
"""What is mapped, by the name of a number of a run."""

FINE = 160
"""Points of the curve of the limit in each direction."""

DECADES = 12
"""Decades of colour, down from the largest number that is shown."""

LARGEST = 1e2
"""Numbers above this are drawn as this: the motion is lost."""


def figure(result: BaumgarteMap) -> "Figure":
    """Return the picture of the maps."""
    tolerances = list(result.tolerant)
    rows = len(result.maps) + 1
    with drawing():
        drawn, axes = grid_of_axes(rows, len(SHOWN), 0.9 + 2.15 * rows)
        for row, (name, cells) in zip(axes, result.maps.items(), strict=False):
            _maps(drawn, list(row), result, name, cells)
        last = list(axes[-1])
        for axis in last[1:]:
            axis.set_visible(bool(tolerances))
        if tolerances:
            tol = tolerances[0]
            _tolerant(drawn, last[1], result.tolerant[tol], "energy", f"IDA, {tol:g}: energy error")
            _tolerant(drawn, last[2], result.tolerant[tol], "work", f"IDA, {tol:g}: residuals")
        _penalty(last[0], result)
        legend_below(drawn, last[0], 4)
        drawn.suptitle(title(result), fontsize="medium", x=0.02, ha="left")
    return drawn


def title(result: BaumgarteMap) -> str:
    """Return the answer in two lines."""
    first = result.effects[0]
    usual = f"{first.usual.energy:.1e} with alpha = beta = {first.usual.options['alpha']:g}/s"
    return (
        f"{result.ivp.problem}: energy error of {first.scheme} {first.without.energy:.1e} without damping, {usual}\n"
        f"h = {result.h:g} s, to t = {result.t_end:g} s. Lines: limits as predicted (dashed: of the iteration). Grey: no end."
    )


def _maps(figure: Any, axes: list[Any], result: BaumgarteMap, name: str, cells: Sequence[Cell]) -> None:
    """Draw errors of one method over alpha h and beta h."""
    form, _, scheme = name.partition(":")
    values = np.array(sorted({_place(one, form, result.h) for one in cells}))
    a, b = np.meshgrid(np.geomspace(values[0], values[-1], FINE), np.geomspace(values[0], values[-1], FINE), indexing="ij")
    for axis, (key, words) in zip(axes, SHOWN.items(), strict=True):
        numbers = grid(cells, key)
        _tiles(figure, axis, values, np.where(np.isfinite(numbers), np.minimum(numbers, LARGEST), np.nan))
        for limit, dashes in ((growth(scheme, a, b), "-"), (contraction(scheme, a, b) / SLOWEST, "--")):
            if limit.min() < 1 < limit.max():
                axis.contour(a, b, np.log(limit), levels=[1e-6], colors=[BLACK], linewidths=1.2, linestyles=dashes)
        axis.set(xlabel="alpha h", title=words)
    axes[0].set_ylabel(f"{name}\nbeta h")


def _place(one: Cell, form: str, h: float) -> float:
    """Return alpha h of a cell, rounded so that equal ones are equal."""
    alpha = one.options["alpha"] if form == "baumgarte" else one.options["damping"] * IMPEDANCE / 2
    return float(f"{alpha * h:.9g}")


def _tiles(figure: Any, axis: Any, values: Array, numbers: Array) -> None:
    """Draw numbers over two equal logarithmic axes, the first across; those that are not finite stay grey."""
    from matplotlib.colors import LogNorm
    from matplotlib.ticker import NullFormatter

    positive = numbers[np.isfinite(numbers) & (numbers > 0)]
    high = float(positive.max()) if positive.size else 1.0
    low = max(float(positive.min()) if positive.size else 0.1, high * 10.0**-DECADES)
    axis.set_facecolor("#bdbdbd")
    sides = edges(values)
    norm = LogNorm(low, high if high > low else 10 * low)
    drawn = axis.pcolormesh(sides, sides, np.clip(numbers, low, None).T, norm=norm, cmap="viridis_r", rasterized=True)
    bar = figure.colorbar(drawn, ax=axis, fraction=0.05, pad=0.02)
    if high > 10 * low:
        bar.ax.yaxis.set_minor_formatter(NullFormatter())
    axis.set(xscale="log", yscale="log")
    axis.grid(visible=False)


def _tolerant(figure: Any, axis: Any, cells: Sequence[Cell], key: str, words: str) -> None:
    """Draw a number of IDA's runs over alpha and beta."""
    rates = np.array(sorted({one.options["alpha"] for one in cells}))
    numbers = np.where([[bool(one.failure) for one in cells]], np.nan, grid(cells, key).ravel()).reshape(len(rates), -1)
    _tiles(figure, axis, rates, numbers)
    axis.set(xlabel="alpha [1/s]", ylabel="beta [1/s]", title=words)


def _penalty(axis: Any, result: BaumgarteMap) -> None:
    """Draw the errors of a penalty, over h times its fastest frequency."""
    scheme = result.penalty[0].method.partition(":")[2]
    stiffest = max(one.options["eps"] for one in result.penalty)
    least = min(_place(one, "baumgarte", result.h) for one in next(iter(result.maps.values())))
    x = [stiffest * least / one.options["eps"] for one in result.penalty]
    for k, (key, words) in enumerate(SHOWN.items()):
        y = np.clip([getattr(one, key) for one in result.penalty], None, LARGEST)
        axis.plot(x, y, label=words, **curve(k))
    axis.axhline(result.effects[0].without.energy, color=QUIET, linewidth=0.8, linestyle="--", label=f"energy error of {scheme} on (1.18)")
    axis.set(xscale="log", yscale="log", xlabel="h times the fastest frequency", title=f"a penalty, stiff:{scheme}")
