"""The effect of precision: single, double and compensated arithmetic, and Newton's iteration ended early, with their costs."""

from collections.abc import Sequence
from typing import Any

from daebench.errors import BadInput
from daebench.methods.outside.read import is_outside
from daebench.runs.state import CONSTRAINED, POISSON
from daebench.studies.grid.claimed import feasible
from daebench.studies.grid.measure import Row
from daebench.studies.grid.rows import by_method, error_of, rows_of
from daebench.studies.grid.run_specification import GridRun
from daebench.studies.grid.runs import Runs
from daebench.studies.grid.specification import require_possible
from daebench.studies.grid.study import computed_in
from daebench.studies.stability.extreme import Asked, uncertified
from daebench.studies.work_precision.study import REPEAT
from daebench.systems.lazily import pandas as pd

WAYS = ("float64", "compensated", "float32", "sweeps=1", "sweeps=2", "sweeps=3", "newton=1e-6")
"""How to compute, in the words of :class:`daebench.studies.grid.study.Study`."""

BASE = "float64"
"""The arithmetic that the others are compared with."""

METHODS = {CONSTRAINED: ("rattle", "lobatto3"), POISSON: ("midpoint", "strang")}
"""Default methods by the state of the problem."""

HALVINGS = (2, 4, 6, 8)
"""Halvings of the distance of stored times, where no step sizes are given."""

AS_GOOD = 1.1
"""A number is as good as that of double precision up to this factor."""

ROUND_OFF = 1e-14
"""Where numbers are no worse than this, in parts of their size, they are of round-off all."""


def specifications_of(
    asked: Asked, ways: Sequence[str] = (), *, repeat: int = REPEAT, beside: bool = False
) -> tuple[list[tuple[str, GridRun]], dict[str, str]]:
    """Return every way to compute with its run, and why some are left out.

    BadInput is raised if a way or a method is unknown, a method is from outside, none has fixed steps, no way can be run, or the reference
    ends before the runs.
    """
    if asked.reference and asked.end > asked.reference.horizon:
        raise BadInput(f"{uncertified(asked)}; take a smaller t_end.")
    methods = _methods(asked)
    labelled: list[tuple[str, GridRun]] = []
    refused: dict[str, str] = {}
    for method in methods:
        for way in ways or WAYS:
            specifications = [
                asked.specification(method, h, _metrics(asked), repeat=repeat, beside=beside and repeat > 0, **computed_in(way))
                for h in asked.h or _steps(asked)
            ]
            try:
                for specification in specifications:
                    require_possible(specification)
            except BadInput as error:
                refused[f"{method}, {way}"] = str(error)
                continue
            labelled += [(way, specification) for specification in specifications]
    if not labelled:
        raise BadInput(f"none of these ways can be run: {next(iter(refused.values()))}")
    return labelled, refused


def _methods(asked: Asked) -> list[str]:
    """Return the methods that are compared."""
    for name in filter(is_outside, asked.methods):
        raise BadInput(
            f"{name} is from outside, and computes in its own arithmetic; precision compares kinds of arithmetic for methods of daebench."
        )
    methods = asked.fixed if asked.methods else feasible(asked.ivp, METHODS[asked.ivp.state], anyway=asked.anyway)[0]
    if not methods:
        raise BadInput("precision is compared for fixed-step methods, and none is given; give some, for example rattle.")
    return methods


def _metrics(asked: Asked) -> tuple[str, ...]:
    error = () if asked.reference is None else (asked.ivp.state.position,)
    return (*error, "energy", asked.ivp.state.conserved, "defect")


def _steps(asked: Asked) -> list[float]:
    spacing = float(asked.reference.t[1]) if asked.reference else asked.end / 128
    return [spacing / 2**k for k in HALVINGS]


def table_of(labelled: Sequence[tuple[str, GridRun]], runs: Runs) -> "pd.DataFrame":
    """Return one row a run, with the column "way"."""
    table = runs([specification for _, specification in labelled])
    return table.assign(way=[way for way, _ in labelled])


def smallest_steps(table: "pd.DataFrame") -> "pd.DataFrame":
    """Return the rows with each method's smallest step, where precision matters most, and their time over that of double precision."""
    rows: list[dict[str, Any]] = []
    for _, runs in by_method(table):
        last = rows_of(runs[runs["value"] == runs["value"].min()])
        base = next((float(row["seconds"]) for row in last if row["way"] == BASE), float("nan"))
        rows += [{**row, "time_ratio": row["seconds"] / base} for row in last]
    return pd.DataFrame(rows)


def says(table: "pd.DataFrame") -> list[str]:
    """Return, for each method, what double precision reaches and the cheapest way that is as good, and what single precision loses."""
    error, sentences = error_of(table), []
    for method, runs in by_method(smallest_steps(table)):
        rows = {str(row["way"]): row for row in rows_of(runs) if not row["failure"]}
        if BASE not in rows:
            continue
        base = rows[BASE]
        sentences.append(f"{method} with h = {base['value']:.2g} s: {_held(rows, base, error)}")
    return sentences


def _held(rows: dict[str, Row], base: Row, error: str) -> str:
    """Return the effects of ending Newton's iteration early, of compensation and of single precision, against double precision."""
    parts = [f"{'energy error' if error == 'energy_error' else error.replace('_', ' of ')} {base[error]:.1e}"]
    early = [way for way in rows if "=" in way]
    good = [way for way in early if _as_good(rows[way], base, error)]
    if good:
        best = min(good, key=lambda way: float(rows[way]["time_ratio"]))
        parts.append(f"{best} is as accurate in error, energy, constraints and two-form{_time(rows[best])}")
    elif early:
        parts.append("Newton's iteration ended early is never as accurate")
    if "compensated" in rows:
        parts.append(f"compensated sums give {rows['compensated'][error]:.1e}{_time(rows['compensated'])}")
    if "mixed" in rows:
        parts.append(f"single precision of the forces alone {rows['mixed'][error]:.1e}{_time(rows['mixed'])}")
    if "float32" in rows:
        parts.append(f"single precision {rows['float32'][error]:.1e}{_time(rows['float32'])}")
    return "; ".join(parts) + "."


def _as_good(row: Row, base: Row, error: str) -> bool:
    """Return whether error, energy, constraints and two-form are as good, or of round-off."""
    sizes = {error: 1.0, "energy_error": base["energy_scale"]} | dict.fromkeys(("g", "Gv", "casimirs", "defect"), 1.0)
    return all(row[name] <= max(AS_GOOD * base[name], ROUND_OFF * size) for name, size in sizes.items() if name in row)


def _time(row: Row) -> str:
    """Return the time over that of double precision, if it was timed."""
    return f", in {row['time_ratio']:.2f} times the time" if row["time_ratio"] == row["time_ratio"] else ""
