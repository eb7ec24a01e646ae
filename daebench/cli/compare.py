"""``daebench compare``: several methods on one scene."""

from pathlib import Path
from typing import Annotated

import typer

from daebench.cli.arguments import Algebra, Anyway, Case, Free, OnSingular, Param, Problem, Project
from daebench.cli.console import bar, method_names, pairs, print_table

HIDDEN = ("failure", "seconds", "h", "tol")
"""Columns of a comparison that are in its file and not on the screen; nor are the counts of work."""


def compare(
    problem: Problem,
    methods: Annotated[str, typer.Option("--methods", help="Names of methods, comma-separated.")],
    t_end: Annotated[float, typer.Option("--t-end", help="End time.")],
    case: Case = None,
    h: Annotated[float | None, typer.Option("--h", help="Step size of the fixed-step methods.")] = None,
    tol: Annotated[float, typer.Option("--tol", help="Tolerance of the tolerance-driven methods.")] = 1e-8,
    param: Param = None,
    option: Free = None,
    project: Project = False,
    on_singular: OnSingular = None,
    algebra: Algebra = "",
    anyway: Anyway = False,
    out: Annotated[Path | None, typer.Option("--out", help="Write the table and the pictures, with their data, to a folder.")] = None,
) -> None:
    """Compare methods on one problem: energy, manifold or Casimir functions, integrals, work and time; exit 1 if one stops early."""
    import pandas as pd

    from daebench.api import setting_of, singular_as
    from daebench.comparison import row, trajectories
    from daebench.files import make_folder
    from daebench.kinds import methods_of

    wanted = method_names(methods)
    if out is not None:
        make_folder(out)
    scene = singular_as(setting_of(problem, case, pairs("param", param or []), project=project, algebra=algebra), on_singular)
    chosen = methods_of(scene, wanted, pairs("option", option or []), anyway=anyway)
    with bar(f"compare on {problem}") as progress:
        names = [method.name for method in chosen]
        found = trajectories(
            scene, chosen, h=h, tol=tol, t_end=t_end, began=lambda name: progress(names.index(name) / len(names), f"{name} on {problem}")
        )
    table = pd.DataFrame([row(scene, each) for each in found])
    shown = table[[name for name in table.columns if name not in HIDDEN and not name.startswith("n_")]].dropna(axis=1, how="all")
    print_table(
        list(shown.columns),
        [[_cell(name, value) for name, value in zip(shown.columns, line, strict=True)] for line in shown.itertuples(index=False)],
    )
    for each in found:
        if each.failure:
            print(each.failure)
    if out is not None:
        from daebench.comparison_figure import write

        print(f"written: {', '.join(str(path) for path in write(out, scene, found, table))}")
    raise typer.Exit(1 if any(each.failure for each in found) else 0)


def _cell(column: str, value: object) -> str:
    if isinstance(value, float):
        return "" if value != value else f"{value:.9g}" if column == "t_reached" else f"{value:.3g}"
    return str(value)
