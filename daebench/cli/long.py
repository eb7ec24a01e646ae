"""``daebench long``: the energy error over very many steps."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from daebench.cli.arguments import OUTSIDE, Anyway, Case, Compensated, Free, Json, OnSingular, Overwrite, Param, Precision, Problem
from daebench.cli.console import bar, method_names, print_json, print_table, print_written
from daebench.cli.folder import Folder
from daebench.cli.integer import whole
from daebench.errors import BadInput, Interrupted
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.runs.files import make_folder
from daebench.runs.machine import cores
from daebench.runs.texts import pairs
from daebench.studies.grid.estimate import duration
from daebench.studies.long.ensemble import Ensemble, terminated_as_interrupted
from daebench.studies.long.findings import Findings
from daebench.studies.long.run import STRIDE, LongRun

if TYPE_CHECKING:
    from collections.abc import Sequence

    import pandas as pd

    from daebench.studies.long.ensemble import Ensemble
    from daebench.studies.long.findings import Findings

LINES = 14
"""Approximate number of printed windows; the CSV has all."""


def long(
    problem: Problem,
    methods: Annotated[str, typer.Option("--methods", "--method", help=f"Names of fixed-step methods, comma-separated; {OUTSIDE}.")],
    h: Annotated[float, typer.Option("--h", help="Step size.")],
    steps: Annotated[float, typer.Option("--steps", help="Number of steps, for example 1e8.")] = 1e8,
    case: Case = None,
    ensemble: Annotated[int, typer.Option("--ensemble", parser=whole, help="Number of starts; 16 or more can show a random walk.")] = 1,
    stride: Annotated[int | None, typer.Option("--stride", parser=whole, help="Steps between samples of the energy [16].")] = None,
    param: Param = None,
    option: Free = None,
    compensated: Compensated = False,
    precision: Precision = "float64",
    on_singular: OnSingular = None,
    anyway: Anyway = False,
    out: Annotated[Path, typer.Option("--out", help="Folder for tables, pictures and checkpoints.")] = Path("output/long"),
    workers: Annotated[int | None, typer.Option("--workers", help="Number of processes; by default one per core.")] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Print the number of steps to do and about how long they take.")] = False,
    overwrite: Overwrite = False,
    json: Json = False,
) -> None:
    """Follow the energy error over very many steps, and say whether it is bounded, a random walk, or drifts.

    Memory is bounded for any number of steps. The distinction of a random walk from a drift needs an ensemble of at least 16 starts. An
    individual drift of each start that adds a third to the spread mostly passes as a random walk with 256 starts, with an exponent of 0.51
    to 0.55, and less often with more starts. Ctrl-C and SIGTERM keep all results so far; the same command continues from there, to the same
    bits. Exit 1 if a member stops early.
    """
    given = tuple(pairs("param", param or []).items())
    named = initial_value_problem(problem, case, dict(given)).case
    shared: dict[str, Any] = {"parameters": given, "options": tuple(pairs("option", option or []).items()), "h": h}
    shared |= {"compensated": compensated, "precision": precision, "anyway": anyway, "on_singular": on_singular or ""}
    shared["stride"] = STRIDE if stride is None else stride
    specs = [LongRun(problem=problem, case=named, method=name, **shared) for name in method_names(methods)]
    ensembles = [Ensemble(spec, ensemble, _whole(steps), out / "checkpoints") for spec in specs]
    _check(out, ensembles)
    at_once = _at_once(workers, ensemble)
    with terminated_as_interrupted():
        if dry_run:
            for method_ensemble in ensembles:
                _tell_duration(method_ensemble, at_once)
            raise typer.Exit
        results = [_followed(group, at_once, out, json=json) for group in ensembles]
    if json:
        print_json({"runs": [findings.plain() for findings in results]})
    raise typer.Exit(1 if any(findings.failures for findings in results) else 0)


def _check(out: Path, ensembles: "Sequence[Ensemble]") -> None:
    """Refuse, before the runs, checkpoints of other runs and files that the command did not write."""
    for ensemble in ensembles:
        ensemble.check()
    stems = tuple(ensemble.stem for ensemble in ensembles)
    Folder(out, tuple(f"{stem}-members.csv" for stem in stems), stems).check()
    make_folder(out / "checkpoints")


def _followed(ensemble: "Ensemble", workers: int, out: Path, *, json: bool) -> "Findings":
    """Run an ensemble and show its results; an interruption shows the results so far."""
    spec = ensemble.spec
    with bar(f"{spec.method} on {spec.problem}") as progress:
        try:
            ensemble.run(workers, progress)
        except KeyboardInterrupt as stop:
            progress.close()
            if not json and ensemble.kept():
                _print(Findings(ensemble, ensemble.kept()))
            part = f"{100 * ensemble.done():.3g} % of {spec.method} on {spec.problem} is stored in {ensemble.folder}"
            raise Interrupted(f"interrupted; {part}: the same command continues from there.") from stop
    findings = Findings(ensemble, ensemble.kept())
    path = findings.write(out)
    if not json:
        _print(findings)
        if path:
            print_written((path.with_suffix(".csv"), path))
    return findings


def _print(findings: "Findings") -> None:
    if len(findings.table):
        _print_windows(findings.table, findings.name)
    print(findings.verdict)
    for number, why in findings.failures.items():
        print(f"member {number}: {why} Its windows so far are stored.")


def _print_windows(table: "pd.DataFrame", title: str) -> None:
    """Print about equidistant windows, including the last one."""
    spacing = max(1, len(table) // LINES)
    shown = table.iloc[(len(table) - 1) % spacing :: spacing].dropna(axis=1, how="all")
    rows = [[str(value) if name == "members" else f"{value:.3g}" for name, value in row.items()] for row in shown.to_dict("records")]
    print_table(list(shown.columns), rows, title)


def _tell_duration(ensemble: "Ensemble", workers: int) -> None:
    """Print the number of steps to do, and about how long they take, estimated from a short trial."""
    left = round((1 - ensemble.done()) * ensemble.members * ensemble.steps)
    rate, failure = ensemble.trial()
    lasts = f"a trial stopped early: {failure}" if failure else f"in about {duration(left / rate / workers)}."
    print(f"{ensemble.spec.method}: {ensemble.members} x {ensemble.steps} steps, {left} of them to do; {lasts}")


def _whole(steps: float) -> int:
    """Return a number of steps, which may have the form 1e8."""
    if not (steps >= 1 and steps == steps // 1 and steps <= 2.0**53):
        raise BadInput(f"--steps {steps:g} must be a whole number from 1 to 2^53.")
    return int(steps)


def _at_once(workers: int | None, members: int) -> int:
    """Return the number of parallel processes."""
    if workers is not None and workers < 1:
        raise BadInput(f"--workers {workers} must be at least 1.")
    return min(workers or cores(), max(1, members))
