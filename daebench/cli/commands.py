"""Commands by name: each is loaded when it is called, and ``--help`` reads their list with one line each from ``commands.txt``."""

import importlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from importlib.resources import files
from importlib.util import find_spec
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

LIST = "commands.txt"
"""The list beside this file. ``python -m daebench.cli.listed`` writes it again, with commands that are new at its end."""

SEPARATOR = ": "

NAMES = {"list": "listing", "animate": "animation", "import": "importing", "open": "opening"}
"""Modules and public functions that are not called as their command: two would hide names of Python's own, one is a word of the
language, and one is a noun."""


class Command(TyperCommand):
    """A command that, while it runs, is named as the writer of files, see :mod:`daebench.runs.outputs`."""

    def invoke(self, ctx: Any) -> Any:
        """Call the command."""
        from daebench.runs.outputs import writing

        with writing(_words(ctx), overwrite=bool(ctx.params.get("overwrite"))):
            return super().invoke(ctx)


def _words(ctx: typer.Context) -> str:
    """Return a command as it is called, for example "daebench reference export"."""
    words: list[str] = []
    while ctx.parent is not None:
        words.insert(0, str(ctx.info_name))
        ctx = ctx.parent  # type: ignore[assignment]
    return " ".join(["daebench", *words])


@cache
def lines() -> Mapping[str, str]:
    """Return the line of each command, by name."""
    text = files("daebench.cli").joinpath(LIST).read_text(encoding="utf-8")
    return dict(line.split(SEPARATOR, 1) for line in text.splitlines())


@cache
def loaded(name: str) -> Any:
    """Return a command: that of the module of its name in this package, or else that of the public function of its name."""
    word = NAMES.get(name, name.replace("-", "_"))
    app = typer.Typer(add_completion=False)
    if find_spec(f"daebench.cli.{word}") is None:
        from daebench.cli.signature import command_of

        app.command(name, cls=Command)(command_of(getattr(importlib.import_module("daebench"), word)))
    else:
        module = importlib.import_module(f"daebench.cli.{word}")
        if hasattr(module, "app"):
            return typer.main.get_command(module.app)
        app.command(name, cls=Command)(getattr(module, word))
    return typer.main.get_command(app)


class Loaded(Mapping[str, Any]):
    """All commands, each loaded when it is asked for."""

    def __getitem__(self, name: str) -> Any:
        if name not in lines():
            raise KeyError(name)
        return loaded(name)

    def __iter__(self) -> Iterator[str]:
        return iter(lines())

    def __len__(self) -> int:
        return len(lines())


class Commands(TyperGroup):
    """The group of all commands, which loads none of them for its own help."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self.commands: Any = Loaded()

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names of all commands."""
        return list(self.commands)

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Print the help, with the line of each command."""
        with self._unloaded():
            super().format_help(ctx, formatter)

    def shell_complete(self, ctx: Any, incomplete: str) -> Any:
        """Return names of commands that begin with a text."""
        with self._unloaded():
            return super().shell_complete(ctx, incomplete)

    @contextmanager
    def _unloaded(self) -> Iterator[None]:
        """Have a line in place of each command."""
        self.commands = {name: TyperCommand(name, help=line) for name, line in lines().items()}
        try:
            yield
        finally:
            self.commands = Loaded()
