"""A certificate: what it consists of, what became of its claims, and how it is written."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from daebench.records.sealed import sealed
from daebench.runs.files import atomic
from daebench.runs.json_values import plain
from daebench.studies.claims.bench import FALLS_SHORT, OK, UNDETERMINED

SCHEMA = "daebench certificate"
"""What every certificate says it is."""

FORMAT = 1
"""Version of the layout."""

NAME = "certificate.json"


@dataclass(frozen=True)
class Certificate:
    """A code measured on some problems, with all that is needed to measure it again.

    Parameters
    ----------
    folder : Path
        Where it is, with its code in ``code/`` and problem files in ``definitions/``.
    content : mapping
        What the file has: ``method``, ``code`` with its hash and files, ``options``, ``anyway``, ``on_singular`` and ``claims``,
        ``problems`` with numbers or with why they were refused, ``holds``, ``falls_short`` and ``undetermined`` with names of claims, and
        ``about``: date, machine, versions and seconds of a step, none of which is verified.
    """

    folder: Path
    content: Mapping[str, Any] = field(repr=False)

    @property
    def method(self) -> str:
        """The address of the code."""
        return str(self.content["method"])

    @property
    def hash(self) -> str:
        """SHA-256 of the names and contents of its files."""
        return str(self.content["code"]["hash"])

    @property
    def measured(self) -> list[Mapping[str, Any]]:
        """The problems that the code was measured on."""
        return [problem for problem in self.content["problems"] if "refused" not in problem]

    @property
    def refused(self) -> dict[str, str]:
        """Why it was not measured on the others, by problem and case."""
        return {title(problem): str(problem["refused"]) for problem in self.content["problems"] if "refused" in problem}

    @property
    def holds(self) -> list[str]:
        """Claims that hold on every problem."""
        return list(self.content["holds"])

    @property
    def falls_short(self) -> list[str]:
        """Claims that do not hold on a problem."""
        return list(self.content["falls_short"])

    @property
    def undetermined(self) -> list[str]:
        """Claims of which it is not known on a problem."""
        return list(self.content["undetermined"])


def title(problem: Mapping[str, Any]) -> str:
    """Return a problem of a certificate in words."""
    given = ", ".join(f"{name} = {value:g}" for name, value in problem["changed"].items())
    case = f", case {problem['case']}" if problem["case"] else ""
    return Path(problem["problem"]).name + case + (f", {given}" if given else "")


def verdicts(problems: Iterable[Mapping[str, Any]]) -> dict[str, list[str]]:
    """Return the claims that are stated, by what became of them on all problems together: the worst of their verdicts."""
    worst: dict[str, str] = {}
    rank = (OK, UNDETERMINED, FALLS_SHORT)
    for problem in problems:
        for name, finding in problem.get("numbers", {"claims": {}})["claims"].items():
            if finding["claimed"] and finding["verdict"] in rank:
                worst[name] = max(worst.get(name, OK), finding["verdict"], key=rank.index)
    names = {"holds": OK, "falls_short": FALLS_SHORT, "undetermined": UNDETERMINED}
    return {key: [name for name, verdict in worst.items() if verdict == word] for key, word in names.items()}


def write(folder: Path, content: Mapping[str, Any]) -> Path:
    """Write a certificate into a folder, with its checksum, and return its path."""
    whole = plain({"schema": SCHEMA, "format": FORMAT, **content})
    with atomic(folder / NAME) as scratch:
        scratch.write_text(json.dumps(sealed(whole), indent=1, allow_nan=False) + "\n", encoding="ascii")
    return folder / NAME
