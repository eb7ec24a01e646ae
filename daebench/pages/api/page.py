"""The page: contents, chapters, commands."""

from pathlib import Path
from typing import Any

from markupsafe import Markup

from daebench.pages.api.commands import commands
from daebench.pages.api.contents import TASKS
from daebench.pages.api.entries import Index, entry
from daebench.pages.api.markup import blocks
from daebench.pages.api.public import package, public
from daebench.pages.report import write_page

COMMAND = "daebench report all"


def paragraphs(text: str) -> Markup:
    """Return the help of a command as HTML."""
    return blocks(text, lambda name: "")


def write(out: Path, command_line: Any) -> Path:
    """Write ``out/index.html``, the reference of everything public; return its path.

    Parameters
    ----------
    out : Path
        Folder of the page; made where it is missing.
    command_line : click.Group
        The commands that are described.

    Raises
    ------
    Undocumented
        If something public has no docstring.
    Dangling
        If a docstring refers to what the page does not have.
    """
    tree = package()
    definitions = public(tree)
    index = Index({path: definition for entries in definitions.values() for path, definition in entries.items()})
    chapters = [
        (task, blocks(task.about, index.link(tree)), [entry(path, definition, index) for path, definition in definitions[task.key].items()])
        for task in TASKS
    ]
    out.mkdir(parents=True, exist_ok=True)
    return write_page("_api.html", out / "index.html", COMMAND, chapters=chapters, commands=commands(command_line), paragraphs=paragraphs)
