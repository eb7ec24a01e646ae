"""Arguments that several commands on references take."""

from pathlib import Path
from typing import Annotated

import typer

from daebench.reference.keep import form

Name = Annotated[str, typer.Argument(help="Name of a reference, PROBLEM-CASE.")]
Folder = Annotated[
    Path | None,
    typer.Option("--folder", help="Folder of references; those of daebench, and your own, if left out.", show_default=False),
]


def whose(place: Path) -> str:
    """Return the owner of the references of a folder: daebench, or the folder."""
    return "daebench" if place == form.DATA else str(place)
