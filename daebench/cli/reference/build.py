"""``daebench reference build``: from a definition to a certified reference."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from daebench.cli.arguments import Json
from daebench.cli.console import bar, print_written
from daebench.cli.reference.arguments import Name
from daebench.errors import BadInput

Out = Annotated[
    Path | None,
    typer.Option("--out", "--folder", help="Folder of references to write to; your own if left out.", show_default=False),
]


def build(
    name: Name,
    t_end: Annotated[float, typer.Option("--t-end", help="Last output, s; the horizon may be earlier.")] = 100.0,
    spacing: Annotated[int, typer.Option("--spacing", help="Outputs per second, a power of two.")] = 8,
    folder: Out = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace an existing reference.")] = False,
    as_json: Json = False,
) -> None:
    """Make, certify and store a reference; needs the extra certify. After an interruption, the same command continues."""
    from daebench.reference.make.build import build as made

    overwrite = overwrite or _agreed(name, folder)
    with bar(f"reference {name}") as progress:
        stored = made(name, folder=folder, t_end=t_end, spacing=spacing, overwrite=overwrite, progress=progress)
    print_written([stored], as_json=as_json, reference=name)


def _agreed(name: str, folder: Path | None) -> bool:
    """Return whether an existing reference may be overwritten; the question is asked only at a terminal."""
    from daebench.reference.make.build import taken

    where = taken(name, folder)
    if where is None:
        return False
    if not sys.stdin.isatty():
        raise BadInput(f"{name} is already in {where}; add --overwrite to replace it.", "reference-already-there")
    if not typer.confirm(f"{name} is already in {where}. Replace it?", err=True):
        raise BadInput(f"{name} was not changed.", "reference-left-unchanged")
    return True
