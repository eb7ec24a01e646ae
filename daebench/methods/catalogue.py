"""The catalogue of problems, schemes, reports and lessons: it lists folders, so that a new problem or scheme is one new file.

A problem may also be a user file, given by its path, or come with another package, see ``problem_plugins``.
"""

import ast
import importlib
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from daebench.compiler.definition import require_same
from daebench.errors import BadInput, real, unknown
from daebench.methods.registry import registry
from daebench.systems.files.execute import is_model, is_path
from daebench.systems.files.package import folder
from daebench.systems.files.plugins import Plugins
from daebench.systems.files.plugins import plugins as of_packages
from daebench.systems.files.read import Problem, read, summary
from daebench.systems.files.user import find as find_file

if TYPE_CHECKING:
    from daebench.systems.files.read import Definition

MOST = 1_000_000
"""Largest structural parameter: a chain of as many nodes takes some gigabytes."""


@cache
def _files(package: str) -> tuple[Path, ...]:
    return tuple(sorted(path for path in folder(package).glob("*.py") if not path.stem.startswith("_")))


@cache
def problems(kind: str | None = None) -> Mapping[str, Problem]:
    """Return daebench's own problems by name, or of a kind: "constrained", "nonholonomic", "free" (of constraints) or "poisson"."""
    catalogue = {path.stem: _read(path) for path in _files("daebench.problems")}
    return {name: problem for name, problem in catalogue.items() if kind in (None, problem.kind)}


@cache
def own_problems() -> frozenset[str]:
    """Return the names of daebench's own problems; no file is read."""
    return frozenset(path.stem for path in _files("daebench.problems"))


def plugins() -> Plugins:
    """Return the problems of other packages, and why some of them cannot be used."""
    return of_packages(tuple(path.stem for path in _files("daebench.problems")))


@cache
def _problem(name: str) -> Problem:
    return _read(folder("daebench.problems") / f"{name}.py")


def schemes() -> tuple[str, ...]:
    """Return the names of all schemes."""
    return tuple(sorted(registry()))


@cache
def reports() -> Mapping[str, str]:
    """Return all reports by name, each with its summary."""
    files = [file for file in sorted(folder("daebench.reports").glob("*/__init__.py")) if file.parent.name != "lessons"]
    return {file.parent.name.replace("_", "-"): summary(ast.parse(file.read_text(encoding="utf-8"))) for file in files}


@cache
def lessons() -> Mapping[str, str]:
    """Return all lessons by name, each with its summary."""
    return {
        path.stem.replace("_", "-"): summary(ast.parse(path.read_text(encoding="utf-8"))) for path in _files("daebench.reports.lessons")
    }


def _read(path: Path) -> Problem:
    """Return a problem of daebench's own, from its file's text."""
    return read(path, name=path.stem, package="daebench", depends_on=_beside, run=_run)


def _beside(problem: Problem) -> list[Path]:
    """Return a problem's file and all files beside it, which it may import."""
    return [problem.path, *(path for path in sorted(problem.path.parent.rglob("*.py")) if path != problem.path)]


def _run(problem: Problem, structure: Mapping[str, int]) -> "Definition":
    definition: Definition = importlib.import_module(f"daebench.problems.{problem.name}").problem(**structure)
    return definition


def _checked(problem: Problem) -> Problem:
    """Return a problem that is not part of daebench; it is refused if each reading gives another system."""

    def run(asked: Problem, structure: Mapping[str, int]) -> "Definition":
        definition = problem.run(asked, structure)
        require_same(asked, structure, definition, lambda: problem.again(asked, structure))
        return definition

    return replace(problem, run=run)


def find_problem(name: str) -> Problem:
    """Return the problem of this name: a problem of daebench, of another package, or of a file.

    A name that ends in .py or has a path separator in it is the path of a file, which is executed when the problem is used.
    """
    if is_model(name):
        model: Problem = importlib.import_module("daebench.joints.models.read").find(name)
        return model
    if is_path(name):
        return _checked(find_file(name))
    names = [path.stem for path in _files("daebench.problems")]
    if name in names:
        return _problem(name)
    others = plugins()
    if name in others.broken:
        raise BadInput(others.broken[name], "problem-of-broken-package")
    if name not in others.problems:
        raise unknown("problem", name, [*names, *others.problems])
    return _checked(others.problems[name])


def whole_structure(problem: Problem, parameters: Mapping[str, float]) -> tuple[dict[str, int], dict[str, float]]:
    """Return the given structural parameters, as whole numbers, and the other parameters."""
    structure = {name: _whole(name, value) for name, value in parameters.items() if name in problem.structure}
    return structure, {name: value for name, value in parameters.items() if name not in structure}


def _whole(name: str, value: float) -> int:
    if real(name, value) != int(value) or value < 1:
        raise BadInput(f"{name} = {value:g} must be a whole number of at least 1.", "parameter-not-whole")
    if value > MOST:
        raise BadInput(f"{name} = {value:g} is more than the {MOST} that fit into memory; give less.", "parameter-exceeds-memory")
    return int(value)
