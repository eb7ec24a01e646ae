"""How a file was made, in words: command, definition, settings, versions, machine and date, in a text file beside it.

The text is FILE.EXT.txt beside FILE.EXT. It is not part of the file, because many programs read a comment at the head as data.
"""

import hashlib
import platform
import shlex
import sys
from collections.abc import Mapping
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from daebench.errors import BadInput
from daebench.runs.files import atomic
from daebench.runs.ivp import Ivp, PoissonIvp
from daebench.runs.machine import machine

PACKAGES = ("daebench", "numpy", "scipy", "sympy", "mpmath", "numba", "llvmlite", "pandas", "scikit-sundae", "heyoka", "solve_dae")
"""Packages on which numbers depend; those that are not installed are left out."""


def versions() -> dict[str, str]:
    """Return the versions of Python and of the installed packages on which numbers depend."""
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


def definition(ivp: Ivp) -> dict[str, str]:
    """Return a description of the definition of a motion."""
    names = ("y0",) if isinstance(ivp, PoissonIvp) else ("p0", "q0")
    states = zip(names, ivp.start, strict=True)
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
    made = {"Versions": ", ".join(f"{package} {number}" for package, number in versions().items()), "Machine": machine()}
    command = {"Command": shlex.join(["daebench", *sys.argv[1:]])} if Path(sys.argv[0]).stem in ("daebench", "__main__") else {}
    lines = [f"{name} was made by daebench {version('daebench')} on {now()}.", ""]
    return "\n".join([*lines, *(f"{key}: {value}" for key, value in {**command, **about, **made}.items()), ""])


def write_beside(path: Path, about: Mapping[str, str]) -> Path:
    """Write how a file was made into a text beside it, with the file's own digest; return the path of the text."""
    beside = path.with_name(f"{path.name}.txt")
    details = {**about, "SHA-256 of the file": hashlib.sha256(path.read_bytes()).hexdigest()}
    with atomic(beside) as scratch:
        scratch.write_text(text(path.name, details), encoding="utf-8")
    return beside


MAKER = "Made by: "
"""Beginning of the line that says which command made a file."""


def made_by(command: str) -> dict[str, str]:
    """Return the line that :func:`require_own` looks for, for :func:`write_beside`."""
    return {MAKER.strip(": "): command}


def require_own(path: Path, command: str, *, overwrite: bool, option: str = "--out") -> None:
    """Check that an output file is new, or was made by the same command according to the text beside it.

    BadInput is raised if another command made it, or if there is no such text, unless ``overwrite`` allows any file to be replaced.
    """
    if overwrite or not path.exists():
        return
    maker = _maker(path.with_name(f"{path.name}.txt"))
    if maker != command:
        whose = f"{maker} made it" if maker else f"nothing beside it says that {command} made it"
        raise BadInput(f"{option} {path}: the file exists, and {whose}; choose another name, or add --overwrite to replace it.")


def _maker(beside: Path) -> str:
    """Return the command that made a file, according to the text beside it; "" if there is none."""
    try:
        lines = beside.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return ""
    return next((line.removeprefix(MAKER).strip() for line in lines if line.startswith(MAKER)), "")
