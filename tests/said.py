"""What the README quotes, and where: blocks of code below a marker, and what daebench says when it says no."""

import re
import shlex
import sqlite3
from dataclasses import dataclass

from readme import README

MISTAKES = {
    "undeclared.py": ("parameters={a: steepness, gamma: gravity}", "parameters={a: steepness}"),
    "kinked.py": ("a * q[0] ** 2", "a * sp.Abs(q[0])"),
    "off.py": ("q=(-1, a)", "q=(-1, 2 * a)"),
    "mistyped.py": ("gravity: float = 9.81", "gravity = 9.81"),
}
"""Problem files that the README's mistakes are in: the bead, with one thing replaced."""

BRACKET = '''"""A body whose bracket is none."""

import sympy as sp

from daebench import PoissonCase, PoissonSystem


def problem() -> PoissonSystem:
    y = sp.symbols("y1:4", real=True)
    return PoissonSystem(
        y=y,
        B=sp.Matrix([[0, -y[2], y[1]], [y[2], 0, y[0] * y[1]], [-y[1], -y[0] * y[1], 0]]),
        H=(y[0] ** 2 + y[1] ** 2) / 2,
        cases={"tilted": PoissonCase(y=(1, 2, 3))},
    )
'''


@dataclass(frozen=True)
class Trouble:
    """A command of the README, and what it is said to say."""

    words: tuple[str, ...]
    message: str


def block(marker, language="python"):
    """Return the code below a marker of the README."""
    text = README.read_text(encoding="utf-8")
    return re.search(rf"<!-- {re.escape(marker)} -->\n```{language}\n(.*?)```", text, re.DOTALL)[1]


def troubles():
    """Return the rows of the README's table of messages."""
    text = README.read_text(encoding="utf-8").partition("## When it says no")[2].partition("\n## ")[0]
    rows = re.findall(r"^\| `daebench (.*?)` \| (.*?) \| .*? \|$", text, re.MULTILINE)
    return [Trouble(tuple(shlex.split(command)), message.replace("\\|", "|")) for command, message in rows]


def write_files(folder):
    """Write the files that the commands name."""
    bead = block("bead.py")
    (folder / "bead.py").write_text(bead)
    for name, (right, wrong) in MISTAKES.items():
        assert bead.count(right) == 1, name
        (folder / name).write_text(bead.replace(right, wrong))
    (folder / "bracket.py").write_text(BRACKET)


def write_older_store(path):
    """Write a store of the layout before the present one."""
    from daebench.studies.store import LAYOUT, opened

    with opened(path):
        pass
    with sqlite3.connect(path) as base:
        base.execute(f"PRAGMA user_version = {LAYOUT - 1}")
    base.close()
