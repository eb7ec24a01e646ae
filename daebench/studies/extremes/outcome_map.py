"""What becomes of runs over step size and a parameter: where a method is fine, and how it breaks."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from daebench.figures import drawing, grid_of_axes, save
from daebench.studies.cell import Cell
from daebench.studies.extreme import Asked, Extreme
from daebench.studies.outcomes import OUTCOMES, varied_runs
from daebench.studies.rows import by_method
from daebench.studies.runs import Runs

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

LETTERS = {
    "fine": ("#f2f2f2", ""),
    "coarse": ("#f0e442", "c"),
    "drifting": ("#e69f00", "d"),
    "off the manifold": ("#cc79a7", "m"),
    "wrong branch": ("#0072b2", "w"),
    "no solution": ("#56b4e9", "n"),
    "singular": ("#009e73", "s"),
    "rank lost": ("#767676", "r"),
    "blown up": ("#000000", "b"),
    "stopped": ("#d55e00", "x"),
}
"""Colour and letter of each outcome."""


def parameter_of(asked: Asked) -> str:
    """Return the parameter that is varied: the one that is given, one of :data:`FIRST`, or the first that is not zero; "" if none."""
    own = asked.scene.parameters
    return next((name for name in (*asked.parameters, *(n for n in FIRST if own.get(n)), *(n for n in own if own[n]))), "")


def _able(asked: Asked) -> str:
    if not asked.fixed:
        return "none of these methods has fixed steps"
    if not parameter_of(asked):
        return f"{asked.problem} has no parameter that could be varied"
    given = asked.parameters.get(parameter_of(asked), FACTORS)
    if min(given) <= 0 or len(set(given)) < len(given) or len(set(asked.h)) < len(asked.h):
        return "its axes are logarithmic, and take values greater than 0, each once"
    return ""


def cells(asked: Asked) -> list[Cell]:
    """Return the runs."""
    name = parameter_of(asked)
    values = asked.parameters.get(name) or [asked.scene.parameters[name] * factor for factor in FACTORS]
    steps = asked.h or [asked.end / n for n in STEPS]
    metrics = ("energy",) if asked.poisson else ("energy", "manifold", "jump")
    return [
        asked.cell(method, h, metrics, parameters=((name, float(value)),), outputs=int(asked.end / h + 1))
        for method in (asked.fixed if asked.methods else asked.fixed[:METHODS])
        for value in values
        for h in steps
    ]


def measure(asked: Asked, runs: Runs) -> "pd.DataFrame":
    """Return one row a run, with the column "outcome"."""
    return varied_runs(cells(asked), parameter_of(asked), runs)


def says(table: "pd.DataFrame") -> list[str]:
    """Return which part of the map is fine for each method, and what else happens most."""
    found = []
    for method, rows in by_method(table):
        counts = rows["outcome"].value_counts()
        worst = counts.drop("fine", errors="ignore")
        most = f"; most of the others: {worst.index[0]} ({worst.iloc[0]})" if len(worst) else ""
        found.append(f"{method}: {counts.get('fine', 0)} of {len(rows)} runs are fine{most}.")
    return found


def draw(out: Path, stem: str, table: "pd.DataFrame") -> Path:
    """Draw a map for each method, step size across and parameter up."""
    from matplotlib.patches import Patch

    methods = list(dict.fromkeys(table["method"]))
    columns = min(3, len(methods))
    lines = -(-len(methods) // columns)
    seen = [word for word in OUTCOMES if (table["outcome"] == word).any()]
    with drawing():
        figure, axes = grid_of_axes(lines, columns, 0.8 + 2.1 * lines, sharex=True, sharey=True)
        for k, axis in enumerate(axes.flat):
            if k < len(methods):
                _map(axis, table[table["method"] == methods[k]], methods[k])
            else:
                axis.set_visible(False)
        for axis in axes[-1]:
            axis.set_xlabel("step size h [s]")
        for axis in axes[:, 0]:
            axis.set_ylabel(str(table["parameter"].iloc[0]))
        patches = [Patch(facecolor=LETTERS[word][0], edgecolor="#767676", label=f"{word} {LETTERS[word][1]}".strip()) for word in seen]
        figure.legend(handles=patches, loc="outside lower center", ncols=5, handlelength=1.2)
        return save(figure, out, stem, table)


def _map(axis: object, rows: "pd.DataFrame", title: str) -> None:
    """Draw one map; every tile has its colour and its letter."""
    from matplotlib.axes import Axes
    from matplotlib.colors import ListedColormap

    assert isinstance(axis, Axes)
    words = list(LETTERS)
    grid = rows.pivot(index="varied", columns="value", values="outcome")
    numbers = np.array([[words.index(word) for word in line] for line in grid.to_numpy()])
    colours = ListedColormap([colour for colour, _ in LETTERS.values()])
    across, up = _edges(grid.columns.to_numpy(dtype=float)), _edges(grid.index.to_numpy(dtype=float))
    axis.pcolormesh(
        across, up, numbers, cmap=colours, vmin=-0.5, vmax=len(words) - 0.5, edgecolors="white", linewidth=0.2, rasterized=False
    )
    for value, line in grid.iterrows():
        for h, word in line.items():
            dark = word in ("blown up", "wrong branch", "rank lost")
            axis.text(
                float(str(h)),
                float(str(value)),
                LETTERS[word][1],
                fontsize=4.5,
                ha="center",
                va="center",
                color="white" if dark else "black",
            )
    axis.set(xscale="log", yscale="log")
    axis.set_title(title)
    axis.grid(visible=False)


def _edges(values: np.ndarray) -> np.ndarray:
    """Return the edges of tiles with these centres, equally far from neighbours in the logarithm."""
    logs = np.log(values)
    if len(logs) == 1:
        return np.asarray(np.exp([logs[0] - 0.5, logs[0] + 0.5]))
    middle = (logs[1:] + logs[:-1]) / 2
    return np.asarray(np.exp([2 * logs[0] - middle[0], *middle, 2 * logs[-1] - middle[-1]]))


EXTREME = Extreme(
    name="outcome-map",
    about="what becomes of runs over step size and a parameter",
    refusal=_able,
    cells=cells,
    measure=measure,
    says=says,
    draw=draw,
)
