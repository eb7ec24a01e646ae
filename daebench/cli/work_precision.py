"""``daebench work-precision``: the cost of accuracy, method by method."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from daebench.cli import arguments
from daebench.cli.console import methods_if_given, print_frame, print_json, print_written
from daebench.cli.executors import Executors
from daebench.cli.folder import Folder
from daebench.cli.grids import StudyCommand
from daebench.cli.starts import Box, Distribution, Energy, Size, Starts, settings_of
from daebench.cli.work_precision_starts import FromStarts, folder_of, from_starts, without_slow
from daebench.errors import BadInput, DaebenchError, unknown
from daebench.methods.outside.read import is_outside
from daebench.runs.texts import numbers, pairs
from daebench.studies.grid.metrics import metrics_of
from daebench.studies.grid.schedulers import Tls
from daebench.studies.work_precision.study import LEVELS, cheapest, standard, with_costs

DEFECT = "defect"
"""Column and metric that is measured only on request, because it takes the longest."""

SOLVER_STARTS = 16
"""Default number of starts of solvers."""

NO_ERRORS = ("bound", "growth", "energy_verdict", "energy_scale")
"""Prefixes of columns that are not errors."""

if TYPE_CHECKING:
    import pandas as pd

    from daebench.studies.grid.study import Study


Error = Annotated[
    str | None,
    typer.Option("--error", help="Column to draw against costs; error_q, or error_y, if left out. defect: of the two-form."),
]

Ensemble = Annotated[
    int | None,
    typer.Option("--ensemble", help="Number of starts in place of one: bands of errors, and in how many starts a method is the cheapest."),
]
SolverStarts = Annotated[int, typer.Option("--solver-starts", help="Number of starts for solvers, which run one by one.")]


def work_precision(
    problem: arguments.Problem,
    case: arguments.Case = None,
    methods: arguments.StudyMethods = None,
    h: Annotated[str | None, typer.Option("--h", help="Step sizes, comma-separated; by default halvings.")] = None,
    tol: Annotated[str | None, typer.Option("--tol", help="Tolerances, comma-separated; 1e-3 to 1e-13 if left out.")] = None,
    t_end: arguments.StudyTEnd = None,
    param: arguments.Param = None,
    error: Error = None,
    ensemble: Ensemble = None,
    solver_starts: SolverStarts = SOLVER_STARTS,
    starts: Starts = Distribution.neighbourhood,
    size: Size = None,
    box: Box = None,
    energy: Energy = None,
    seed: Annotated[int, typer.Option("--seed", help="Seed of the starts of --ensemble.")] = 0,
    repeat: arguments.Repeat = 3,
    anyway: arguments.Anyway = False,
    on_singular: arguments.OnSingular = None,
    store: arguments.Store = None,
    out: Annotated[Path, typer.Option("--out", help="Folder for table and picture.")] = Path("output/work-precision"),
    workers: arguments.Workers = None,
    scheduler: arguments.Scheduler = None,
    tls_ca_file: arguments.TlsCaFile = None,
    tls_cert: arguments.TlsCert = None,
    tls_key: arguments.TlsKey = None,
    side_by_side: arguments.SideBySide = False,
    dry_run: arguments.DryRun = False,
    overwrite: arguments.Overwrite = False,
    json: arguments.Json = False,
) -> None:
    """Measure errors of many methods against time and work, and name the cheapest for each accuracy; runs are stored.

    Errors are against the certified reference if it has these parameters and reaches the end, otherwise against the closed form or a finer
    run; the output names it and its error bound.

    With --ensemble methods run from many starts, drawn as --starts says. Errors are then against runs of heyoka's batch mode or, if heyoka
    is not installed or cannot solve the problem, of a composition of order 8 with a third of the smallest step size.

    Runs are timed one at a time, the best of several after a first run that is not timed; without times they are made side by side.
    heyoka's Taylor series (heyoka:taylor) and solve_dae's Radau method (solve_dae:Radau) are included if their packages are installed
    (extra peers).
    """
    tls = Tls(tls_ca_file, tls_cert, tls_key)
    executors = Executors(timed=repeat > 0, workers=workers, scheduler=scheduler, tls=tls, side_by_side=side_by_side)
    asked: dict[str, Any] = {"case": case, "methods": methods_if_given(methods), "repeat": repeat, "beside": executors.beside}
    asked |= {"h": numbers("--h", h), "tol": numbers("--tol", tol), "t_end": t_end, "parameters": pairs("param", param or [])}
    study, left_out = standard(problem, **asked, also=(DEFECT,) if error == DEFECT else (), anyway=anyway, on_singular=on_singular)
    column = _column(error, study)
    command = StudyCommand(store, _folder(out, column, ensemble), executors, left_out, dry_run=dry_run, json=json)
    if ensemble is not None:
        study = study if methods else without_slow(study, left_out)
        settings = settings_of(starts.value, size=size, box=box, energy=energy)
        return from_starts(FromStarts(ensemble, solver_starts, starts.value, seed, settings), study, column, command)
    _refuse_of_no_use(size, box, energy, seed, starts, solver_starts)
    return _from_one_start(study, column, command)


def _from_one_start(study: "Study", error: str, command: StudyCommand) -> None:
    """Make the runs from the start of the case, write table and picture, and print which method is the cheapest."""
    specifications = study.specifications()
    label = f"work against precision on {study.problem}"
    with command.runs(specifications, label) as (runs, again):
        table = with_costs(runs(specifications))
    path = _drawn(command.folder.place, table, error)
    _tell(table, error, "seconds" if study.repeat else "evaluations", command.left_out, again, json=command.json)
    if not command.json:
        print_written((command.folder.place / "work_precision.csv", path))
    raise typer.Exit(1 if any(map(is_outside, _without_run(table))) else 0)


def _folder(out: Path, column: str, ensemble: int | None) -> Folder:
    """Return the folder of table and picture: from one start, or from many."""
    return Folder(out, ("work_precision.csv",), (f"work_precision_{column}",)) if ensemble is None else folder_of(out)


def _refuse_of_no_use(size: Any, box: Any, energy: Any, seed: int, starts: Distribution, solver_starts: int) -> None:
    """Refuse options of many starts that are given if there is one start."""
    options = {"--size": size is not None, "--box": bool(box), "--energy": energy is not None, "--seed": seed != 0}
    options |= {"--starts": starts is not Distribution.neighbourhood, "--solver-starts": solver_starts != SOLVER_STARTS}
    if given := [name for name, is_given in options.items() if is_given]:
        raise BadInput(f"{', '.join(given)} {'is' if len(given) == 1 else 'are'} for many starts; give their number with --ensemble.")


def _drawn(out: Path, table: "pd.DataFrame", error: str) -> Path:
    """Write the table, and return the path of the picture of an error against costs."""
    from daebench.draw.figures import save_table
    from daebench.studies.work_precision.figure import draw, nothing_of

    save_table(out / "work_precision.csv", table)
    if why := nothing_of(table, error):
        raise DaebenchError(f"there is no {error} to draw: {why}; the table is {out / 'work_precision.csv'}.")
    return draw(out, table, error, error.replace("_", " of ").replace("error", "largest error"))


def _tell(table: "pd.DataFrame", error: str, cost: str, left_out: Mapping[str, str], again: str, *, json: bool) -> None:
    """Print which method is the cheapest for each accuracy, the reference of the errors, and the runs that were left out or made again."""
    best, references = cheapest(table, error, cost, LEVELS), _references(table, error)
    uncounted = [str(method) for method, rows in table.groupby("method") if rows[cost].isna().all() and (rows["failure"] == "").any()]
    left_out = {**left_out, **{method: f"{method}: its work is not counted; give --repeat to rank it by time." for method in uncounted}}
    left_out |= _without_run(table)
    if json:
        failed = int((table["failure"] != "").sum())
        summary = {"best": best.to_dict("records"), "left_out": left_out, "runs": len(table), "failed": failed, "made_again": again}
        print_json(summary | {"references": references})
        return
    print_frame(best, f"cheapest for {error}")
    for reference, bound in references.items():
        print(f"errors are against: {reference}{f', which may be wrong by {bound:.1e}' if bound == bound else ''}")
    for why in left_out.values():
        print(f"left out: {why}")
    if again:
        print(again)


def _without_run(table: "pd.DataFrame") -> dict[str, str]:
    """Return why methods have no run that reached its end."""
    return {str(method): str(rows["failure"].iloc[-1]) for method, rows in table.groupby("method") if (rows["failure"] != "").all()}


def _column(error: str | None, study: "Study") -> str:
    """Return the column to draw; refuse one that the study does not have."""
    known = [name for metric in metrics_of(study.metrics) for name in metric.columns if not name.startswith(NO_ERRORS)]
    if error is not None and error not in known:
        raise unknown("column", error, {*known, DEFECT})
    return error or known[0]


def _references(table: "pd.DataFrame", error: str) -> dict[str, float]:
    """Return the reference of an error, and its error bound; empty for other columns."""
    bound = error.replace("error_", "bound_")
    if bound == error or "reference" not in table:
        return {}
    rows = table[table["reference"].notna() & (table["reference"] != "")]
    return {str(words): float(group[bound].max()) for words, group in rows.groupby("reference")}
