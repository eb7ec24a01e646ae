"""``daebench lesson``: an interactive lesson, in the browser or as a page."""

from pathlib import Path
from typing import Annotated

import typer

from daebench.cli.arguments import Json, Overwrite
from daebench.cli.console import bar, print_json, print_table, print_written
from daebench.errors import BadInput


def lesson(
    name: Annotated[str | None, typer.Argument(help="Name of a lesson, for example why-symplectic; without it, all are listed.")] = None,
    port: Annotated[int | None, typer.Option("--port", help="Port of 127.0.0.1; any free port if left out.")] = None,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Whether the browser is opened.")] = True,
    export: Annotated[Path | None, typer.Option("--export", help="Write a static page below this folder instead.")] = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> None:
    """Open a lesson in the browser: sliders, pictures that respond to them, questions with answers.

    The address has a token, and works only on this machine. The server ends with Ctrl-C, and with the program that started it.
    """
    if name is None:
        from daebench.methods.catalogue import lessons

        if as_json:
            print_json({"lessons": [{"name": name, "about": about} for name, about in lessons().items()]})
        else:
            print_table(["name", "about"], [list(entry) for entry in lessons().items()], "lessons")
        return
    if export is None:
        if as_json:
            raise BadInput(f"--json prints which files were written; add --export FOLDER, or leave {name} out for a list.")
        from daebench.pages.lesson.serve import serve

        serve(name, port, browser=browser)
        return
    from daebench.pages.gallery import lesson_page
    from daebench.pages.report.gallery import put

    page = lesson_page(name)
    with bar(f"lesson {name}") as progress:
        written = put(page, export, progress)
    print_written([written], as_json=as_json)
