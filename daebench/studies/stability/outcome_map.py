"""What becomes of runs over step size and a parameter: how large their energy errors are, where they drift, and how methods break."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from daebench.draw.figures import drawing, grid_of_axes, save
from daebench.studies.grid.outcomes import ALL, FINE, OUTCOMES, SIZED, varied_runs
from daebench.studies.grid.rows import by_method
from daebench.studies.grid.run_specification import GridRun
from daebench.studies.grid.runs import Runs
from daebench.studies.stability.extreme import Asked

if TYPE_CHECKING:
    import pandas as pd

STEPS = tuple(2.0 ** (k / 2) for k in range(8, 23))
"""Steps of the runs, where no step sizes are given: from 16 on, too few to see a drift, to 2048."""

FACTORS = tuple(10.0 ** (k / 4) for k in range(-8, 9))
"""Factors of the parameter's own value, where none are given."""

FIRST = ("gravity", "strength", "stiffness")
"""Parameters that are varied rather than others."""

METHODS = 6
"""Methods of the standard set that are mapped, for a picture that can be read."""

SMALLEST = 1e-8
"""Energy errors below this are drawn alike, as those above all of the kinetic energy are."""

SIZES, LOST_COLOUR = "YlOrBr", "#3d1700"
"""Colours of energy errors, from small to large, and of those that are larger than the kinetic energy."""

DARK = 1e-2
"""Energy error from which on its colour is so dark that letters are white."""

TRENDS = {"drifts": "d", "undetermined": "?"}
"""Letters of the verdicts on the energy of runs that came to their end; what is kept or bounded has none."""

LETTERS = {
    "off the manifold": ("#cc79a7", "m"),
    "wrong branch": ("#0072b2", "w"),
    "no solution": ("#56b4e9", "n"),
    "singular": ("#009e73", "s"),
    "rank lost": ("#767676", "r"),
    "blown up": ("#000000", "b"),
    "stopped": ("#ffffff", "x"),
}
"""Colour and letter of each outcome that has no size."""


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
    given = asked.parameters.get(parameter_of(asked), FACTORS)
    if min(given) <= 0 or len(set(given)) < len(given) or len(set(asked.h)) < len(asked.h):
        return "its axes are logarithmic, and take values greater than 0, each once"
    return ""


def specifications(asked: Asked) -> list[GridRun]:
    """Return the runs."""
    name = parameter_of(asked)
    values = asked.parameters.get(name) or [asked.ivp.parameters[name] * factor for factor in FACTORS]
    steps = asked.h or [asked.end / n for n in STEPS]
    metrics = ("energy",) if asked.poisson else ("energy", "manifold", "jump")
    return [
        asked.specification(method, h, metrics, parameters=((name, float(value)),), outputs=int(asked.end / h + 1))
        for method in (asked.fixed if asked.methods else asked.fixed[:METHODS])
        for value in values
        for h in steps
    ]


def measure(asked: Asked, runs: Runs) -> "pd.DataFrame":
    """Return one row a run, with the columns "outcome", "size" and "trend"."""
    return varied_runs(specifications(asked), parameter_of(asked), runs)


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
    """Draw a map for each method, step size across and parameter up: colours are sizes of the energy error, letters its trend."""
    methods = list(dict.fromkeys(table["method"]))
    columns = min(3, len(methods))
    lines = -(-len(methods) // columns)
    with drawing():
        figure, axes = grid_of_axes(lines, columns, 1.1 + 2.1 * lines, sharex=True, sharey=True)
        for k, axis in enumerate(axes.flat):
            if k < len(methods):
                tiles = _map(axis, table[table["method"] == methods[k]], methods[k])
            else:
                axis.set_visible(False)
        for axis in axes[-1]:
            axis.set_xlabel("step size h [s]")
        for axis in axes[:, 0]:
            axis.set_ylabel(str(table["parameter"].iloc[0]))
        bar = figure.colorbar(tiles, ax=axes, label="energy error / mean kinetic energy", extend="both", aspect=30, pad=0.01)
        bar.solids.set(rasterized=False, edgecolor="face")  # type: ignore[union-attr]  # an image would be data: in a page
        figure.legend(handles=_patches(table), loc="outside lower center", ncols=4, handlelength=1.2)
        return save(figure, out, stem, table)


def _patches(table: "pd.DataFrame") -> list[Any]:
    """Return the keys of the trends, and of the outcomes that have no size, as far as they are there."""
    from matplotlib.patches import Patch

    grey: dict[str, Any] = {"facecolor": "none", "edgecolor": "#767676"}
    trends = [Patch(**grey, label=f"{letter}  energy {word}") for word, letter in TRENDS.items() if (table["trend"] == word).any()]
    seen = [word for word in OUTCOMES if word in LETTERS and (table["outcome"] == word).any()]
    return [*trends, *(Patch(**grey | {"facecolor": LETTERS[word][0]}, label=f"{LETTERS[word][1]}  {word}") for word in seen)]


def _map(axis: Any, rows: "pd.DataFrame", title: str) -> Any:
    """Draw one map; return the tiles that are coloured by size."""
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap, LogNorm

    words = list(LETTERS)
    outcomes, sizes, trends = (rows.pivot(index="varied", columns="value", values=name) for name in ("outcome", "size", "trend"))
    across, up = _edges(outcomes.columns.to_numpy(dtype=float)), _edges(outcomes.index.to_numpy(dtype=float))
    sized = outcomes.isin(SIZED).to_numpy()
    look = {"edgecolors": "white", "linewidth": 0.2, "rasterized": False}
    scale = colormaps[SIZES].with_extremes(over=LOST_COLOUR)
    errors = np.ma.masked_where(~sized, np.maximum(sizes.to_numpy(dtype=float), SMALLEST / 10))
    tiles = axis.pcolormesh(across, up, errors, cmap=scale, norm=LogNorm(SMALLEST, ALL), **look)
    numbers = np.array([[words.index(word) if word in words else 0 for word in line] for line in outcomes.to_numpy()])
    colours = ListedColormap([colour for colour, _ in LETTERS.values()])
    axis.pcolormesh(across, up, np.ma.masked_where(sized, numbers), cmap=colours, vmin=-0.5, vmax=len(words) - 0.5, **look)
    for j, value in enumerate(outcomes.index):
        for k, h in enumerate(outcomes.columns):
            _letter(axis, float(str(h)), float(str(value)), str(outcomes.iloc[j, k]), str(trends.iloc[j, k]), float(str(sizes.iloc[j, k])))
    axis.set(xscale="log", yscale="log")
    axis.set_title(title)
    axis.grid(visible=False)
    return tiles


def _letter(axis: Any, h: float, value: float, word: str, trend: str, size: float) -> None:
    """Write the letter of a tile: of its trend where it has a size, else of its outcome."""
    letter = TRENDS.get(trend, "") if word in SIZED else LETTERS[word][1]
    dark = word in ("blown up", "wrong branch", "rank lost") or (word in SIZED and size > DARK)
    axis.text(h, value, letter, fontsize=4.5, ha="center", va="center", color="white" if dark else "black")


def _edges(values: np.ndarray) -> np.ndarray:
    """Return the edges of tiles with these centres, equally far from neighbours in the logarithm."""
    logs = np.log(values)
    if len(logs) == 1:
        return np.asarray(np.exp([logs[0] - 0.5, logs[0] + 0.5]))
    middle = (logs[1:] + logs[:-1]) / 2
    return np.asarray(np.exp([2 * logs[0] - middle[0], *middle, 2 * logs[-1] - middle[-1]]))
