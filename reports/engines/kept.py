"""Measured contenders, kept in the folder of the report, so that one that is interrupted goes on where it stopped."""

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
    """Return the digest of what decides the numbers of a contender: itself, the engine's version, the machine, and the code beside it.

    Parameters
    ----------
    contender : Contender
        The contender.
    version : str
        Version of its engine.
    *modules : module
        Its adapter, and what else measures it.
    """
    sources = [inspect.getsource(module) for module in (_contender, _motions, _truth, *modules)]
    parts = [contender.name, contender.motion, repr(contender.values), version, machine(), *sources]
    return hashlib.sha256("\n".join(parts).encode()).hexdigest()[:32]


def read(folder: Path, key: str) -> dict[str, Any] | None:
    """Return what was measured of a contender, None where it was not, or where its file is damaged."""
    path = folder / f"{key}.json"
    try:
        found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return found


def write(folder: Path, key: str, measured: dict[str, Any]) -> None:
    """Keep what was measured of a contender, whole or not at all."""
    make_folder(folder)
    with atomic(folder / f"{key}.json") as scratch:
        scratch.write_text(json.dumps(measured, default=lambda number: number.item()), encoding="utf-8")
