"""What the page for people from other tools calls by a name of daebench has this name: classes, options, commands and methods."""

import re

import pytest
import typer
from daebench_site.commands import commands
from said import DOCS

import daebench
from daebench import joints
from daebench.cli.app import app
from daebench.methods.names import parse

ROWS = re.findall(r"^\|[^|]*\|([^|]*)\|", (DOCS / "how-to" / "coming-from.md").read_text(encoding="utf-8"), re.MULTILINE)
NAMES = sorted({name for cell in ROWS for name in re.findall(r"`([^`]+)`", cell)})
"""Names in the second column of the tables."""

METHODS = [name for name in NAMES if re.match(r"(ida:[a-z]|cvode:|solve_dae:|rattle|shake)", name)]
CLASSES = [name for name in NAMES if re.match(r"[A-Z][a-z]", name)]


def test_the_page_has_names_of_each_kind():
    assert len(NAMES) > 50
    assert len(METHODS) > 8
    assert len(CLASSES) > 15


@pytest.mark.parametrize("name", METHODS)
def test_a_method_is_one(name):
    assert parse(name)


def test_classes_are_public():
    names = [re.match(r"\w+", name)[0] for name in CLASSES]
    assert [name for name in names if not (hasattr(daebench, name) or hasattr(joints, name))] == []


def test_options_and_commands_are_those_of_the_command_line():
    listed = commands(typer.main.get_command(app))
    options = {word for command in listed for option in command.options for name in option.names for word in name.split()}
    assert [name for name in NAMES if name.startswith("--") and name.split()[0] not in options] == []
    own = {command.name for command in listed}
    assert [name for name in NAMES if name.startswith("daebench ") and name not in own and name.removeprefix("daebench ") not in own] == []
