"""``daebench report``: a page that is computed as it is written."""

from pathlib import Path
from typing import Annotated

import typer

from daebench.cli.console import bar
from daebench.errors import unknown


def report(
    name: Annotated[str, typer.Argument(help="Name of a report, for example index-reduction.")],
    out: Annotated[Path, typer.Option("--out", help="Folder to write to.")] = Path("output"),
) -> None:
    """Write a report: one HTML page, its figures as SVG and PNG, and every figure's data as CSV."""
    from daebench.catalogue import reports

    if name not in reports():
        raise unknown("report", name, reports())
    from daebench.files import make_folder
    from daebench.report import build

    make_folder(out)

    with bar(f"report {name}") as progress:
        page = build(name, out, progress)
    print(f"written: {page}")
