"""Problem files outside of the package: they are executed with the files beside them that they import, and mistakes are reported."""

import sys
import types
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from daebench.errors import InvalidProblem
from daebench.systems.files import execute
from daebench.systems.files.execute import executed, existing
from daebench.systems.files.imports import Neighbours, importable, imported
from daebench.systems.files.package import folder
from daebench.systems.files.read import KINDS, Problem, read

if TYPE_CHECKING:
    from daebench.systems.files.read import Definition


def find(name: str) -> Problem:
    """Return the problem in a file; raise BadInput if there is no such file, or its text does not define a problem."""
    path = existing(name, "problem", "daebench list problems")
    return read(path, name=name, package="", depends_on=_files, run=_defined, again=_again)


def own_files() -> list[Path]:
    """Return the files of daebench's own problems, whose helpers a file from another source may import."""
    return sorted(folder("daebench.problems").rglob("*.py"))


def _files(problem: Problem) -> Sequence[Path]:
    return [problem.path, *imported(problem.path), *own_files()]


def _again(problem: Problem, structure: Mapping[str, int]) -> "Iterator[Definition]":
    """Return the definition of a file from a second call of its module, and from a second execution of the file."""
    yield _defined(problem, structure)
    yield _afresh(problem, structure)


def _afresh(problem: Problem, structure: Mapping[str, int]) -> "Definition":
    """Return the definition of a file that is executed again, independent of any state of its module."""
    # Executed anew, so that a definition that depends on a state of its module differs, and is noticed.
    module = sys.modules.pop(_name(problem))
    try:
        return _defined(problem, structure)
    finally:
        sys.modules[_name(problem)] = module


def _defined(problem: Problem, structure: Mapping[str, int]) -> "Definition":
    try:
        with importable(problem.path.parent) as neighbours, naming(problem):
            definition = call(problem, executed(problem.path, _name(problem)), structure)
        # Only files that are visible in the text are in the hash under which results are stored.
        _require_seen(problem, neighbours)
    except BaseException:
        sys.modules.pop(_name(problem), None)  # so that another try finds the same error
        raise
    return definition


def _require_seen(problem: Problem, neighbours: Neighbours) -> None:
    known = {path.resolve() for path in problem.depends_on(problem)}
    if unseen := [path for path in neighbours.found.values() if path.is_file() and path.resolve() not in known]:
        raise InvalidProblem(
            f"{problem.name} imports {unseen[0].name} in a way that is not visible in its text, so a change there would go unnoticed; "
            "name it in an import statement.",
            "import-not-visible",
        )


def _name(problem: Problem) -> str:
    """Return the name of a file's module, which no other file or content of this file has."""
    return f"daebench_problem_{problem.path.stem}_{problem.digest[:16]}"


def call(problem: Problem, module: types.ModuleType, structure: Mapping[str, int]) -> "Definition":
    """Return the result of the function ``problem`` of a module; its type must be the annotated one.

    InvalidProblem is raised if its type is another, or it declares other parameters than its arguments.
    """
    constructor: Callable[..., Definition] = module.problem
    definition = constructor(**structure)
    if KINDS.get(type(definition).__name__) != ("poisson" if problem.kind == "poisson" else "constrained"):
        what = "nothing" if definition is None else f"a {type(definition).__name__}"
        raise InvalidProblem(f"problem() returns {what}, which is not its annotated type.", "problem-returns-other-type")
    declared = {str(symbol) for symbol in definition.parameters}
    if odd := sorted(declared ^ set(problem.parameters)):
        taken = ", ".join(problem.parameters) or "none"
        raise InvalidProblem(
            f"the float arguments of problem() are {taken}, but the parameters of its definition {', '.join(sorted(declared)) or 'none'}; "
            f"{', '.join(odd)} must be both.",
            "problem-arguments-differ",
        )
    for name, case in definition.cases.items():
        if foreign := sorted(set(case.parameters) - declared - set(problem.structure)):
            raise InvalidProblem(
                f"case {name!r} sets {', '.join(foreign)}, which is not a parameter of the problem.", "case-sets-no-parameter"
            )
    return definition


@contextmanager
def naming(problem: Problem) -> Iterator[None]:
    """Turn any error in a problem's files, and what would end Python, into one sentence with file and line, an InvalidProblem.

    The files are executed in this process. A signal, and an exit in compiled code that they load, cannot be told.
    """

    def files() -> list[Path]:
        return [problem.path, *(set(problem.depends_on(problem)) - set(own_files()))]

    with execute.naming(problem.name, problem.path, files, InvalidProblem), execute.telling_exits():
        yield
