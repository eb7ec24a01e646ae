"""``daebench ensemble``: one method on many starts at once."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from daebench.cli.arguments import (
    Anyway,
    Case,
    Compensated,
    Free,
    Json,
    Method,
    OnSingular,
    Overwrite,
    Param,
    Problem,
    Scheduler,
    Store,
    TlsCaFile,
    TlsCert,
    TlsKey,
)
from daebench.cli.console import bar, print_json, print_table, print_written
from daebench.cli.executors import Executors
from daebench.cli.folder import Folder
from daebench.cli.integer import whole
from daebench.cli.starts import Box, Distribution, Energy, Size, Starts, settings_of
from daebench.cli.summary import print_summary
from daebench.errors import BadInput
from daebench.records.store import opened
from daebench.runs.csv_files import write_frame
from daebench.runs.files import atomic
from daebench.runs.texts import bounds, pairs
from daebench.studies.ensemble.run import ensemble as made
from daebench.studies.grid.schedulers import Tls

if TYPE_CHECKING:
    from daebench.records.store import Store as GridStore
    from daebench.studies.ensemble.result import Ensemble


TABLES = ("starts.csv", "ends.csv")
"""Names of the written tables, of one row per member."""


Workers = Annotated[
    int | None, typer.Option("--workers", help="Number of processes on this machine that compute stored members; one if left out.")
]


def ensemble(
    problem: Problem,
    method: Method,
    h: Annotated[float | None, typer.Option("--h", help="Step size, s, if it is not in a --grid.")] = None,
    t_end: Annotated[float | None, typer.Option("--t-end", help="End time, s.")] = None,
    steps: Annotated[int | None, typer.Option("--steps", parser=whole, help="Number of steps, in place of --t-end.")] = None,
    members: Annotated[int | None, typer.Option("--members", parser=whole, help="Number of starts [1024]; a grid has its own.")] = None,
    starts: Starts = Distribution.neighbourhood,
    size: Size = None,
    box: Box = None,
    energy: Energy = None,
    grid: Annotated[list[str] | None, typer.Option("--grid", help="Values of a parameter, coordinate or h, name=5:15:64.")] = None,
    vary: Annotated[list[str] | None, typer.Option("--vary", help="Bounds of a random parameter, gravity=5:15.")] = None,
    case: Case = None,
    param: Param = None,
    option: Free = None,
    seed: Annotated[int, typer.Option("--seed", help="Seed of starts and parameters.")] = 0,
    points: Annotated[int, typer.Option("--points", parser=whole, help="Approximate number of stored states per member.")] = 101,
    compensated: Compensated = False,
    on_singular: OnSingular = None,
    anyway: Anyway = False,
    out: Annotated[Path | None, typer.Option("--out", help="Folder for starts.csv, ends.csv and a picture.")] = None,
    store: Store = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    tls_ca_file: TlsCaFile = None,
    tls_cert: TlsCert = None,
    tls_key: TlsKey = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> None:
    """Run one method on many starts at once, several in the vectors of each core; exit 1 if a member stops early.

    With --out or --store, members are stored piece by piece: stored members are not run again, and Ctrl-C loses little.
    """
    distribution = "grid" if grid and starts is Distribution.neighbourhood else starts.value
    asked: dict[str, Any] = {"starts": distribution, "vary": bounds("--vary", vary)}
    asked |= {"drawn": settings_of(distribution, size=size, box=box, energy=energy, grid=grid)}
    asked |= {"h": h, "t_end": t_end, "steps": steps, "members": members, "seed": seed, "points": points}
    asked |= {"case": case, "parameters": pairs("param", param or []), "options": pairs("option", option or [])}
    asked |= {"compensated": compensated, "on_singular": on_singular, "anyway": anyway}
    executors = _executors(workers, scheduler, Tls(tls_ca_file, tls_cert, tls_key), stored=bool(store or out))
    folder = Folder(out, TABLES, pictures=("bands",))
    folder.check()
    with _kept(store, out) as opened, executors.opened() as executor, bar(f"{method} on {problem}") as progress:
        result = made(problem, method=method, **asked, progress=progress, store=opened, executor=executor)
    _tell(result, _write(folder, result), as_json=as_json)
    raise typer.Exit(1 if len(result.run.failed) else 0)


def _tell(result: "Ensemble", written: list[str], *, as_json: bool) -> None:
    """Print the results, and the names of the written files."""
    if as_json:
        print_json(result.summary() | {"written": written})
    else:
        _print(result.summary(), result)
        print_written(written)


def _executors(workers: int | None, scheduler: str | None, tls: Tls, *, stored: bool) -> Executors:
    """Return the executor of the pieces of an ensemble: this process, unless others are requested."""
    if not stored and (workers is not None or scheduler is not None):
        raise BadInput("--workers and --scheduler need a stored ensemble; name a file by --store, or a folder by --out.")
    return Executors(timed=False, workers=1 if scheduler is None and workers is None else workers, scheduler=scheduler, tls=tls)


@contextmanager
def _kept(store: Path | None, out: Path | None) -> "Iterator[GridStore | None]":
    """Open the store of an ensemble for the time of a block: the named file, or the file in its folder."""
    if store is None and out is None:
        yield None
        return
    with opened(store or Path(str(out)) / "studies.db") as runs:
        yield runs


def _write(folder: Folder, result: "Ensemble") -> list[str]:
    """Write tables of starts and ends and the picture with its table; return the paths."""
    from daebench.studies.ensemble.result import draw

    if folder.out is None:
        return []
    about = {"Method": result.run.method, "Starts": result.starts, "Seed": str(result.seed)}
    with folder.described(result.ivp, about) as written:
        for name, table in zip(TABLES, (result.start_table, result.end_table), strict=True):
            with atomic(folder.out / name) as scratch:
                write_frame(scratch, table)
        draw(folder.out, "bands", result)
    return written


def _print(summary: Mapping[str, Any], result: "Ensemble") -> None:

    quantiles = summary["quantiles"]
    shown = {name: value for name, value in summary.items() if name not in ("quantiles", "failures")}
    print_summary(shown | {"failures": summary["failures"] or None, "varied": summary["varied"] or None})
    if quantiles:
        levels = list(next(iter(quantiles.values())))
        rows = [[f"max {name}", *(f"{value:.3g}" for value in row.values())] for name, row in quantiles.items()]
        print_table(["quantile over members", *levels], rows)
    for reason in summary["failures"]:
        first = next(int(i) for i in result.run.failed if result.run.reason(int(i)) == reason)
        print(f"member {first}: {result.run.failure(first)}")
