"""``daebench precision``: single, double and compensated arithmetic, and a Newton iteration that is ended early."""

from pathlib import Path
from typing import Annotated

import typer

from daebench.cli import arguments
from daebench.cli.console import print_frame, print_json
from daebench.cli.executors import Executors
from daebench.cli.folder import Folder
from daebench.cli.grids import asked_of, study_runs
from daebench.runs.texts import words
from daebench.studies.grid.schedulers import Tls
from daebench.studies.precision.study import says, smallest_steps, specifications_of, table_of

SHOWN = ("method", "way", "time_ratio", "error_q", "error_y", "energy_error", "energy_verdict", "g", "casimirs", "defect", "failure")
"""Columns of the printed table."""


Ways = Annotated[
    str | None,
    typer.Option("--ways", help="float64, mixed, float32, compensated, sweeps=K, newton=TOL, comma-separated; some if left out."),
]


def precision(
    problem: arguments.Problem,
    case: arguments.Case = None,
    methods: Annotated[
        str | None, typer.Option("--methods", help="Names of fixed-step methods, comma-separated; some if left out.")
    ] = None,
    ways: Ways = None,
    h: Annotated[str | None, typer.Option("--h", help="Step sizes, comma-separated; from the times of the reference if left out.")] = None,
    t_end: arguments.StudyTEnd = None,
    repeat: arguments.Repeat = 3,
    anyway: arguments.Anyway = False,
    on_singular: arguments.OnSingular = None,
    store: arguments.Store = None,
    out: Annotated[Path, typer.Option("--out", help="Folder for table and picture.")] = Path("output/precision"),
    workers: arguments.Workers = None,
    scheduler: arguments.Scheduler = None,
    tls_ca_file: arguments.TlsCaFile = None,
    tls_cert: arguments.TlsCert = None,
    tls_key: arguments.TlsKey = None,
    side_by_side: arguments.SideBySide = False,
    dry_run: arguments.DryRun = False,
    overwrite: arguments.Overwrite = False,
    as_json: arguments.Json = False,
) -> None:
    """Compare single, double and compensated arithmetic, and Newton's iteration ended early, in error, energy, two-form and time.

    Newton's iteration is ended after 1, 2, 3 iterations or at a tolerance, and compared with a converged one.
    """
    from daebench.studies.precision.figure import draw

    asked = asked_of(problem, case, methods=methods, h=h, t_end=t_end, anyway=anyway, on_singular=on_singular)
    tls = Tls(tls_ca_file, tls_cert, tls_key)
    executors = Executors(timed=repeat > 0, workers=workers, scheduler=scheduler, tls=tls, side_by_side=side_by_side)
    specifications, refused = specifications_of(asked, words(ways) if ways else (), repeat=repeat, beside=executors.beside)
    wanted, folder = [specification for _, specification in specifications], Folder(out, pictures=("precision",))
    with study_runs(wanted, store, folder, executors, f"precision on {problem}", dry_run=dry_run) as (runs, again):
        table = table_of(specifications, runs)
    path = draw(out, "precision", table)
    last = smallest_steps(table)
    if as_json:
        rest = {"left_out": asked.left_out | refused, "made_again": again, "file": str(path)}
        print_json({"says": says(table), "smallest_steps": last.to_dict("records")} | rest)
        return
    print_frame(last[[name for name in SHOWN if name in last and not last[name].isna().all()]], "with the smallest steps")
    left_out = (f"left out: {why}" for why in (*asked.left_out.values(), *(f"{what}: {why}" for what, why in refused.items())))
    print("\n".join([*says(table), *left_out, *filter(None, [again]), f"written: {path}"]))
