"""``daebench work-precision --ensemble``: the cost of accuracy over many starts, and in how many of them a method is the cheapest."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from daebench.cli.console import print_json, print_table, print_written
from daebench.cli.folder import Folder
from daebench.cli.grids import StudyCommand
from daebench.errors import BadInput
from daebench.studies.grid.runs_together import starts_of
from daebench.studies.work_precision.starts import curves_of, runs_from_starts
from daebench.studies.work_precision.winners import sentences, winners

if TYPE_CHECKING:
    import pandas as pd

    from daebench.studies.grid.run_specification import StartRuns
    from daebench.studies.grid.study import Study
    from daebench.studies.work_precision.starts import Curves

SLOW = ("scipy:Radau", "solve_dae:Radau")
"""Methods in Python that take seconds per run: from many starts they run only on request."""

WINNERS, STEM = "winners.csv", "work_precision_starts"
"""Names of the table of ranks, and of the picture with its table."""

PRICES = (
    "costs are CPU times of runs of one start at a time: with fixed steps the median over a few starts, otherwise those of each start; "
    "errors with fixed steps are those of the same runs made many at a time"
)
"""Quantity by which methods are ranked."""


@dataclass(frozen=True)
class FromStarts:
    """Options of many starts.

    Parameters
    ----------
    members, solver_members : int
        Numbers of starts of fixed-step methods, and of others.
    distribution : str
        Their distribution.
    settings : mapping of str
        Settings of the distribution.
    seed : int
        Seed of the starts.
    """

    members: int
    solver_members: int
    distribution: str
    seed: int
    settings: Mapping[str, Any] = field(default_factory=dict)

    def runs(self, study: "Study") -> "list[StartRuns]":
        """Return the runs."""
        given: dict[str, Any] = {"distribution": self.distribution, "settings": self.settings, "seed": self.seed}
        return runs_from_starts(study, members=self.members, solver_members=self.solver_members, **given)


def folder_of(out: Path) -> Folder:
    """Return the folder of :func:`from_starts`, with what is written there."""
    return Folder(out, (WINNERS,), (STEM,))


def without_slow(study: "Study", left_out: dict[str, str]) -> "Study":
    """Return a study without the methods of :data:`SLOW`, and note why these are left out."""
    why = "{0}: it takes seconds per run, which is long from many starts; name it in --methods to include it."
    left_out |= {name: why.format(name) for name in study.methods if name in SLOW}
    return replace(study, methods=[name for name in study.methods if name not in SLOW])


def from_starts(asked: FromStarts, study: "Study", error: str, command: StudyCommand) -> None:
    """Make the runs, write the picture and tables, and print which method is the cheapest."""
    from daebench.draw.figures import save_table
    from daebench.studies.work_precision.band_figure import bands, draw_bands
    from daebench.studies.work_precision.figure import families

    specifications = asked.runs(study)
    if error.removeprefix("error_") not in specifications[0].metrics:
        known = ", ".join(f"error_{name}" for name in specifications[0].metrics)
        raise BadInput(f"over many starts errors are {known}; {error} is of one start, without --ensemble.")
    with command.runs(specifications, f"work against precision on {study.problem}") as (runs, again):
        table = runs(specifications)
    curves = curves_of(table, error)
    ranks, quantiles = winners(curves), bands(curves)
    save_table(command.folder.place / WINNERS, ranks)
    label = error.replace("_", " of ").replace("error", "largest error")
    path = draw_bands(command.folder.place, quantiles, families(table), label, sentences(ranks), STEM)
    failures = {some.method: int(some.failed.sum()) for some in curves if some.failed.any()}
    summary = {"runs": sum(run.count for run in specifications), "failed": sum(failures.values()), "failures": failures}
    summary |= {"made_again": again, "left_out": dict(command.left_out)} | _about(specifications, table, curves)
    if command.json:
        records = {"winners": ranks.to_dict("records"), "bands": quantiles.to_dict("records"), "sentences": sentences(ranks)}
        print_json({"members": asked.members, "solver_starts": min(asked.members, asked.solver_members), **records, **summary})
        return
    _tell(ranks, summary, error)
    print_written((command.folder.place / WINNERS, path))


def _about(specifications: "list[StartRuns]", table: "pd.DataFrame", curves: "list[Curves]") -> dict[str, Any]:
    """Return the description of starts, references and costs."""
    import numpy as np

    bound = max(curves, key=lambda some: some.starts).bound
    known = bound[np.isfinite(bound)]
    worst = {"median": float(np.median(known)), "most": float(np.max(known))} if len(known) else {}
    starts = starts_of(max(specifications, key=lambda run: run.count))
    return {
        "starts": starts.about,
        "t_end": specifications[0].t_end,
        "reference": str(table["reference"].iloc[0]),
        "reference_error": {**worst, "members_without": int(len(bound) - len(known))},
        "prices": PRICES,
    }


def _tell(ranks: "pd.DataFrame", summary: Mapping[str, Any], error: str) -> None:
    """Print which method is the cheapest, the table, and the description of starts, references and costs."""
    for sentence in sentences(ranks):
        print(sentence)
    columns = ["level", "method", "price [s]", "cheapest [%]", "of", "next", "before next [%]", "starts", "next costs, times"]
    print_table(columns, [_row(row) for row in ranks.to_dict("records")], f"methods for {error}, with intervals of 95 % over starts")
    print(f"starts: {summary['starts']}")
    errors = summary["reference_error"]
    worst = f"{errors['median']:.1e} in the median, {errors['most']:.1e} at most" if "median" in errors else "unknown"
    without = f"; {errors['members_without']} starts have none" if errors["members_without"] else ""
    print(f"errors are against: {summary['reference']}, which may be wrong by {worst}{without}")
    print(f"{PRICES}.")
    if summary["failed"]:
        named = ", ".join(f"{count} of {method}" for method, count in summary["failures"].items())
        print(f"{summary['failed']} of {summary['runs']} runs stopped early and reach no accuracy: {named}.")
    for why in summary["left_out"].values():
        print(f"left out: {why}")
    if summary["made_again"]:
        print(summary["made_again"])


def _row(row: Mapping[Any, Any]) -> list[str]:
    """Return a row of the table as a sentence."""
    head = [f"{row['level']:.0e}", row["method"], f"{row['price']:.3g}", _interval(row, "cheapest", 100), str(row["of"])]
    if not row["next"]:
        return [*head, "", "", "", ""]
    return [*head, row["next"], _interval(row, "before", 100), f"{row['starts']:.0f}", _interval(row, "ratio", 1)]


def _interval(row: Mapping[Any, Any], name: str, unit: float) -> str:
    value, low, high = (f"{unit * row[key]:.3g}" for key in (name, f"{name}_low", f"{name}_high"))
    return f"{value} [{low}, {high}]"
