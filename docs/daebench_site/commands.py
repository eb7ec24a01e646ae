"""The command line as it describes itself: ``.. commands::`` writes every command with its arguments and options."""

import inspect
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from docutils import nodes
from sphinx.util.docutils import SphinxDirective


@dataclass(frozen=True)
class Option:
    """An argument or option.

    Parameters
    ----------
    names : tuple of str
        As it is written, with the name of its value.
    help : str
        What it is for.
    default : str
        What it is where it is left out, "required", or "".
    """

    names: tuple[str, ...]
    help: str
    default: str


@dataclass(frozen=True)
class Command:
    """One command.

    Parameters
    ----------
    name : str
        How it is called, without "daebench".
    usage : str
        The whole line.
    about : str
        What it does.
    options : list of Option
        Arguments, then options.
    """

    name: str
    usage: str
    about: str
    options: list[Option]


def commands(command_line: Any) -> list[Command]:
    """Return all commands of a command line, which is given as a group of Click commands."""
    return list(_commands(command_line, ()))


def _commands(command: Any, path: tuple[str, ...]) -> Iterator[Command]:
    inner = getattr(command, "commands", None)
    if inner is None:
        yield _described(command, " ".join(path))
        return
    for name in inner:
        yield from _commands(inner[name], (*path, name))


def _described(command: Any, name: str) -> Command:
    places = [parameter for parameter in command.params if not _is_option(parameter)]
    options = [parameter for parameter in command.params if _is_option(parameter) and parameter.name != "help"]
    needed = [f"{option.opts[0]} {_value(option)}" for option in options if option.required]
    words = ["daebench", name, *map(_value, places), *needed, *(["[OPTIONS]"] if len(options) > len(needed) else [])]
    return Command(name, " ".join(words), inspect.cleandoc(command.help or ""), [_option(parameter) for parameter in [*places, *options]])


def _is_option(parameter: Any) -> bool:
    return str(parameter.opts[0]).startswith("-")


def _value(parameter: Any) -> str:
    name = str(parameter.name).upper().replace("_", "-")
    return name if parameter.required or _is_option(parameter) else f"[{name}]"


def _option(parameter: Any) -> Option:
    flag = getattr(parameter, "is_flag", False)
    written = [*parameter.opts, *parameter.secondary_opts]
    names = tuple(name if flag else f"{name} {_value(parameter)}" for name in written) if _is_option(parameter) else (_value(parameter),)
    default = parameter.default
    note = "" if flag or default in (None, "") or callable(default) or not str(default) else f"default: {default}"
    return Option(names, parameter.help or "", "required" if parameter.required else note)


def written(command: Command) -> list[str]:
    """Return the entry of a command as reStructuredText."""
    title = f"daebench {command.name}"
    lines = [f".. _command-{command.name.replace(' ', '-')}:", "", title, "-" * len(title), "", "::", "", f"    {command.usage}", ""]
    lines += [*command.about.splitlines(), "", f".. program:: {title}", ""]
    for option in command.options:
        default = f" ({option.default})" if option.default else ""
        lines += [f".. option:: {', '.join(option.names)}", "", f"   {option.help.replace('*', chr(92) + '*')}{default}", ""]
    return lines


class Commands(SphinxDirective):
    """All commands."""

    def run(self) -> list[nodes.Node]:
        """Return a section for each command."""
        import typer

        from daebench.cli.app import app

        lines = [line for command in commands(typer.main.get_command(app)) for line in written(command)]
        return self.parse_text_to_nodes("\n".join(lines), allow_section_headings=True)


def setup(app: Any) -> None:
    """Add the directive."""
    app.add_directive("commands", Commands)
