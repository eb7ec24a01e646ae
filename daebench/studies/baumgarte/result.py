"""Maps of stabilised constraints over damping, stiffness and step: what they show, and their picture."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from daebench.diagnostics.drift import Drift
from daebench.draw.figures import BLACK, QUIET, curve, drawing, grid_of_axes, legend_below
from daebench.draw.tiles import edges
from daebench.runs.ivp import Array, ConstrainedIvp
from daebench.runs.result import Result, Table
from daebench.studies.baumgarte.cells import (
    IMPEDANCE,
    SLOWEST,
    Cell,
    contraction,
    frame,
    grid,
    growth,
)
from daebench.systems.lazily import matplotlib

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

USUAL = 10.0
"""alpha and beta that ``baumgarte`` has where none are given, 1/s."""


@dataclass(frozen=True)
class Limit:
    """Where a scheme becomes unstable on a ray beta = ratio alpha.

    Parameters
    ----------
    scheme : str
        Name of the scheme.
    ratio : float
        beta over alpha.
    predicted, measured : float
        alpha h there, by the roots of s^2 + 2 alpha s + beta^2, and by runs; infinite where there is none.
    by : str
        "growth": g grows, or "iteration": the stages are no longer found in the iterations that there are.
    """

    scheme: str
    ratio: float
    predicted: float
    measured: float
    by: str


@dataclass(frozen=True)
class Effect:
    """Effect of the usual stabilisation on the energy of a run.

    Parameters
    ----------
    scheme : str
        Name of the scheme.
    without, usual : Cell
        The runs without stabilisation, and with alpha = beta = 10/s.
    drift_without, drift_usual : Drift
        Verdicts on their energies.
    least, most : Cell
        The runs of the map with the least and the largest energy error, among those that the prediction calls stable.
    """

    scheme: str
    without: Cell
    usual: Cell
    drift_without: Drift
    drift_usual: Drift
    least: Cell
    most: Cell

    @property
    def ratio(self) -> float:
        """Energy error with the usual stabilisation over that without."""
        return self.usual.energy / self.without.energy if self.without.energy > 0 else float("nan")


@dataclass(frozen=True)
class BaumgarteMap(Result):
    """Maps of stabilised constraints over their parameters.

    Parameters
    ----------
    ivp : ConstrainedIvp
        The problem.
    h, t_end : float
        Step size and end of the runs, s.
    maps : mapping of str to list of Cell
        Runs over alpha h (slowest) and beta h by method, such as "baumgarte:rk4" and "soft:rk4".
    penalty : list of Cell
        Runs on the penalised system over h times its fastest frequency.
    tolerant : mapping of float to list of Cell
        Runs of ``ida:baumgarte`` over alpha and beta, 1/s, by tolerance.
    effects : sequence of Effect
        Effect of the usual stabilisation on the energy, by scheme.
    limits : sequence of Limit
        Limits of stability.
    beside : sequence of Cell
        Methods that have no alpha and beta, with the same step.
    """

    stem: ClassVar[str] = "baumgarte"

    ivp: ConstrainedIvp
    h: float
    t_end: float
    maps: Mapping[str, Sequence[Cell]]
    penalty: Sequence[Cell]
    tolerant: Mapping[float, Sequence[Cell]]
    effects: Sequence[Effect]
    limits: Sequence[Limit]
    beside: Sequence[Cell] = field(default_factory=tuple)

    @property
    def answer(self) -> str:
        """Whether the stabilisation affects the energy, in three sentences."""
        first = self.effects[0]
        exact = "On the exact motion G v = 0, and the forces of the stabilisation do no work."
        of = f"With {first.scheme}, h = {self.h:g} s, to t = {self.t_end:g} s"
        numbers = f"the energy error is {first.without.energy:.2g} without it and {first.usual.energy:.2g} with alpha = beta = {USUAL:g}/s"
        over = f"over the stable part of the map it goes from {first.least.energy:.2g} to {first.most.energy:.2g}"
        velocities = f"|G v| is {first.without.Gv:.2g} without it and {first.usual.Gv:.2g} with it, where its forces do work"
        return f"{exact} {of}, {numbers}; {over}. {velocities[0].upper()}{velocities[1:]}."

    @property
    def table(self) -> "pd.DataFrame":
        """All runs, one row each."""
        return frame(
            [*(one for cells in (*self.maps.values(), self.penalty, *self.tolerant.values()) for one in cells), *self.beside], self.h
        )

    def summary(self) -> dict[str, Any]:
        """Return effects, limits and the best of each map, for JSON."""
        about = {**self.posed, "h": self.h, "t_end": self.t_end}
        limits = [{key: None if value == float("inf") else value for key, value in vars(one).items()} for one in self.limits]
        return about | {
            "answer": self.answer,
            "effects": [_effect(one) for one in self.effects],
            "limits": limits,
            "beside": [_cell(one) for one in self.beside],
            "tolerances": {
                f"{tol:g}": {"least": _cell(least(cells)), "cheapest": _cell(_cheapest(cells))} for tol, cells in self.tolerant.items()
            },
            "penalty": _cell(least(self.penalty)),
        }

    def plot(self) -> "Figure":
        """Return the maps."""
        return figure(self)

    def printed(self) -> Iterator[str | Table]:
        """Yield the answer, the effects with methods beside them, and the limits of stability."""
        yield self.answer
        rows = []
        for effect in self.effects:
            rows += [
                _row(effect.scheme, "none", effect.without, effect.drift_without.verdict),
                _row("", _options(effect.usual), effect.usual, effect.drift_usual.verdict),
                _row("", _options(effect.least), effect.least, "least energy error"),
                _row("", _options(effect.most), effect.most, "most, where stable"),
            ]
        rows += [_row(one.method, "", one, "") for one in self.beside]
        yield Table(["method", "alpha, beta 1/s", "energy error", "|g|", "|G v|", "work", "energy"], rows)
        limits = [[one.scheme, f"{one.ratio:g}", _bounded(one.predicted), _bounded(one.measured), one.by or "none"] for one in self.limits]
        yield Table(["method", "beta / alpha", "limit of alpha h, predicted", "measured", "by"], limits)


def _options(one: Cell) -> str:
    return ", ".join(f"{x:.3g}" for x in one.options.values())


def _bounded(x: float) -> str:
    return "none" if x == float("inf") else f"{x:.4g}"


def _row(method: str, options: str, one: Cell, note: str) -> list[str]:
    return [method, options, *(f"{x:.2g}" for x in (one.energy, one.g, one.Gv)), str(one.work), note]


def _cell(one: Cell) -> dict[str, Any]:
    numbers = {"energy_error": one.energy, "g": one.g, "Gv": one.Gv}
    finite = {key: value if np.isfinite(value) else None for key, value in numbers.items()}
    about = {"method": one.method, "value": one.value, "options": dict(one.options)}
    return about | finite | {"evaluations": one.work, "failure": one.failure}


def _effect(one: Effect) -> dict[str, Any]:
    cells = {name: _cell(getattr(one, name)) for name in ("without", "usual", "least", "most")}
    drifts = {"verdict_without": one.drift_without.verdict, "verdict_usual": one.drift_usual.verdict}
    return {"scheme": one.scheme, "ratio": one.ratio if np.isfinite(one.ratio) else None} | cells | drifts


def least(cells: Sequence[Cell]) -> Cell:
    """Return the cell of the least energy error."""
    return min(cells, key=lambda one: one.energy)


def _cheapest(cells: Sequence[Cell]) -> Cell:
    return min((one for one in cells if not one.failure), key=lambda one: one.work, default=cells[0])


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
    positive = numbers[np.isfinite(numbers) & (numbers > 0)]
    high = float(positive.max()) if positive.size else 1.0
    low = max(float(positive.min()) if positive.size else 0.1, high * 10.0**-DECADES)
    axis.set_facecolor("#bdbdbd")
    sides = edges(values)
    norm = matplotlib.colors.LogNorm(low, high if high > low else 10 * low)
    drawn = axis.pcolormesh(sides, sides, np.clip(numbers, low, None).T, norm=norm, cmap="viridis_r", rasterized=True)
    bar = figure.colorbar(drawn, ax=axis, fraction=0.05, pad=0.02)
    if high > 10 * low:
        bar.ax.yaxis.set_minor_formatter(matplotlib.ticker.NullFormatter())
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
