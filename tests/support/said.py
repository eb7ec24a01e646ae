"""What a reader of the README has and does: its files and commands, and what daebench says when it says no."""

import os
import re
import shlex
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from readme import README

FILES = ("bead.py", "body.py", "mine.py", "faulty.py", "my_report.py")
"""Files that the README shows whole."""


@dataclass(frozen=True)
class Trouble:
    """A command of the README with the cache directory it names, if any, and what it is said to say."""

    words: tuple[str, ...]
    message: str
    cache: str = ""


def block(marker, language="python"):
    """Return the code below a marker of the README."""
    text = README.read_text(encoding="utf-8")
    return re.search(rf"<!-- {re.escape(marker)} -->\n```{language}\n(.*?)```", text, re.DOTALL)[1]


def troubles():
    """Return the rows of the README's table of messages."""
    text = README.read_text(encoding="utf-8").partition("## When it says no")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| `(?:DAEBENCH_CACHE=(\S+) )?daebench (.*?)` \| (.*?) \| .*? \|$", text, re.MULTILINE)
    return [Trouble(tuple(shlex.split(command)), message.replace("\\|", "|"), cache) for cache, command, message in rows]


def commands():
    """Return the commands of the README's blocks, in their order, but for those below a marker."""
    blocks = re.findall(r"(?<!-->\n)^```sh\n(.*?)^```", README.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    return [line for each in blocks for line in each.splitlines()]


def printed_by(command):
    """Return what the README shows that a command prints, None where it shows nothing."""
    shown = re.search(rf"^{re.escape(command)}\n```\n\n```text\n(.*?)^```", README.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    return shown and shown[1]


def programs():
    """Return the Python programs of the README, but for those below a marker, which are files."""
    text = README.read_text(encoding="utf-8")
    return re.findall(r"(?<!-->\n)^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


def write_files(folder):
    """Write the files that the README shows, and make the others as it says."""
    for name in FILES:
        (folder / name).write_text(block(name), encoding="utf-8")
    call(block("mistakes", "sh"), folder)


def call(command, folder):
    """Return the completed call of a command line in a folder, with daebench and python those of the tests."""
    tools = folder / "tools"
    tools.mkdir(exist_ok=True)
    for name, what in (("daebench", "-m daebench"), ("python", "")):
        tool = tools / name
        tool.write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} {what} "$@"\n', encoding="utf-8")
        tool.chmod(0o755)
    source = str(Path(__file__).parents[2])
    path = {"PATH": f"{tools}{os.pathsep}{os.environ['PATH']}", "PYTHONPATH": source}
    return subprocess.run(["sh", "-ec", command], cwd=folder, env=os.environ | path, capture_output=True, text=True, check=False)
