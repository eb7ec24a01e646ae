"""Measured contenders, stored in the folder of the report, so that an interrupted report continues where it stopped."""

import hashlib
import inspect
import json
from pathlib import Path
from types import ModuleType
from typing import Any

from daebench.reports.engines import contender as _contender
from daebench.reports.engines import motions as _motions
from daebench.reports.engines import truth as _truth
from daebench.reports.engines.contender import Contender
from daebench.runs.files import atomic, make_folder
from daebench.runs.machine import machine


def key_of(contender: Contender, version: str, *modules: ModuleType) -> str:
    """Return the digest of everything that determines the numbers of a contender: its setting, the engine's version, the machine, the code.

    Parameters
    ----------
    contender : Contender
        The contender.
    version : str
        Version of its engine.
    *modules : module
        Its adapter, and the other modules that measure it.
    """
    sources = [inspect.getsource(module) for module in (_contender, _motions, _truth, *modules)]
    parts = [contender.name, contender.motion, repr(contender.values), version, machine(), *sources]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:32]


def read(folder: Path, key: str) -> dict[str, Any] | None:
    """Return the measurements of a contender, None if there are none or its file is damaged."""
    path = folder / f"{key}.json"
    try:
        found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return found


def write(folder: Path, key: str, measured: dict[str, Any]) -> None:
    """Store the measurements of a contender atomically."""
    make_folder(folder)
    with atomic(folder / f"{key}.json") as scratch:
        scratch.write_text(json.dumps(measured, default=lambda number: number.item()), encoding="utf-8")
