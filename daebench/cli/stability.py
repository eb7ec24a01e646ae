"""``daebench stability``: the limits of methods."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from daebench.cli import arguments
from daebench.cli.console import print_json, print_written
from daebench.cli.executors import Executors
from daebench.cli.folder import Folder
from daebench.cli.grids import asked_of, making, outdated, plan
from daebench.errors import BadInput, unknown
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.outside.read import is_outside
from daebench.records.store import opened
from daebench.runs.texts import numbers, words
from daebench.studies.grid.schedulers import Tls
from daebench.studies.stability.study import chosen

if TYPE_CHECKING:
    from daebench.records.store import Store as RunStore
    from daebench.studies.stability.extreme import Asked, Extreme


Only = Annotated[
    str | None,
    typer.Option(
        "--only", help="Some of step-limit, outcome-map, parameter-range, penalty, round-off, lost-motion; all that apply if left out."
    ),
]
Varied = Annotated[
    str | None, typer.Option("--param", help="The parameter to vary and its values, name=value,value,...; chosen if left out.")
]


def stability(
    problem: arguments.Problem,
    case: arguments.Case = None,
    methods: arguments.StudyMethods = None,
    only: Only = None,
    h: Annotated[str | None, typer.Option("--h", help="Step sizes, comma-separated; chosen by each extreme if left out.")] = None,
    param: Varied = None,
    near: Annotated[float, typer.Option("--near", help="Limit of the parameter; pictures show the distance from it.")] = 0.0,
    t_end: arguments.StudyTEnd = None,
    anyway: arguments.Anyway = False,
    on_singular: arguments.OnSingular = None,
    store: arguments.Store = None,
    out: Annotated[Path, typer.Option("--out", help="Folder for tables and pictures.")] = Path("output/stability"),
    workers: arguments.Workers = None,
    scheduler: arguments.Scheduler = None,
    tls_ca_file: arguments.TlsCaFile = None,
    tls_cert: arguments.TlsCert = None,
    tls_key: arguments.TlsKey = None,
    dry_run: arguments.DryRun = False,
    overwrite: arguments.Overwrite = False,
    as_json: arguments.Json = False,
) -> None:
    """Find where methods break: steps too large and too small, masses, penalties, chaos; runs are stored.

    The extremes are: the largest usable step by bisection (step-limit); a map of the outcomes of runs over step size and a parameter
    (outcome-map); mass ratios from 1e-8 to 1e8 or any parameter (parameter-range); a penalty in place of the constraint (penalty); steps
    and tolerances to 0 (round-off); the time for which a method follows a motion that amplifies errors (lost-motion).
    """
    runs: dict[str, Any] = {"methods": methods, "h": h, "t_end": t_end, "anyway": anyway, "on_singular": on_singular}
    asked = asked_of(problem, case, **runs, parameters=_varied(param, problem, case), near=near)
    executors = Executors(timed=False, workers=workers, scheduler=scheduler, tls=Tls(tls_ca_file, tls_cert, tls_key))
    extremes, refused = chosen(asked, words(only) if only else ())
    Folder(out, pictures=tuple(extreme.name for extreme in extremes)).check()
    status = 0
    summary: dict[str, Any] = {"said": {}, "left_out": refused, "written": []}
    with opened(store or out / "studies.db") as run_store:
        if dry_run:
            _tell_plan(extremes, asked, run_store, executors)
            raise typer.Exit
        summary["made_again"] = outdated([run for extreme in extremes for run in extreme.specifications(asked)], run_store)
        for extreme in extremes:
            summary["said"][extreme.name], path, ended = _made(extreme, asked, run_store, executors, out)
            status = max(status, int(ended))
            summary["written"].append(str(path))
            if not as_json:
                print("\n  ".join((f"{extreme.name}: {extreme.about}", *summary["said"][extreme.name])))
    _tell_rest(summary, as_json=as_json)
    raise typer.Exit(status)


def _tell_rest(summary: dict[str, Any], *, as_json: bool) -> None:
    """Print which extremes and methods were left out and why, which stored runs were made again, and the written files; or all as JSON."""
    if as_json:
        print_json(summary)
        return
    for name, why in summary["left_out"].items():
        print(f"no {name}: {why}.")
    if summary["made_again"]:
        print(summary["made_again"])
    print_written(summary["written"])


def _tell_plan(extremes: "Sequence[Extreme]", asked: "Asked", run_store: "RunStore", executors: Executors) -> None:
    plans = [
        f"{extreme.name}: {plan(extreme.specifications(asked), run_store, executors)}" for extreme in extremes
    ]  # all, or only a sentence
    print("\n".join(plans))
    if any(extreme.name == "step-limit" for extreme in extremes):
        print("step-limit makes about twenty further runs for each of these, by bisection.")


def _made(extreme: "Extreme", asked: "Asked", run_store: "RunStore", executors: Executors, out: Path) -> tuple[list[str], Path, bool]:
    """Return the findings of an extreme, its picture, and whether code from outside has no step that can be made."""
    with making(run_store, executors, f"{extreme.name} on {asked.problem}") as runs:
        table = extreme.measure(asked, runs)
    limits: Mapping[str, float] = dict(table.groupby("method")["h"].max()) if extreme.name == "step-limit" else {}
    ended = any(is_outside(str(method)) and not h > 0 for method, h in limits.items())
    return extreme.says(table), extreme.draw(out, extreme.name, table), ended


def _varied(param: str | None, problem: str, case: str | None) -> dict[str, list[float]]:
    """Return the parameter to vary and its values; refuse one that the problem does not have."""
    if param is None:
        return {}
    name, equals, values = param.partition("=")
    if not equals:
        raise BadInput(f"--param {param!r} must be of the form name=value,value,...")
    known = initial_value_problem(problem, case).parameters
    if name.strip() not in known:
        raise unknown(f"parameter of {problem}", name.strip(), known)
    return {name.strip(): numbers(f"--param {name.strip()}", values) or []}
