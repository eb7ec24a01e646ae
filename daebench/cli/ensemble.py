"""``daebench ensemble``: one method on many starts at once."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from enum import StrEnum
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
from daebench.cli.console import bar, number, pairs, print_json, print_table
from daebench.cli.executors import Executors
from daebench.errors import BadInput
from daebench.studies.grid.tls import Tls

if TYPE_CHECKING:
    from daebench.studies.ensemble.result import Ensemble
    from daebench.studies.grid.store import Store as GridStore


class Distribution(StrEnum):
    """What starts are drawn from."""

    neighbourhood = "neighbourhood"
    liouville = "liouville"
    energy = "energy"
    grid = "grid"


Starts = Annotated[
    Distribution,
    typer.Option("--starts", help="The neighbourhood of the case, the liouville measure in a --box, the same at one energy, or a --grid."),
]

Size = Annotated[float | None, typer.Option("--size", help="Relative size of the neighbourhood [0.01].")]
Box = Annotated[list[str] | None, typer.Option("--box", help="Bounds of a coordinate, q1=-1:1; repeatable.")]
Energy = Annotated[float | None, typer.Option("--energy", help="Energy of the starts; that of the case if left out.")]

MAKER = "daebench ensemble"
"""Who made a file, as the text beside it says."""


def ensemble(
    problem: Problem,
    method: Method,
    h: Annotated[float | None, typer.Option("--h", help="Step size, s, where it is not in a --grid.")] = None,
    t_end: Annotated[float | None, typer.Option("--t-end", help="End time, s.")] = None,
    steps: Annotated[int | None, typer.Option("--steps", help="Number of steps, in its place.")] = None,
    members: Annotated[int | None, typer.Option("--members", help="Number of starts [1024]; a grid has its own.")] = None,
    starts: Starts = Distribution.neighbourhood,
    size: Size = None,
    box: Box = None,
    energy: Energy = None,
    grid: Annotated[list[str] | None, typer.Option("--grid", help="Values of a parameter, coordinate or h, name=5:15:64.")] = None,
    vary: Annotated[list[str] | None, typer.Option("--vary", help="Bounds of a parameter that is drawn, gravity=5:15.")] = None,
    case: Case = None,
    param: Param = None,
    option: Free = None,
    seed: Annotated[int, typer.Option("--seed", help="Seeds starts and parameters.")] = 0,
    points: Annotated[int, typer.Option("--points", help="States of each member that are stored, about.")] = 101,
    compensated: Compensated = False,
    on_singular: OnSingular = None,
    anyway: Anyway = False,
    out: Annotated[Path | None, typer.Option("--out", help="Folder for starts.csv, ends.csv and a picture.")] = None,
    store: Store = None,
    workers: Annotated[int | None, typer.Option("--workers", help="Processes that make pieces of it; this one if left out.")] = None,
    scheduler: Scheduler = None,
    tls_ca_file: TlsCaFile = None,
    tls_cert: TlsCert = None,
    tls_key: TlsKey = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> None:
    """Run one method on many starts at once, several in the vectors of each core; exit 1 if a member stops early.

    With --out or --store, members are kept piece by piece: what was made is not made again, and Ctrl-C loses little.
    """
    from daebench.studies.ensemble.run import ensemble as made

    _check_place(out, overwrite=overwrite)
    executors = _executors(workers, scheduler, Tls(tls_ca_file, tls_cert, tls_key), kept=bool(store or out))
    drawn = {"size": size, "box": bounds("--box", box), "E": energy, "values": _values(grid)}
    with _kept(store, out) as opened, executors.opened() as executor, bar(f"{method} on {problem}") as progress:
        asked: dict[str, Any] = {"starts": "grid" if grid else starts.value, "vary": bounds("--vary", vary)}
        asked |= {"drawn": {name: value for name, value in drawn.items() if value is not None}}
        asked |= {"h": h, "t_end": t_end, "steps": steps, "members": members, "seed": seed, "points": points}
        asked |= {"case": case, "parameters": pairs("param", param or []), "options": pairs("option", option or [])}
        asked |= {"compensated": compensated, "on_singular": on_singular, "anyway": anyway}
        result = made(problem, method=method, **asked, progress=progress, store=opened, executor=executor)
    _tell(result, out, as_json=as_json)
    raise typer.Exit(1 if len(result.run.failed) else 0)


def _tell(result: "Ensemble", out: Path | None, *, as_json: bool) -> None:
    """Write what an ensemble says to a folder, and print it."""
    summary = result.summary() | {"files": _write(out, result) or None}
    if as_json:
        print_json(summary)
    else:
        _print(summary, result)


def _executors(workers: int | None, scheduler: str | None, tls: Tls, *, kept: bool) -> Executors:
    """Return what makes the pieces of an ensemble: this process, unless another is asked for."""
    if not kept and (workers is not None or scheduler is not None):
        raise BadInput("--workers and --scheduler make pieces of an ensemble that are kept; name a file by --store, or a folder by --out.")
    return Executors(timed=False, workers=1 if scheduler is None and workers is None else workers, scheduler=scheduler, tls=tls)


@contextmanager
def _kept(store: Path | None, out: Path | None) -> "Iterator[GridStore | None]":
    """Open the store of an ensemble that is kept for the time of a block: the file that is named, or that in its folder."""
    from daebench.studies.grid.store import opened

    if store is None and out is None:
        yield None
        return
    with opened(store or Path(str(out)) / "studies.db") as runs:
        yield runs


def bounds(option: str, given: list[str] | None) -> dict[str, tuple[float, float]] | None:
    """Return bounds by name, given as name=lo:hi."""
    return {name: (lo, hi) for name, (lo, hi) in _ranges(option, given, 2).items()} or None


def _values(given: list[str] | None) -> dict[str, list[float]] | None:
    """Return values by name, given as name=lo:hi:number."""
    values = {}
    for name, (lo, hi, count) in _ranges("--grid", given, 3).items():
        if not (count >= 1 and count == int(count)):
            raise BadInput(f"--grid {name}: {count:g} must be a whole number of values, at least 1.")
        values[name] = [lo + (hi - lo) * k / max(1, int(count) - 1) for k in range(int(count))]
    return values or None


def _ranges(option: str, given: list[str] | None, parts: int) -> dict[str, list[float]]:
    """Return so many numbers by name, given as name=1:2."""
    ranges = {}
    for text in given or []:
        name, equals, numbers = text.partition("=")
        if not equals or numbers.count(":") != parts - 1:
            raise BadInput(f"{option} {text!r} must be of the form {'name=lo:hi' if parts == 2 else 'name=lo:hi:number'}.")
        ranges[name.strip()] = [number(f"{option} {name.strip()}", part) for part in numbers.split(":")]
    return ranges


def _check_place(out: Path | None, *, overwrite: bool) -> None:
    """Refuse, before the runs, a folder that cannot be written to, and files of other commands."""
    from daebench.runs import provenance
    from daebench.runs.files import make_folder

    if out is None:
        return
    make_folder(out)
    for name in FILES:
        provenance.require_own(out / name, MAKER, overwrite=overwrite)


FILES = ("starts.csv", "ends.csv")
"""Tables that are written, a row a member."""


def _write(out: Path | None, result: "Ensemble") -> list[str]:
    """Write tables of starts and ends and the picture; return the paths."""
    from daebench.runs import provenance
    from daebench.runs.csv_files import write_frame
    from daebench.runs.files import atomic
    from daebench.studies.ensemble.figure import draw

    if out is None:
        return []
    about = provenance.made_by(MAKER) | provenance.definition(result.ivp)
    about |= {"Method": result.run.method, "Starts": f"{result.starts}; seed {result.seed}"}
    for name, table in zip(FILES, (result.start_table, result.end_table), strict=True):
        with atomic(out / name) as scratch:
            write_frame(scratch, table)
        provenance.write_beside(out / name, about)
    return [*(str(out / name) for name in FILES), str(draw(out, "bands", result))]


def _print(summary: Mapping[str, Any], result: "Ensemble") -> None:
    from daebench.cli.summary import print_summary

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
