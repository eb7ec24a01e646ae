"""Step sizes and tolerances to 0, until round-off wins or a solver gives up."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from daebench.draw.figures import QUIET, drawing, save
from daebench.draw.methods import stroke_of
from daebench.studies.grid.rows import by_method, error_of, legends_below, resolution_panels, rows_of
from daebench.studies.grid.run_specification import GridRun, Row
from daebench.studies.grid.runs import Runs
from daebench.studies.stability.extreme import Asked, uncertified

if TYPE_CHECKING:
    import pandas as pd

STEPS = 2**20
"""Most steps of a run."""

TOLERANCES = tuple(10.0**-k for k in range(3, 16))
"""Tolerances."""

WORSE = 2.0
"""An error is worse where it is so many times the least."""

refusal = uncertified


def specifications(asked: Asked) -> list[GridRun]:
    """Return the runs."""
    assert asked.reference is not None
    spacing = float(asked.reference.t[1])
    steps = asked.h or [spacing / 2**k for k in range(0, 40, 2) if asked.end / (spacing / 2**k) <= STEPS]
    metrics = ("q", "manifold") if asked.ivp.on_manifold else ("y",)
    return [asked.specification(method, value, metrics) for method, value in asked.resolutions(steps, TOLERANCES)]


def measure(asked: Asked, runs: Runs) -> "pd.DataFrame":
    """Return one row a run."""
    return runs(specifications(asked))


def says(table: "pd.DataFrame") -> list[str]:
    """Return the least error of each method and where it is, what smaller steps do, and which solver gives up first."""
    error = error_of(table)
    sentences = [_least(method, rows_of(rows), error) for method, rows in by_method(table)]
    limits = {method: limit for method, rows in by_method(table[table["knob"] == "tol"]) if (limit := _gives_up(rows_of(rows)))}
    if limits:
        first = max(limits.values())
        names = ", ".join(name for name, at in limits.items() if at == first)
        later = ", ".join(f"{name} at {at:.0e}" for name, at in limits.items() if at < first)
        sentences.append(f"First to give up: {names}, at tol = {first:.0e}{f'; then {later}' if later else ''}.")
    return sentences


def _least(method: str, rows: list[Row], error: str) -> str:
    resolution, good = rows[0]["knob"], [row for row in rows if not row["failure"]]
    if not good:
        return f"{method} fails with every {resolution}."
    best, finest = min(good, key=lambda row: float(row[error])), min(good, key=lambda row: float(row["value"]))
    known = max(float(best[error]), float(best[error.replace("error", "bound")]))
    worse = float(finest[error]) / known
    unit = " s" if resolution == "h" else ""
    end = f"; at {resolution} = {finest['value']:.1e}{unit} it is {worse:.2g} times that: round-off has won" if worse > WORSE else ""
    return f"{method}: least error {known:.1e}, at {resolution} = {best['value']:.1e}{unit}{end}."


def _gives_up(rows: list[Row]) -> float:
    """Return the largest value below all with which it comes to its end; 0 if there is none."""
    finest = min((float(row["value"]) for row in rows if not row["failure"]), default=0.0)
    return max((float(row["value"]) for row in rows if row["failure"] and row["value"] < finest), default=0.0)


def draw(out: Path, stem: str, table: "pd.DataFrame") -> Path:
    """Draw errors against step size, and against tolerance; a cross is the smallest value before a solver gives up."""
    error = error_of(table)
    with drawing():
        figure, panels = resolution_panels(table, error, 4.6)
        floor = max(float(table[error.replace("error", "bound")].max()), 2.0**-53)
        for resolution, axis in panels.items():
            for method, rows in by_method(table[table["knob"] == resolution]):
                _cross(axis, rows, error, stroke_of(method).color)
            axis.axhline(floor, color=QUIET, linestyle=":", linewidth=1.0, label="one rounding")
            axis.set(yscale="log")
        next(iter(panels.values())).set_ylabel(f"largest error of {error.removeprefix('error_')}")
        legends_below(panels)
        return save(figure, out, stem, table)


def _cross(axis: Any, rows: "pd.DataFrame", error: str, color: str) -> None:
    """Mark the smallest value with which a method comes to its end, where it gives up with a smaller one."""
    good = rows.dropna(subset=[error]).sort_values("value")
    if len(good) and (rows[rows["failure"] != ""]["value"] < good["value"].min()).any():
        axis.plot(good["value"].iloc[0], good[error].iloc[0], "x", color=color, markersize=9, markeredgewidth=1.6)
