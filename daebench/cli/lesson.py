"""``daebench lesson``: an interactive lesson, as a page that is opened in the browser."""

from pathlib import Path
from typing import Annotated

import typer

from daebench.cli.arguments import Case, Json, Overwrite
from daebench.cli.completion import problem_names
from daebench.cli.console import bar, print_json, print_table, print_written
from daebench.cli.opening import Browser, show
from daebench.errors import BadInput
from daebench.methods.catalogue import lessons
from daebench.pages import gallery
from daebench.pages.report.gallery import put


def lesson(
    name: Annotated[str | None, typer.Argument(help="Name of a lesson, for example why-symplectic; without it, all are listed.")] = None,
    problem: Annotated[
        str | None,
        typer.Option(
            "--problem",
            help="Write why-symplectic on this problem: its name, or the path of a file of yours, which is executed.",
            autocompletion=problem_names,
        ),
    ] = None,
    case: Case = None,
    h: Annotated[float | None, typer.Option("--h", help="Step size of the page at first; from the problem if left out.")] = None,
    export: Annotated[Path, typer.Option("--export", help="Folder below which the page is written.")] = Path("output"),
    browser: Browser = True,
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> None:
    """Write a lesson and open it: sliders, pictures that respond to them, questions with answers, and a notebook to go on from."""
    if name is None:
        if as_json:
            print_json({"lessons": [{"name": name, "about": about} for name, about in lessons().items()]})
        else:
            print_table(["name", "about"], [list(entry) for entry in lessons().items()], "lessons")
        return

    if problem is None and (case is not None or h is not None):
        raise BadInput("--case and --h belong to a problem; add --problem NAME or --problem ./FILE.py.", "lesson-option-needs-problem")
    page = gallery.lesson_page(name, gallery.Asked(problem, case, h) if problem is not None else None)
    with bar(f"lesson {name}") as progress:
        written = put(page, export, progress)
    print_written([written], as_json=as_json)
    if browser and not as_json:
        show(written.resolve().as_uri())
