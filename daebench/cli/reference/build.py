"""``daebench reference build``: from a definition to a certified reference."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from daebench.cli.console import bar
from daebench.cli.reference.arguments import Name
from daebench.errors import BadInput

Out = Annotated[
    Path | None,
    typer.Option("--out", "--folder", help="Folder of references to write it to; that of your own if left out.", show_default=False),
]


def build(
    name: Name,
    t_end: Annotated[float, typer.Option("--t-end", help="Last output, s; the horizon may come before.")] = 100.0,
    spacing: Annotated[int, typer.Option("--spacing", help="Outputs a second, a power of two.")] = 8,
    folder: Out = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Write it in place of the one that is there.")] = False,
) -> None:
    """Make, certify and store a reference; needs the extra certify. Interrupted, it goes on where it stopped when called again."""
    from daebench.reference.make.build import build as made

    overwrite = overwrite or _agreed(name, folder)
    with bar(f"reference {name}") as progress:
        stored = made(name, folder=folder, t_end=t_end, spacing=spacing, overwrite=overwrite, progress=progress)
    print(f"written: {stored}")


def _agreed(name: str, folder: Path | None) -> bool:
    """Return whether the reference that is there may be overwritten; only a person at a terminal is asked."""
    from daebench.reference.make.build import taken

    where = taken(name, folder)
    if where is None:
        return False
    if not sys.stdin.isatty():
        raise BadInput(f"{name} is in {where} already; add --overwrite to write a new one in its place.")
    if not typer.confirm(f"{name} is in {where} already. Write a new one in its place?", err=True):
        raise BadInput(f"{name} was left as it is.")
    return True
