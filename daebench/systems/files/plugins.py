"""Problems provided by other packages: entry points of the group ``daebench.problems``, found and read without any import."""

import importlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.machinery import ModuleSpec, PathFinder
from importlib.metadata import EntryPoint, entry_points
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from daebench.errors import BadInput, DaebenchError
from daebench.systems.files.execute import is_path, require_allowed
from daebench.systems.files.imports import imported
from daebench.systems.files.read import Problem, read
from daebench.systems.files.user import call, naming, own_files

if TYPE_CHECKING:
    from daebench.systems.files.read import Definition

GROUP = "daebench.problems"
_VALUE = re.compile(r"\w+(\.\w+)*(:problem)?")


@dataclass(frozen=True)
class Plugins:
    """Problems provided by other packages."""

    problems: Mapping[str, Problem]
    """Problems that can be used."""
    broken: Mapping[str, str]
    """Reasons why others cannot be used, one sentence each."""


@cache
def plugins(taken: tuple[str, ...]) -> Plugins:
    """Return the problems provided by other packages, except under names that are taken."""
    by_name: dict[str, list[EntryPoint]] = {}
    for entry_point in entry_points(group=GROUP):
        by_name.setdefault(entry_point.name, []).append(entry_point)
    problems: dict[str, Problem] = {}
    broken: dict[str, str] = {}
    # One broken package must not hide the problems of the others: its error becomes a sentence.
    for name, points in sorted(by_name.items()):
        try:
            problems[name] = _problem(name, points, taken)
        except DaebenchError as error:
            broken[name] = str(error)
    return Plugins(problems, broken)


def _problem(name: str, points: Sequence[EntryPoint], taken: Sequence[str]) -> Problem:
    if name in taken:
        raise BadInput(
            f"problem {name} of {_package(points[0])} has the name of a problem of daebench, which is used; rename it there.",
            "package-problem-name-taken",
        )
    if len(points) > 1:
        both = " and ".join(sorted(map(_package, points)))
        raise BadInput(
            f"problem {name} is provided by {both}, so the name is ambiguous; uninstall one, or give a file by its path.",
            "package-problem-ambiguous",
        )
    if is_path(name):
        raise BadInput(
            f"problem {name!r} of {_package(points[0])} has the name of a file; rename it there.", "package-problem-named-as-file"
        )
    try:
        return _read(name, points[0])
    except DaebenchError as error:
        raise BadInput(f"problem {name} of {_package(points[0])} cannot be used: {error}", "package-problem-unusable") from error


def _read(name: str, point: EntryPoint) -> Problem:
    return read(
        _file(point),
        name=name,
        package=_package(point),
        depends_on=lambda problem: [problem.path, *_files(point.module, problem.path), *own_files()],
        run=lambda problem, structure: _run(point, problem, structure),
        again=lambda problem, structure: [_run(point, problem, structure)],
    )


def _package(point: EntryPoint) -> str:
    return f"{point.dist.name} {point.dist.version}" if point.dist is not None else "a package"


def _file(point: EntryPoint) -> Path:
    """Return the source file that an entry point names."""
    if not _VALUE.fullmatch(point.value):
        raise BadInput(
            f"its entry point {point.value!r} must be the name of a module that has a function problem.", "entry-point-not-a-module"
        )
    spec = _spec(point.module)
    if spec is None or spec.origin is None or not spec.origin.endswith(".py"):
        raise BadInput(f"there is no Python file of the module {point.module}.", "entry-point-without-file")
    return Path(spec.origin)


def _spec(module: str) -> ModuleSpec | None:
    """Return the location of a module; its parent packages are located but not imported."""
    parts = module.split(".")
    try:
        spec = find_spec(parts[0])
    except (ImportError, ValueError):
        return None
    # Not find_spec of the whole name, which would import the parents, and with them code that nobody asked for.
    for k in range(2, len(parts) + 1):
        if spec is None or not spec.submodule_search_locations:
            return None
        spec = PathFinder.find_spec(".".join(parts[:k]), spec.submodule_search_locations)
    return spec


def _files(module: str, path: Path) -> list[Path]:
    """Return the files of the package of a module; without a package, the files that the module's file imports from beside it."""
    spec = _spec(module.partition(".")[0])
    places = (spec.submodule_search_locations or []) if spec is not None else []
    return [source for place in places for source in sorted(Path(place).rglob("*.py"))] if places else imported(path)


def _run(point: EntryPoint, problem: Problem, structure: Mapping[str, int]) -> "Definition":
    require_allowed(f"{problem.name} of {_package(point)}")
    with naming(problem):
        return call(problem, importlib.import_module(point.module), structure)
