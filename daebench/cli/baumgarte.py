"""``daebench baumgarte``: stabilised and soft constraints over their parameters."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from daebench.cli.arguments import Case, Json, OnSingular, Overwrite, Param, Problem
from daebench.cli.console import bar, methods_if_given, numbers, pairs, print_json, print_table, print_written
from daebench.cli.folder import Folder

if TYPE_CHECKING:
    from daebench.studies.baumgarte.cells import Cell
    from daebench.studies.baumgarte.run import BaumgarteMap


def baumgarte(
    problem: Problem,
    case: Case = None,
    param: Param = None,
    h: Annotated[float | None, typer.Option("--h", help="Step size, s; a small part of the motion if left out.")] = None,
    t_end: Annotated[float, typer.Option("--t-end", help="End of the runs, s.")] = 10.0,
    methods: Annotated[
        str | None,
        typer.Option(
            "--methods",
            "--method",
            help="Schemes to map, for example rk4 or gauss2, and fixed-step methods beside them, for example rattle.",
        ),
    ] = None,
    tol: Annotated[str | None, typer.Option("--tol", help="Tolerances of IDA, comma-separated [1e-6,1e-9].")] = None,
    on_singular: OnSingular = None,
    out: Annotated[Path | None, typer.Option("--out", help="Folder for the picture and the table of all runs.")] = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> None:
    """Map the effect of stabilisation on energy, constraints and cost, and the limits of stability.

    The maps are over Baumgarte's alpha and beta times the step, soft constraints with the same roots, and a penalty; for IDA over alpha,
    beta and the tolerance.
    """
    from daebench.studies.baumgarte.run import SCHEMES, TOLERANCES
    from daebench.studies.baumgarte.run import baumgarte as made

    folder = Folder(out, pictures=("baumgarte",))
    folder.check()
    asked: dict[str, Any] = {
        "methods": methods_if_given(methods) or (*SCHEMES, "rattle"),
        "tolerances": numbers("--tol", tol) or TOLERANCES,
        "on_singular": on_singular,
    }
    with bar(f"runs on {problem}") as progress:
        found = made(problem, case=case, parameters=pairs("param", param or []), h=h, t_end=t_end, progress=progress, **asked)
    written = _write(folder, found)
    if as_json:
        print_json(found.summary() | {"written": written})
        return
    _print(found)
    print_written(written)


def _write(folder: Folder, found: "BaumgarteMap") -> list[str]:
    """Write the picture, with the table of runs beside it; return the paths."""
    if folder.out is None:
        return []
    from daebench.studies.baumgarte.figure import draw

    with folder.described(found.ivp, {}) as written:
        draw(folder.out, found)
    return written


def _print(found: "BaumgarteMap") -> None:
    print(found.answer)
    rows = []
    for effect in found.effects:
        rows += [
            _row(effect.scheme, "none", effect.without, effect.drift_without.verdict),
            _row("", _numbers(effect.usual), effect.usual, effect.drift_usual.verdict),
            _row("", _numbers(effect.least), effect.least, "least energy error"),
            _row("", _numbers(effect.most), effect.most, "most, where stable"),
        ]
    rows += [_row(one.method, "", one, "") for one in found.beside]
    print_table(["method", "alpha, beta 1/s", "energy error", "|g|", "|G v|", "work", "energy"], rows)
    limits = [[one.scheme, f"{one.ratio:g}", _bounded(one.predicted), _bounded(one.measured), one.by or "none"] for one in found.limits]
    print_table(["method", "beta / alpha", "limit of alpha h, predicted", "measured", "by"], limits)


def _numbers(one: "Cell") -> str:
    return ", ".join(f"{x:.3g}" for x in one.options.values())


def _bounded(x: float) -> str:
    return "none" if x == float("inf") else f"{x:.4g}"


def _row(method: str, options: str, one: "Cell", note: str) -> list[str]:
    return [method, options, *(f"{x:.2g}" for x in (one.energy, one.g, one.Gv)), str(one.work), note]
