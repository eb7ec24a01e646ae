"""``daebench precision``: what single, double and compensated arithmetic buy, and a Newton iteration that is ended early."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from daebench.cli.arguments import Case, Json, Problem
from daebench.cli.console import bar, numbers, print_json, print_table, words

if TYPE_CHECKING:
    import pandas as pd

SHOWN = ("method", "way", "time_ratio", "error_q", "error_y", "energy_drift", "energy_kind", "g", "casimirs", "defect", "failure")
"""Columns of the table on the screen."""


def precision(
    problem: Problem,
    case: Case = None,
    methods: Annotated[
        str | None, typer.Option("--methods", help="Names of fixed-step methods, comma-separated; some if left out.")
    ] = None,
    ways: Annotated[
        str | None,
        typer.Option("--ways", help="float64, float32, compensated, sweeps=K, newton=TOL, comma-separated; some of each if left out."),
    ] = None,
    h: Annotated[str | None, typer.Option("--h", help="Step sizes, comma-separated; by the reference's times if left out.")] = None,
    t_end: Annotated[float | None, typer.Option("--t-end", help="End of all runs; 10 or the end of the reference if left out.")] = None,
    repeat: Annotated[int, typer.Option("--repeat", min=0, help="Runs that are timed, of which the best counts; 0: no times.")] = 3,
    store: Annotated[
        Path | None, typer.Option("--store", help="File in which runs are kept; studies.db in the folder if left out.")
    ] = None,
    out: Annotated[Path, typer.Option("--out", help="Folder for table and picture.")] = Path("output/precision"),
    as_json: Json = False,
) -> None:
    """Compare single, double and compensated arithmetic, and Newton's iteration ended early, in error, energy, two-form and time."""
    from daebench.errors import Interrupted
    from daebench.files import make_folder
    from daebench.inputs import positive
    from daebench.studies.extreme import Asked
    from daebench.studies.precision import cells_of, says, smallest_steps, table_of
    from daebench.studies.precision_figure import draw
    from daebench.studies.stability import runs_of
    from daebench.studies.store import opened

    asked = Asked(
        problem=problem,
        case=case,
        methods=words(methods) if methods else (),
        t_end=None if t_end is None else positive("--t-end", t_end),
        h=[positive("--h", value) for value in numbers("--h", h) or ()],
    )
    cells, refused = cells_of(asked, words(ways) if ways else (), repeat=repeat)
    make_folder(out)
    with opened(store or out / "studies.db") as kept, bar(f"precision on {problem}") as progress:
        try:
            table = table_of(cells, runs_of(kept, tell=lambda done, of, cell: progress(done / of, f"{cell.method}, h = {cell.value:.3g}")))
        except KeyboardInterrupt as stop:
            raise Interrupted(f"interrupted; {len(kept)} runs are kept in {kept.path}: run again to go on.") from stop
    path = draw(out, "precision", table)
    last = smallest_steps(table)
    if as_json:
        print_json({"says": says(table), "smallest_steps": last.to_dict("records"), "left_out": refused, "file": str(path)})
        return
    _print(last)
    for sentence in says(table):
        print(sentence)
    for what, why in refused.items():
        print(f"left out: {what}: {why}")
    print(f"written: {path}")


def _print(last: "pd.DataFrame") -> None:
    columns = [name for name in SHOWN if name in last]
    rows = [[f"{value:.3g}" if isinstance(value, float) else str(value) for value in row] for row in last[columns].itertuples(index=False)]
    print_table(columns, rows, "with the smallest steps")
