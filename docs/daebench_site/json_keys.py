"""The keys of what commands print with ``--json``, kept in ``json_keys.toml``: ``.. json-keys::`` writes a table for each command."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx.util.docutils import SphinxDirective

from daebench_site.tables import written

FILE = Path(__file__).with_suffix(".toml")
"""Where the keys are described."""

COMMON = "common"
"""Table of the keys that several commands print with one meaning."""


START = "start"
"""Table of the keys that every command prints which takes a start of one's own, and of these commands."""


@dataclass(frozen=True)
class Key:
    """One key of a JSON object.

    Parameters
    ----------
    path : str
        Keys from the object that is printed down to this one, with dots; ``[]`` stands for each entry of a list, ``*`` for each key of an
        object whose keys are names.
    types : tuple of str
        JSON types of the value: "string", "number", "integer", "boolean", "null", "object", "list", "list of numbers", and so on.
    unit : str
        Unit of the numbers; "" where they have none.
    meaning : str
        What the value is, in the markup of docstrings.
    optional : bool
        Whether the key is printed only under the condition that the meaning names.
    """

    path: str
    types: tuple[str, ...]
    unit: str
    meaning: str
    optional: bool


@dataclass(frozen=True)
class Printed:
    """What one command prints.

    Parameters
    ----------
    name : str
        The command without "daebench", and the options that make it print this.
    about : str
        What the object is.
    keys : tuple of Key
        Its keys.
    """

    name: str
    about: str
    keys: tuple[Key, ...]


def documented(file: Path = FILE) -> dict[str, Printed]:
    """Return what the commands print, by command.

    Raises
    ------
    KeyError
        If a command names a common key that is not there.
    ValueError
        If an entry is no list of path, type, unit and meaning.
    """
    tables = tomllib.loads(file.read_text(encoding="utf-8"))
    common = {name: (name, *rest) for name, rest in tables.pop(COMMON).items()}
    start = tables.pop(START)
    for name in start["commands"]:
        tables[name]["keys"] += start["keys"]
    return {name: Printed(name, table["about"], tuple(_key(entry, common) for entry in table["keys"])) for name, table in tables.items()}


def _key(entry: str | list[str], common: Mapping[str, tuple[str, ...]]) -> Key:
    path, types, unit, meaning = common[entry] if isinstance(entry, str) else entry
    return Key(path.removesuffix("?"), tuple(types.split(" or ")), unit, meaning, path.endswith("?"))


def lines(printed: Printed) -> list[str]:
    """Return the section of a command as reStructuredText."""
    title = f"daebench {printed.name}"
    rows = [("key", "type", "unit", "meaning")]
    rows += [
        (f"``{key.path}``" + (" (optional)" if key.optional else ""), " or ".join(key.types), key.unit, key.meaning) for key in printed.keys
    ]
    anchor = f".. _json-{'-'.join(printed.name.replace('--', '').split())}:"
    return [anchor, "", title, "-" * len(title), "", printed.about, "", *written(rows), ""]


class JsonKeys(SphinxDirective):
    """The tables of all commands."""

    def run(self) -> list[nodes.Node]:
        """Return a section for each command."""
        self.env.note_dependency(str(FILE))
        text = [line for printed in documented().values() for line in lines(printed)]
        return self.parse_text_to_nodes("\n".join(text), allow_section_headings=True)


def setup(app: Any) -> None:
    """Add the directive."""
    app.add_directive("json-keys", JsonKeys)
