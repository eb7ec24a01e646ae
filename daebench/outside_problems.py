"""Problem files outside of the package: code that is executed, with the files beside it that it imports, and mistakes that are named."""

import contextlib
import sys
import traceback
import types
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from daebench.errors import BadInput, DaebenchError, InvalidProblem
from daebench.neighbours import Fresh, Neighbours, importable, imported
from daebench.problem_files import KINDS, Problem, read

if TYPE_CHECKING:
    from daebench.source import Definition


def is_path(name: str) -> bool:
    """Return whether the name of a problem is the path of a file: it ends in .py, or has a separator of folders in it."""
    return name.endswith(".py") or "/" in name or "\\" in name


def find(name: str) -> Problem:
    """Return the problem in a file.

    Raises
    ------
    BadInput
        If there is no such file, or its text is not that of a problem.
    """
    try:
        path = Path(name).expanduser()
        there = path.is_file()
    except (OSError, RuntimeError, ValueError):  # a name too long, ~ of a user that there is not, a character that no path has
        there = False
    if not there:
        raise BadInput(f"{name}: there is no such file; give the path of a problem file, or a name that daebench list problems has.")
    return read(path, name=name, package="", depends_on=_files, run=_run)


def own_files() -> list[Path]:
    """Return the files of daebench's own problems: a file of another's may import their helpers."""
    return sorted((Path(__file__).parent / "problems").rglob("*.py"))


def _files(problem: Problem) -> Sequence[Path]:
    return [problem.path, *imported(problem.path), *own_files()]


def _run(problem: Problem, structure: Mapping[str, int]) -> "Definition":
    try:
        with importable(problem.path.parent) as neighbours, naming(problem):
            definition = call(problem, _module(problem), structure)
        _require_seen(problem, neighbours)
    except BaseException:
        sys.modules.pop(_name(problem), None)  # another try is to find the same fault
        raise
    return definition


def _require_seen(problem: Problem, neighbours: Neighbours) -> None:
    known = {path.resolve() for path in problem.depends_on(problem)}
    if unseen := [path for path in neighbours.found.values() if path.is_file() and path.resolve() not in known]:
        raise InvalidProblem(
            f"{problem.name} imports {unseen[0].name} in a way that cannot be seen in its text, so that a change there would go unnoticed; "
            "name it in an import statement."
        )


def _name(problem: Problem) -> str:
    """Return the name of a file's module, which no other file or text of this file has."""
    return f"daebench_problem_{problem.path.stem}_{problem.digest[:16]}"


def _module(problem: Problem) -> types.ModuleType:
    """Return the file's module, run once."""
    name = _name(problem)
    if name not in sys.modules:
        module = types.ModuleType(name, None)
        module.__file__ = str(problem.path)
        sys.modules[name] = module
        exec(Fresh(name, str(problem.path)).get_code(name), module.__dict__)
    return sys.modules[name]


def call(problem: Problem, module: types.ModuleType, structure: Mapping[str, int]) -> "Definition":
    """Return what the function ``problem`` of a module returns; it must be what it is annotated to be.

    Raises
    ------
    InvalidProblem
        If it returns something else, or declares other parameters than it takes.
    """
    constructor: Callable[..., Definition] = module.problem
    definition = constructor(**structure)
    if _kind(definition) != problem.kind:
        raise InvalidProblem(f"problem() returns {_what(definition)}, which is not what it is annotated to return.")
    declared = {str(symbol) for symbol in definition.parameters}
    if odd := sorted(declared ^ set(problem.parameters)):
        taken = ", ".join(problem.parameters) or "none"
        raise InvalidProblem(
            f"the float arguments of problem() are {taken}, and the parameters of its definition {', '.join(sorted(declared)) or 'none'}; "
            f"{', '.join(odd)} must be both."
        )
    for name, case in definition.cases.items():
        if foreign := sorted(set(case.parameters) - declared - set(problem.structure)):
            raise InvalidProblem(f"case {name!r} sets {', '.join(foreign)}, which is no parameter of the problem.")
    return definition


def _kind(definition: object) -> str:
    return KINDS.get(type(definition).__name__, "")


def _what(definition: object) -> str:
    return "nothing" if definition is None else f"a {type(definition).__name__}"


@contextlib.contextmanager
def naming(problem: Problem) -> Iterator[None]:
    """Turn whatever goes wrong in a file into one sentence with its file and line; what it prints goes to standard error.

    Raises
    ------
    InvalidProblem
        In place of any exception of the file.
    """
    try:
        with contextlib.redirect_stdout(sys.stderr):
            yield
    except DaebenchError as error:
        raise InvalidProblem(f"{_place(problem, error)}: {error}") from error
    except SyntaxError as error:
        where = f"{Path(error.filename).name}, line {error.lineno}" if error.filename else "a file that it imports"
        raise InvalidProblem(f"{problem.name}: {where} is not Python: {error.msg}.") from error
    except (Exception, SystemExit) as error:
        text = " ".join(str(error).split()).rstrip(".")
        what = type(error).__name__ + (f": {text}" if text else "")
        raise InvalidProblem(f"{_place(problem, error)}: {what}; correct the file.") from error


def _place(problem: Problem, error: BaseException) -> str:
    """Return the file and line of the innermost call in a problem's own files."""
    own = {path.resolve() for path in (problem.path, *(set(problem.depends_on(problem)) - set(own_files())))}
    for frame in reversed(traceback.extract_tb(error.__traceback__)):
        file = Path(frame.filename).resolve()
        if file in own:
            name = problem.name if is_path(problem.name) and file == problem.path.resolve() else f"{problem.name}, in {file.name}"
            return f"{name}, line {frame.lineno}"
    return problem.name
