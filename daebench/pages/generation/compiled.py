"""A folder of generated C as a method from outside: its library, compiled, with what is claimed of it."""

import json
from pathlib import Path
from typing import Any, NamedTuple

from daebench.errors import BadInput
from daebench.studies.timers import compiler, failure

ABOUT = "generated.json"
"""File of what a folder has: problem, case, method, step size, names and claims."""


class Compiled(NamedTuple):
    """Subject of a certificate of a folder: the code, its files, its problem with the case, its step size, and its claims."""

    code: str
    files: list[Path]
    problem: str
    h: float
    claims: dict[str, Any]


def compiled(folder: Path) -> Compiled:
    """Return a folder of ``daebench generate --language c`` as a code; raise :class:`BadInput` if it is none, or cannot be compiled."""
    about, command = _about(folder), compiler()
    if command is None:
        raise BadInput(
            f"{folder} has to be compiled, and there is no compiler of C; install one, gcc for example.", "generated-needs-compiler"
        )
    name = about["name"]
    library, source = folder / f"lib{name}.so", folder / f"{name}.c"
    if why := failure(command, source, library, "-O2"):
        raise BadInput(f"{source} cannot be compiled: {why}.", "generated-not-compilable")
    files = [source, source.with_suffix(".h")]
    return Compiled(f"{library.absolute()}:{name}_call", files, about["on"], about["h"], about["claims"])


def _about(folder: Path) -> dict[str, Any]:
    """Return the description of a folder in its own file."""
    try:
        description = json.loads((folder / ABOUT).read_text(encoding="utf-8"))
        known = {"name": str, "precision": str, "on": str, "h": float, "claims": dict, "callable": bool}
        if not isinstance(description, dict) or any(not isinstance(description.get(key), kind) for key, kind in known.items()):
            raise ValueError
        if not description["name"].isidentifier():  # it becomes the name of a file
            raise ValueError
    except (OSError, ValueError) as error:
        raise BadInput(f"{folder} has no {ABOUT} of daebench generate; generate it again, or name a code.", "not-generated-code") from error
    if description["precision"] == "float32":
        raise BadInput(
            f"{folder} computes in single precision, in which claims cannot be measured; generate it with --precision float64.",
            "generated-in-single-precision",
        )
    if not description["callable"]:
        raise BadInput(
            f"{folder} has a scheme that remembers steps, or a Poisson system, so that it cannot be called step by step.",
            "generated-not-stepwise",
        )
    return description
