"""Arguments that several commands on references take."""

from pathlib import Path
from typing import Annotated

import typer

Name = Annotated[str, typer.Argument(help="Name of a reference, PROBLEM-CASE.")]
Folder = Annotated[
    Path | None,
    typer.Option("--folder", help="Folder of references; daebench's own if left out.", show_default=False),
]


def place(folder: Path | None) -> Path:
    """Return the folder of references that is meant."""
    from daebench.reference.certified.store import DATA

    return DATA if folder is None else folder
