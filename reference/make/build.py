"""From a problem's definition to a stored reference, by one command; an interrupted build continues where it stopped."""

import hashlib
import json
import math
import platform
import shutil
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import mpmath as mp

from daebench.errors import BadInput
from daebench.methods.catalogue import find_problem
from daebench.methods.solvers.quadruple import library
from daebench.reference.check.recomputation import ida_names
from daebench.reference.keep.certificate import certified_text
from daebench.reference.keep.definition import Definition, define
from daebench.reference.keep.folders import DATA, own_folder, require_name
from daebench.reference.keep.store import names, save
from daebench.reference.make.certify import FEWEST
from daebench.reference.make.mathematics import mathematics
from daebench.reference.make.stages import KEPT_DIGITS, Stages, alone
from daebench.systems.files.package import folder

T_END, SPACING = 100, 8
"""Last output, s, and outputs per second: each time is exact in double precision."""

MOST = 100_000
"""Most outputs."""

PACKAGES = ("daebench", "numpy", "scipy", "sympy", "mpmath", "heyoka", "scikit-sundae", "llvmlite")

Progress = Callable[[float, str], None]


def build(
    name: str,
    *,
    folder: Path | None = None,
    t_end: float = T_END,
    spacing: int = SPACING,
    overwrite: bool = False,
    progress: Progress | None = None,
) -> Path:
    """Make, certify and store the reference of a problem's case; return its folder."""
    definition = _defined(name)
    library()
    times = _times(t_end, spacing)
    if (where := taken(name, folder)) and not overwrite:
        raise BadInput(f"{name} exists in {where} already; allow it to be overwritten, or name another folder for the new one.")
    folder = folder or own_folder()
    done = progress or (lambda fraction, doing: None)
    begun: list[str] = []
    expected = _stages(definition)

    def told(stage: str) -> None:
        begun.append(stage)
        done(min(0.99, len(begun) / expected), stage)

    place = folder / f".{name}.building"
    versions = {package: version(package) for package in PACKAGES} | {"python": platform.python_version()}
    key = hashlib.sha256(json.dumps([definition.hash, *_code(definition.ivp.problem), t_end, spacing, versions]).encode()).hexdigest()
    with alone(folder / f".{name}.lock", name), mp.workdps(KEPT_DIGITS + 20):
        certificate, text = certified_text(definition, times, Stages(place, key, told))
        stored = save(name, certificate | {"versions": versions}, text, folder)
        shutil.rmtree(place, ignore_errors=True)
    done(1.0, "done")
    return stored


def taken(name: str, folder: Path | None = None) -> Path | None:
    """Return the folder that already has a reference of this name, if it is the one in which it would be built."""
    require_name(name)
    if folder is None and name in names(DATA):
        raise BadInput(f"{name} comes with daebench; to build it again, name a folder for it with --out DIR.")
    where = folder or own_folder()
    return where if where.is_dir() and name in names(where) else None


def _defined(name: str) -> Definition:
    require_name(name)
    problem, dash, case = name.partition("-")
    if not dash:
        raise BadInput(f"{name} is not a name of a reference, which is PROBLEM-CASE, for example spherical_pendulum-fig1.2.")
    return define(problem, case)


def _stages(definition: Definition) -> int:
    """Return the largest number of stages: five motions, one for each direction, and six runs of IDA in each formulation."""
    return 5 + len(mathematics(definition).directions.T) + 6 * len(ida_names(definition.ivp))


def _code(problem: str) -> list[str]:
    """Return digests of the problem's file and of the files here; results of other code are not reused."""
    return [
        find_problem(problem).digest,
        *(hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(folder("daebench.reference").rglob("*.py"))),
    ]


def _times(t_end: float, spacing: int) -> list[Any]:
    if spacing < 1 or spacing & (spacing - 1):
        raise BadInput(
            f"{spacing} outputs per second are not a power of two, so times would not be exact in double precision; give 8 or 16."
        )
    n = t_end * spacing
    if not (math.isfinite(n) and n == int(n) and FEWEST <= n <= MOST):
        after = math.ceil(min(max(n, FEWEST), MOST)) / spacing if math.isfinite(n) else FEWEST / spacing
        raise BadInput(
            f"t_end = {t_end:g} must be {FEWEST} to {MOST} whole outputs at {spacing} per second; give {after!r}, or another spacing."
        )
    return [mp.mpf(k) / spacing for k in range(int(n) + 1)]
