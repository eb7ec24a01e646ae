"""``daebench reference build``: from a definition to a certified reference."""

from typing import Annotated

import typer

from daebench.cli.console import bar
from daebench.cli.reference.arguments import Folder, Name, place


def build(
    name: Name,
    t_end: Annotated[float, typer.Option("--t-end", help="Last output, s; the horizon may come before.")] = 100.0,
    spacing: Annotated[int, typer.Option("--spacing", help="Outputs a second, a power of two.")] = 8,
    folder: Folder = None,
) -> None:
    """Make, certify and store a reference; needs the extra certify. Interrupted, it goes on where it stopped when called again."""
    from daebench.reference.certified.build import build as made

    with bar(f"reference {name}") as progress:
        stored = made(name, folder=place(folder), t_end=t_end, spacing=spacing, progress=progress)
    print(f"written: {stored}")
