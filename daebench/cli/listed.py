"""``python -m daebench.cli.listed``: the list of commands, written again from their docstrings."""

import importlib
import inspect
from importlib.resources import files
from pathlib import Path

from daebench.cli.commands import LIST, NAMES, SEPARATOR, lines, loaded
from daebench.runs.result import Result


def listed() -> str:
    """Return the text of the list: the commands there, and after them public functions that are studies and not yet there."""
    names = [*lines(), *(name for name in studies() if name not in (*lines(), *NAMES.values()))]
    return "".join(f"{name}{SEPARATOR}{loaded(name).help.partition(chr(10) * 2)[0]}\n" for name in names)


def studies() -> list[str]:
    """Return the names, as of commands, of public functions that return a result that a command prints."""
    public = importlib.import_module("daebench")
    functions = [name for name in dir(public) if inspect.isfunction(getattr(public, name))]
    results = {name: inspect.signature(inspect.unwrap(getattr(public, name))).return_annotation for name in functions}
    return [name.replace("_", "-") for name, kind in results.items() if isinstance(kind, type) and issubclass(kind, Result)]


if __name__ == "__main__":
    Path(str(files("daebench.cli").joinpath(LIST))).write_text(listed(), encoding="utf-8")
