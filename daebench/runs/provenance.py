"""How a file was made, in words: command, definition, settings, versions, machine and date, in a text file beside it.

The text is FILE.EXT.txt beside FILE.EXT. It is not part of the file, because many programs read a comment at the head as data.
"""

import hashlib
import platform
import shlex
import sys
from collections.abc import Mapping
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from daebench.runs.files import atomic
from daebench.runs.machine import machine
from daebench.runs.schema import Kind, Named, Text

if TYPE_CHECKING:
    from daebench.runs.ivp import Ivp

PACKAGES = ("daebench", "numpy", "scipy", "sympy", "mpmath", "llvmlite", "pandas", "scikit-sundae", "heyoka", "solve_dae")
"""Packages on which numbers depend; those that are not installed are left out."""

EXTRAS = ("heyoka", "solve_dae")
"""Packages of solvers that need not be installed; the name of a method begins with that of its package."""

ORIGIN: Mapping[str, Kind] = {
    "made": Text(form=r"\d{4}-\d\d-\d\d \d\d:\d\d UTC", told="a date and a time, such as 2026-01-31 12:00 UTC"),
    "versions": Named(Text(form=r"\d[\w.+!-]*", told="a version"), required=("Python", *(name for name in PACKAGES if name not in EXTRAS))),
    "machine": Text(300, form=r".+, \w+ logical cores, .+ on .+", told="a processor, its cores and a system"),
}
"""Fields of a file from elsewhere on its origin: :func:`now`, :func:`versions` and the machine."""


def versions() -> dict[str, str]:
    """Return the versions of Python and of the installed packages on which numbers depend."""
    return dict(_releases())


@cache
def _releases() -> dict[str, str]:
    releases = {"Python": platform.python_version()}
    for name in PACKAGES:
        try:
            releases[name] = version(name)
        except PackageNotFoundError:
            continue
    return releases


def now() -> str:
    """Return the present time in words, in universal time."""
    return datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")


def definition(ivp: "Ivp") -> dict[str, str]:
    """Return a description of the definition of a motion."""
    states = zip(ivp.state.starts, ivp.start, strict=True)
    start = "; ".join(f"{name} = ({_numbers(part)})" for name, part in states) if ivp.size <= LONGEST else f"{ivp.size} numbers"
    return {
        "Problem": f"{ivp.problem}, case {ivp.case}" if ivp.case else ivp.problem,
        "Parameters": ", ".join(f"{name} = {value!r}" for name, value in ivp.parameters.items()) or "none",
        "Start": start,
        "Definition": f"SHA-256 {ivp.facts.FINGERPRINT} of its equations and cases",
    }


LONGEST = 24
"""Largest number of numbers of a start that are written out."""


def _numbers(values: Any) -> str:
    return ", ".join(f"{float(x)!r}" for x in values)


def text(name: str, about: Mapping[str, str]) -> str:
    """Return a text on how a file of this name was made; ``about`` describes it, by the first words of each line."""
    origin = {"Versions": ", ".join(f"{package} {number}" for package, number in versions().items()), "Machine": machine()}
    # In a script of the user's own, the arguments of the process are not those of a command.
    command = {"Command": shlex.join(["daebench", *sys.argv[1:]])} if Path(sys.argv[0]).stem in ("daebench", "__main__") else {}
    lines = [f"{name} was made by daebench {version('daebench')} on {now()}.", ""]
    return "\n".join([*lines, *(f"{key}: {value}" for key, value in {**command, **about, **origin}.items()), ""])


def beside(path: Path) -> Path:
    """Return the path of the text on how a file was made."""
    # After the whole name: x.csv and x.svg have texts of their own.
    return path.with_name(f"{path.name}.txt")


def write_beside(path: Path, about: Mapping[str, str], content: Path | None = None) -> Path:
    """Write how a file was made into a text beside it, with the file's own digest; return the path of the text.

    ``content`` is the temporary path of a file that is still to be renamed.
    """
    details = {**about, "SHA-256 of the file": hashlib.sha256((content or path).read_bytes()).hexdigest()}
    with atomic(beside(path)) as scratch:
        scratch.write_text(text(path.name, details), encoding="utf-8")
    return beside(path)
