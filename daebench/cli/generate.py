"""``daebench generate``: a fixed-step method on a problem as code of one's own."""

from pathlib import Path
from typing import Annotated, Any

import typer

from daebench.cli.arguments import Anyway, Case, Free, Json, Method, OnSingular, Param, Precision, Problem
from daebench.cli.console import print_json, print_written
from daebench.compiler.print.languages import INTEGRATORS, listed
from daebench.runs.texts import pairs


def generate(
    problem: Problem,
    method: Method,
    h: Annotated[float, typer.Option("--h", help="Step size, s, for which the code is checked; its functions take any.")],
    out: Annotated[Path, typer.Option("--out", help="New folder for the code.")],
    language: Annotated[str, typer.Option("--language", help=f"Language: {listed(INTEGRATORS)}.")] = "c",
    precision: Precision = "float64",
    name: Annotated[str | None, typer.Option("--name", help="Beginning of all names; that of problem and method if left out.")] = None,
    case: Case = None,
    param: Param = None,
    option: Free = None,
    anyway: Anyway = False,
    on_singular: OnSingular = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace files in a folder that is there.")] = False,
    as_json: Json = False,
) -> None:
    """Write a fixed-step method on a problem as code that needs nothing but a compiler."""
    from daebench.pages.generation.run import generate as made

    asked: dict[str, Any] = {"h": h, "language": language, "precision": precision, "name": name, "case": case, "overwrite": overwrite}
    asked |= {"anyway": anyway, "on_singular": on_singular}
    code = made(problem, method, out, **asked, parameters=pairs("param", param or []), options=pairs("option", option or []))
    if as_json:
        print_json({"error": code.error, "written": [str(file) for file in code.files]})
    else:
        print_written([str(file) for file in code.files])
