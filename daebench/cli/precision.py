"""``daebench precision``: what single, double and compensated arithmetic buy, and a Newton iteration that is ended early."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from daebench.cli.arguments import Case, Json, Problem, Scheduler, SideBySide, TlsCaFile, TlsCert, TlsKey, Workers
from daebench.cli.asked import asked_of
from daebench.cli.console import print_json, print_table, words
from daebench.cli.executors import Executors
from daebench.cli.grids import making, outdated, plan
from daebench.studies.grid.tls import Tls

if TYPE_CHECKING:
    import pandas as pd

SHOWN = ("method", "way", "time_ratio", "error_q", "error_y", "energy_error", "drifts", "g", "casimirs", "defect", "failure")
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
    workers: Workers = None,
    scheduler: Scheduler = None,
    tls_ca_file: TlsCaFile = None,
    tls_cert: TlsCert = None,
    tls_key: TlsKey = None,
    side_by_side: SideBySide = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Say how many runs are to be made, and about how long they take.")] = False,
    as_json: Json = False,
) -> None:
    """Compare single, double and compensated arithmetic, and Newton's iteration ended early, in error, energy, two-form and time.

    Newton's iteration is ended after 1, 2, 3 sweeps or at a tolerance, and held against a converged one.
    """
    from daebench.runs.files import make_folder
    from daebench.studies.grid.store import opened
    from daebench.studies.precision.figure import draw
    from daebench.studies.precision.study import cells_of, says, smallest_steps, table_of

    asked = asked_of(problem, case, methods=methods, h=h, t_end=t_end)
    tls = Tls(tls_ca_file, tls_cert, tls_key)
    executors = Executors(timed=repeat > 0, workers=workers, scheduler=scheduler, tls=tls, side_by_side=side_by_side)
    cells, refused = cells_of(asked, words(ways) if ways else (), repeat=repeat, beside=executors.beside)
    make_folder(out)
    with opened(store or out / "studies.db") as kept:
        if dry_run:
            print(plan([cell for _, cell in cells], kept, executors))
            raise typer.Exit
        again = outdated([cell for _, cell in cells], kept)
        with making(kept, executors, f"precision on {problem}") as runs:
            table = table_of(cells, runs)
    path = draw(out, "precision", table)
    last = smallest_steps(table)
    if as_json:
        print_json(
            {"says": says(table), "smallest_steps": last.to_dict("records"), "left_out": refused, "made_again": again, "file": str(path)}
        )
        return
    _print(last)
    for sentence in says(table):
        print(sentence)
    for what, why in refused.items():
        print(f"left out: {what}: {why}")
    if again:
        print(again)
    print(f"written: {path}")


def _print(last: "pd.DataFrame") -> None:
    columns = [name for name in SHOWN if name in last]
    rows = [[f"{value:.3g}" if isinstance(value, float) else str(value) for value in row] for row in last[columns].itertuples(index=False)]
    print_table(columns, rows, "with the smallest steps")
