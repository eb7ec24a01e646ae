"""``daebench compare``: several methods on one initial value problem."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from daebench.cli.arguments import (
    Algebra,
    Anyway,
    Case,
    Free,
    Json,
    Methods,
    OnSingular,
    Overwrite,
    Param,
    Problem,
    Project,
    StepSize,
    TEnd,
    Tolerance,
)
from daebench.cli.comparison_picture import PictureFile
from daebench.cli.comparison_table import notes, print_narrow
from daebench.cli.console import bar, method_names, print_json, print_written
from daebench.cli.folder import Folder
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import methods_of
from daebench.runs.texts import pairs

if TYPE_CHECKING:
    import pandas as pd

NAMED = ("method", "h", "tol", "steps", "t_end", "t_reached")
TOLD = ("energy_error", "energy_size", "energy_verdict", "energy_law", "energy_reason", "energy_change_bound")
ENDING = ("position_error", "position_bound", "position_reference", "seconds", "failure")
"""Columns of a comparison in its JSON, in this order; the file of ``--out`` has all columns."""


def compare(
    problem: Problem,
    methods: Methods,
    t_end: TEnd,
    case: Case = None,
    h: StepSize = None,
    tol: Tolerance = 1e-8,
    param: Param = None,
    option: Free = None,
    project: Project = False,
    on_singular: OnSingular = None,
    algebra: Algebra = "",
    anyway: Anyway = False,
    out: Annotated[
        Path | None,
        typer.Option("--out", help="Folder for the table and the picture, with its data; or FILE.pdf, .svg or .png for the picture alone."),
    ] = None,
    size: Annotated[str | None, typer.Option("--size", help="Width and height of FILE in inches, for example 16x9.")] = None,
    title: Annotated[str | None, typer.Option("--title", help="Title of FILE; problem and case if left out.")] = None,
    labels: Annotated[str | None, typer.Option("--labels", help="Display names of the methods in FILE, comma-separated.")] = None,
    colors: Annotated[str | None, typer.Option("--colors", help="Colours of the methods in FILE: black,#0072b2.")] = None,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Compare methods on one problem: error, size and trend of the energy, error of the position, time; exit 1 if one stops early.

    The position, or the state y of a Poisson system, is compared with a certified reference if there is one, otherwise with a closed form
    or a finer run; the output says which. The file that --out writes also has manifold or Casimir errors, integrals, and work.
    """
    wanted = method_names(methods)
    picture = PictureFile.of(out, len(wanted), size=size, title=title, labels=labels, colors=colors)
    if picture is not None:
        picture.check()
    else:
        Folder(out, ("comparison.csv",), pictures=("comparison_drift",)).check()
    posed: dict[str, Any] = {"project": project, "algebra": algebra, "on_singular": on_singular}
    ivp = initial_value_problem(problem, case, pairs("param", param or []), **posed)
    chosen = methods_of(ivp, wanted, pairs("option", option or []), anyway=anyway)
    runs, table = _compared(ivp, chosen, h=h, tol=tol, t_end=t_end)
    written = []
    if out is not None:
        from daebench.studies.comparison.figure import write

        written = picture.written(ivp, runs) if picture else [str(path) for path in write(out, ivp, runs, table)]
    if json:
        print_json(_plain(ivp, table) | {"written": written})
    else:
        _print(table, written)
    raise typer.Exit(1 if any(run.failure for run in runs) else 0)


def _compared(ivp: Any, chosen: Sequence[Any], *, h: float | None, tol: float, t_end: float) -> tuple[list[Any], "pd.DataFrame"]:
    """Return the runs of all methods, and their table."""
    from daebench.studies.comparison.table import table_of, trajectories

    with bar(f"compare on {ivp.problem}") as progress:
        names = [method.name for method in chosen]

        def began(name: str) -> None:
            progress(names.index(name) / len(names), f"{name} on {ivp.problem}")

        runs = trajectories(ivp, chosen, h=h, tol=tol, t_end=t_end, began=began)
        progress(1.0, "errors of the positions")
        return runs, table_of(ivp, chosen, runs, t_end)


def _plain(ivp: Any, table: "pd.DataFrame") -> dict[str, Any]:
    """Return a comparison as one mapping; a row has h or tol, depending on its method."""
    rows = []
    for row in table.to_dict("records"):
        resolution = "h" if row.get("h") == row.get("h") and "h" in row else "tol"
        names = [name for name in (*NAMED, *TOLD, *ENDING) if name in row and (name not in ("h", "tol") or name == resolution)]
        rows.append({name: row[name] for name in names} | {"failure": row["failure"] or None})
    return {"problem": ivp.problem, "case": ivp.case, "parameters": dict(ivp.parameters), "rows": rows}


def _print(table: "pd.DataFrame", written: list[str]) -> None:
    """Print the columns that fit on 80 characters, then the references of positions, why methods stopped, and the written files."""
    print_narrow(table)
    for note in notes(table):
        print(note)
    for failure in table["failure"].dropna():  # pandas 3 has NaN in place of None
        if failure:
            print(failure)
    print_written(written)
