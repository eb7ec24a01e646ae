"""Parameters to their extremes: mass ratios from 1e-8 to 1e8, or any parameter over any values, as towards a singular mechanism."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from daebench.draw.figures import drawing, grid_of_axes, legend_below, save
from daebench.draw.methods import curve_of
from daebench.studies.grid.outcomes import FINE, varied_runs
from daebench.studies.grid.rows import by_method
from daebench.studies.grid.run_specification import GridRun
from daebench.studies.grid.runs import Runs
from daebench.studies.stability.extreme import Asked

if TYPE_CHECKING:
    import pandas as pd

STEPS = 2048
"""Steps of a run where no step size is given."""

TOL = 1e-8
"""Tolerance of methods that are driven by one."""

RATIOS = tuple(10.0**k for k in range(-8, 9, 2))
"""Factors of a mass, where no parameter is given."""

FEW = 3
"""So many values are listed."""

SMALLEST = 1e-18
"""Where a picture shows what is zero."""


def masses(asked: Asked) -> list[str]:
    """Return the parameters that are masses."""
    return [name for name in asked.ivp.parameters if "mass" in name]


def refusal(asked: Asked) -> str:
    """Return why a problem has no such extreme, as a sentence, or ""."""
    if len(asked.h) > 1:
        return "its runs have one step size, and several are given"
    if asked.parameters or len(masses(asked)) > 1:
        return ""
    return f"{asked.problem} has no two masses as parameters whose ratio could be varied; name a parameter and its values"


def varied(asked: Asked) -> tuple[str, Sequence[float]]:
    """Return the parameter that is varied, and its values."""
    if asked.parameters:
        return next(iter(asked.parameters.items()))
    name = masses(asked)[0]
    return name, [asked.ivp.parameters[name] * ratio for ratio in RATIOS]


def specifications(asked: Asked) -> list[GridRun]:
    """Return the runs."""
    name, values = varied(asked)
    metrics = ("energy", "manifold") if asked.ivp.on_manifold else ("energy",)
    resolutions = dict.fromkeys(asked.fixed, asked.h[0] if asked.h else asked.end / STEPS) | dict.fromkeys(asked.tolerant, TOL)
    return [
        asked.specification(method, resolution, metrics, parameters=((name, float(value)),), outputs=STEPS)
        for method, resolution in resolutions.items()
        for value in values
    ]


def measure(asked: Asked, runs: Runs) -> "pd.DataFrame":
    """Return one row a run, with its outcome, and the energy error in parts of the energy's size."""
    table = varied_runs(specifications(asked), varied(asked)[0], runs)
    return table.assign(near=asked.near, energy_part=table["energy_error"] / table["energy_scale"])


def says(table: "pd.DataFrame") -> list[str]:
    """Return how far each method goes, and what it does where it is not fine."""
    name, sentences = table["parameter"].iloc[0], []
    for method, rows in by_method(table):
        bad = rows[rows["outcome"] != FINE]
        worst = rows["energy_part"].max()
        energy_note = f"energy within {worst:.1e} of its size where it reached its end" if worst == worst else "it never reached its end"
        words = ", ".join(f"{word} {_where(list(group['varied']))}" for word, group in bad.groupby("outcome", sort=False))
        sentences.append(
            f"{method}: fine for {len(rows) - len(bad)} of {len(rows)} values of {name}{f' ({words})' if words else ''}; {energy_note}."
        )
    return sentences


def _where(values: list[float]) -> str:
    """Return at which values, or where there are many, how many they are and between which."""
    if len(values) <= FEW:
        return f"at {', '.join(f'{value:.4g}' for value in values)}"
    return f"at {len(values)} from {min(values):.4g} to {max(values):.4g}"


def draw(out: Path, stem: str, table: "pd.DataFrame") -> Path:
    """Draw energy error and residual of the constraints against the parameter."""
    shown = {"energy_part": "energy error / its size", "g": "largest |g|"}
    name, near = str(table["parameter"].iloc[0]), float(table["near"].iloc[0])
    columns = [column for column in shown if column in table and table[column].notna().any()]
    with drawing():
        figure, axes = grid_of_axes(1, max(1, len(columns)), 3.6)
        for axis, column in zip(axes[0], columns, strict=False):
            for method, rows in by_method(table):
                rows = rows.dropna(subset=[column]).sort_values("varied")
                axis.plot((rows["varied"] - rows["near"]).abs(), rows[column].clip(lower=SMALLEST), **curve_of(method))
            axis.set(xscale="log", yscale="log", xlabel=f"distance of {name} from {near:g}" if near else name, ylabel=shown[column])
        legend_below(figure, axes[0, 0], 4)
        return save(figure, out, stem, table)
