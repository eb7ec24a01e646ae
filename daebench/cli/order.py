"""``daebench order``: the orders of methods, measured component by component."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from daebench.cli.arguments import Anyway, Case, Free, Json, Methods, OnSingular, Overwrite, Param, Problem
from daebench.cli.console import bar, method_names, print_json, print_table, print_written
from daebench.cli.folder import Folder
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.names import methods_of
from daebench.runs.texts import pairs

if TYPE_CHECKING:
    from daebench.studies.orders.series import OrderStudy, Series


def order(
    problem: Problem,
    methods: Methods,
    case: Case = None,
    t_end: Annotated[float | None, typer.Option("--t-end", help="End time T; some 256 steps of DOP853 at 1e-13 if left out.")] = None,
    h: Annotated[float | None, typer.Option("--h", help="Largest step size, rounded to T/(8 n); by the claimed order if left out.")] = None,
    halvings: Annotated[int | None, typer.Option("--halvings", help="Number of halvings; until round-off if left out.")] = None,
    param: Param = None,
    option: Free = None,
    anyway: Anyway = False,
    on_singular: OnSingular = None,
    out: Annotated[Path | None, typer.Option("--out", help="Write the tables and the picture to a folder.")] = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> None:
    """Measure the orders of methods; exit 1 if a method fails at every step size.

    Errors of q, p, lam and stage multipliers are measured separately; for a Poisson system, errors of y.

    Errors are Euclidean norms, the largest over t = T k/8, k = 1..8.
    """
    from daebench.studies.orders.study import study

    chosen = method_names(methods)

    Folder(out, ("orders.csv",), pictures=("order",)).check()
    ivp = initial_value_problem(problem, case, pairs("param", param or []), on_singular=on_singular)
    given = methods_of(ivp, chosen, pairs("option", option or []), anyway=anyway)
    with bar(f"order on {problem}") as progress:
        result = study(ivp, given, t_end=t_end, h=h, halvings=halvings, began=progress)
    if as_json:
        print_json(_everything(result))
    else:
        _print(result)
    if out is not None:
        _write(out, result, tell=not as_json)
    raise typer.Exit(1 if any(all(point.failure for point in series.points) for series in result.series) else 0)


def _print(result: "OrderStudy") -> None:
    columns = ("method", "component", "claimed", "order", "standard error", "points", "dropped", "note")
    print_table(columns, [_line(series) for series in result.series])
    where = f"{result.ivp.problem}, case {result.ivp.case}, T = {result.t_end:g}"
    bounds = ", ".join(f"{name} {bound:.1e}" for name, bound in result.reference_solution.bound.items())
    print(f"{where}: largest Euclidean norm of the error over t = T k/8, k = 1..8.")
    print(f"Reference: {result.reference_solution.kind}, good for {bounds}.")
    failures = {point.failure: None for series in result.series for point in series.points if point.failure}
    for failure in failures:
        print(failure)


def _line(series: "Series") -> list[str]:
    fit, known = series.fit, series.fit.slope == series.fit.slope
    claimed = "" if series.claimed is None else str(series.claimed)
    measured = [f"{fit.slope:.3f}", f"{fit.slope_error:.1g}"] if known else ["", ""]
    used = f"{sum(fit.used)}/{len(fit.used)}"
    return [series.method, series.component, claimed, *measured, used, series.reasons, fit.note]


def _everything(result: "OrderStudy") -> dict[str, Any]:
    """Return all measurements."""
    return {
        "problem": result.ivp.problem,
        "case": result.ivp.case,
        "parameters": dict(result.ivp.parameters),
        "t_end": result.t_end,
        "times": result.reference_solution.t,
        "error": "largest Euclidean norm over the times",
        "reference": {"kind": result.reference_solution.kind, "bound": dict(result.reference_solution.bound)},
        "series": [_series(series) for series in result.series],
    }


def _series(series: "Series") -> dict[str, Any]:
    labels = ("method", "component")
    points = [{name: value for name, value in row.items() if name not in labels} for row in series.rows()]
    return series.row() | {"dropped": series.dropped, "floor": series.floor, "points": points}


def _write(out: Path, result: "OrderStudy", *, tell: bool) -> None:
    from daebench.studies.orders.figure import write

    paths = write(out, result)
    if tell:
        print_written(paths)
