"""Outcomes of runs over step size and a parameter: the size of energy errors, their drift, and how methods break."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from daebench.draw.figures import BLUE, QUIET, drawing, grid_of_axes, save
from daebench.draw.methods import name_of
from daebench.draw.tiles import edges, fill, hatch
from daebench.methods.names import method_of
from daebench.studies.grid.outcomes import ALL, FINE, LARGE, OUTCOMES, SIZED, parameter_table
from daebench.studies.grid.rows import by_method
from daebench.studies.grid.run_specification import ParameterRuns
from daebench.studies.grid.runs import Runs
from daebench.studies.grid.runs_together import made_together
from daebench.studies.stability.extreme import Asked
from daebench.systems.lazily import matplotlib as mpl

if TYPE_CHECKING:
    import pandas as pd

FEWEST_STEPS, MOST_STEPS = 16, 2048
"""Steps of the runs, where no step sizes are given: from too few to see a drift on."""

RANGE = 100.0
"""The parameter goes from one part in so many of its own value to so many times that, where no values are given."""

SIDE = 256
"""Step sizes, and values of the parameter, of a map whose runs are made together, as members of ensembles."""

FEW_STEPS, FEW_VALUES = 15, 17
"""The same of a map whose runs are made one by one."""

FIRST = ("gravity", "strength", "stiffness")
"""Parameters that are varied rather than others."""

METHODS = 6
"""Methods of the standard set that are mapped, for a picture that can be read."""

SIZES = (1e-8, 1e-6, 1e-4, 1e-2, LARGE, ALL)
"""Energy errors between which colours change, in parts of the mean kinetic energy."""

SIZE_COLOURS = ("#ffffe5", "#fff1b3", "#fed976", "#fe9929", "#d95f0e", "#993404", "#3d1700")
"""Colours of energy errors, from small to those that are larger than the kinetic energy."""

COLOURS = {
    "off the manifold": "#cc79a7",
    "wrong branch": "#0072b2",
    "no solution": "#56b4e9",
    "singular": "#009e73",
    "rank lost": "#767676",
    "blown up": "#000000",
    "stopped": "#ffffff",
}
"""Colour of each outcome that has no size."""

HATCHES = {"drifts": "/////", "undetermined": "....."}
"""Patterns of the verdicts on the energy; without one it is kept or bounded, or the run has no end on the manifold."""

WRITTEN = ["problem", "case", "method", "value", "parameter", "varied", "steps", "outcome", "size", "trend"]
"""Columns that are written beside the picture; the store has the others."""


def parameter_of(asked: Asked) -> str:
    """Return the parameter that is varied: the one that is given, one of :data:`FIRST`, or the first that is not zero; "" if none."""
    values = asked.ivp.parameters
    return next((name for name in (*asked.parameters, *(n for n in FIRST if values.get(n)), *(n for n in values if values[n]))), "")


def refusal(asked: Asked) -> str:
    """Return why a problem has no such extreme, as a sentence, or ""."""
    if not asked.fixed:
        return "none of these methods has fixed steps"
    if not parameter_of(asked):
        return f"{asked.problem} has no parameter that could be varied"
    given = asked.parameters.get(parameter_of(asked), (1.0,))
    if min(given) <= 0 or len(set(given)) < len(given) or len(set(asked.h)) < len(asked.h):
        return "its axes are logarithmic, and take values greater than 0, each once"
    return ""


def together(asked: Asked, method: str) -> bool:
    """Return whether the runs of a method are made together, as members of ensembles, so that there may be many."""
    return made_together(method_of(asked.ivp, method, anyway=asked.anyway), asked.ivp)


def _spaced(first: float, last: float, n: int) -> list[float]:
    values: list[float] = np.geomspace(first, last, n).tolist()
    return values


def specifications(asked: Asked) -> list[ParameterRuns]:
    """Return the runs, those with one step size in one piece where they are made together."""
    name = parameter_of(asked)
    metrics = ("energy", "manifold", "jump") if asked.ivp.on_manifold else ("energy",)
    pieces = []
    for method in asked.fixed if asked.methods else asked.fixed[:METHODS]:
        at_once = together(asked, method)
        across, up = (SIDE, SIDE) if at_once else (FEW_STEPS, FEW_VALUES)
        usual = asked.ivp.parameters[name]
        values = tuple(map(float, asked.parameters.get(name) or _spaced(usual / RANGE, usual * RANGE, up)))
        for h in asked.h or [asked.end / n for n in _spaced(FEWEST_STEPS, MOST_STEPS, across)]:
            for some in [values] if at_once else [(value,) for value in values]:
                fields = vars(asked.specification(method, h, metrics, outputs=int(asked.end / h + 1)))
                pieces.append(ParameterRuns(**fields, varied=name, values=some))
    return pieces


def measure(asked: Asked, runs: Runs) -> "pd.DataFrame":
    """Return one row a run, with its outcome, the size of its energy error and the trend of that."""
    return parameter_table(specifications(asked), runs)


def says(table: "pd.DataFrame") -> list[str]:
    """Return which part of the map is fine for each method, how large its energy errors are there, where they drift, and what else is."""
    sentences = []
    for method, rows in by_method(table):
        counts = rows["outcome"].value_counts()
        fine, worst = rows[rows["outcome"] == FINE], counts.drop(FINE, errors="ignore")
        drift = int((fine["trend"] == "drifts").sum())
        sized = f", with energy errors of {fine['size'].median():.1e} of the kinetic energy in the median; {drift} of them drift"
        most = f"; most of the others: {worst.index[0]} ({worst.iloc[0]})" if len(worst) else ""
        sentences.append(f"{method}: {len(fine)} of {len(rows)} runs are fine{sized if len(fine) else ''}{most}.")
    return sentences


def draw(out: Path, stem: str, table: "pd.DataFrame") -> Path:
    """Draw a map for each method, step size across and parameter up: colours say what became of runs, hatches where the energy drifts."""
    methods = by_method(table)
    columns = min(3, len(methods))
    lines = -(-len(methods) // columns)
    with drawing(), hatched():
        figure, axes = grid_of_axes(lines, columns, 1.3 + 2.15 * lines, sharex=True, sharey=True)
        for axis in axes.flat[len(methods) :]:
            axis.set_visible(False)
        for axis, (method, rows) in zip(axes.flat, methods, strict=False):
            _map(axis, method, rows)
        for axis in axes[:, 0]:
            axis.set_ylabel(str(table["parameter"].iloc[0]))
        for axis in axes[-1]:
            axis.set_xlabel("step size h [s]")
        _legends(figure, table)
        return save(figure, out, stem, table[WRITTEN])


def hatched() -> Any:
    """Return the settings under which hatches are fine lines."""
    return mpl.rc_context({"hatch.linewidth": 0.35})


def _map(axis: Any, method: str, rows: "pd.DataFrame") -> None:
    """Draw the map of a method."""
    grid = {name: rows.pivot(index="varied", columns="value", values=name) for name in ("outcome", "size", "trend")}
    across, up = (edges(axis.to_numpy(dtype=float)) for axis in (grid["outcome"].columns, grid["outcome"].index))
    words, sizes = grid["outcome"].to_numpy(dtype=object), grid["size"].to_numpy(dtype=float)
    others = {word: len(SIZE_COLOURS) + k for k, word in enumerate(COLOURS)}
    classes = np.where(np.isin(words, SIZED), np.searchsorted(SIZES, sizes, side="right"), _numbers(words, others))
    fill(axis, across, up, classes, [*SIZE_COLOURS, *COLOURS.values()])
    for trend, pattern in HATCHES.items():
        hatch(axis, across, up, grid["trend"].to_numpy(dtype=object) == trend, pattern, HATCH_COLOUR)
    few = "" if words.size >= SIDE**2 else f" ({words.shape[1]} x {words.shape[0]})"
    axis.set(xscale="log", yscale="log", title=f"{name_of(method)}{few}")
    axis.grid(visible=False)


HATCH_COLOUR = BLUE
"""Colour of hatches: it is seen on the lightest and on the darkest of the colours of sizes."""


def _numbers(words: NDArray[Any], numbers: Mapping[str, int]) -> NDArray[np.int64]:
    """Return the number of each word, -1 of one that has none."""
    return np.select([words == word for word in numbers], list(numbers.values()), -1).astype(np.int64)


def _legends(figure: Any, table: "pd.DataFrame") -> None:
    """Name the colours of outcomes and of trends, as far as they are there."""
    seen = [word for word in OUTCOMES if word in COLOURS and (table["outcome"] == word).any()]
    outcomes = [*zip(SIZE_COLOURS, _ranges(), strict=True), *((COLOURS[word], word) for word in seen)]
    settings: dict[str, Any] = {"handlelength": 1.4, "columnspacing": 1.2, "title_fontsize": 8.5}
    title = "colour: energy error / mean kinetic energy, or the outcome of the run"
    figure.legend(handles=_patches(outcomes), loc="outside upper center", ncols=5, title=title, **settings)
    trends = [(pattern, word) for word, pattern in HATCHES.items() if (table["trend"] == word).any()]
    if trends:
        handles = [
            mpl.patches.Patch(facecolor="none", edgecolor=HATCH_COLOUR, hatch=pattern, linewidth=0.5, label=word)
            for pattern, word in trends
        ]
        figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), title="hatch: trend of the energy error", **settings)


def _ranges() -> list[str]:
    """Return the ranges of the colours of energy errors."""
    powers = [f"$10^{{{round(np.log10(size))}}}$" if size < LARGE else f"{size:g}" for size in SIZES]
    return [f"below {powers[0]}", *(f"{a} to {b}" for a, b in pairwise(powers)), f"above {powers[-1]}: lost"]


def _patches(named: Sequence[tuple[str, str]]) -> list[Any]:
    return [mpl.patches.Patch(facecolor=colour, edgecolor=QUIET, linewidth=0.5, label=label) for colour, label in named]
