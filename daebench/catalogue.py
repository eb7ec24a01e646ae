"""What there is: the catalogue lists the folders, so that a new problem or scheme is one new file and nothing else."""

import ast
import hashlib
import importlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from daebench.errors import BadInput, unknown
from daebench.inputs import real
from daebench.members import members

if TYPE_CHECKING:
    from daebench.poisson_system import PoissonSystem
    from daebench.problem import ConstrainedHamiltonian
    from daebench.scene import PoissonScene, Scene, Source

PACKAGE = Path(__file__).parent


@dataclass(frozen=True)
class Problem:
    """A problem file, read and not yet run.

    Parameters
    ----------
    name : str
        Name of the file.
    summary : str
        First line of its docstring.
    parameters : mapping of str to float
        Run-time parameters and their defaults: the arguments of ``problem`` that are annotated float.
    structure : mapping of str to int
        Structural parameters and their defaults: the arguments annotated int. Another value is another definition.
    digest : str
        Content hash of the file and of all files beside it, which it may import.
    kind : str
        "constrained" or "poisson": what ``problem`` is annotated to return.
    """

    name: str
    summary: str
    parameters: Mapping[str, float]
    structure: Mapping[str, int]
    digest: str
    kind: str

    def define(self, **structure: int) -> "ConstrainedHamiltonian | PoissonSystem":
        """Return the definition; this imports SymPy."""
        definition = importlib.import_module(f"daebench.problems.{self.name}").problem(**structure)
        return definition  # type: ignore[no-any-return]

    def source(self, structure: Mapping[str, int]) -> "Source":
        """Return the source of the definition with these structural parameters."""
        from daebench.scene import Source

        values = dict(self.structure) | dict(structure)
        return Source(self.name, f"{self.name} {self.digest} {sorted(values.items())}", lambda: self.define(**values))


def _files(folder: str) -> list[Path]:
    return sorted(path for path in (PACKAGE / folder).glob("*.py") if not path.stem.startswith("_"))


KINDS = {"ConstrainedHamiltonian": "constrained", "PoissonSystem": "poisson", "PoissonLattice": "poisson"}
"""Kinds of problems by the name of their record."""


@cache
def problems(kind: str | None = None) -> Mapping[str, Problem]:
    """Return all problems by name, or those of a kind, "constrained" or "poisson"."""
    found = {path.stem: _read(path) for path in _files("problems")}
    return {name: each for name, each in found.items() if kind in (None, each.kind)}


@cache
def _problem(name: str) -> Problem:
    return _read(PACKAGE / "problems" / f"{name}.py")


def schemes() -> tuple[str, ...]:
    """Return the names of all schemes."""
    return tuple(sorted(members()))


@cache
def reports() -> Mapping[str, str]:
    """Return all reports by name, each with its summary."""
    return {path.stem.replace("_", "-"): _summary(ast.parse(path.read_text(encoding="utf-8"))) for path in _files("reports")}


def _summary(tree: ast.Module) -> str:
    return (ast.get_docstring(tree) or "").split("\n")[0]


def _read(path: Path) -> Problem:
    """Return a problem from its file's text, without running it."""
    text = path.read_text(encoding="utf-8")
    tree = ast.parse(text)
    constructors = [node for node in tree.body if isinstance(node, ast.FunctionDef) and node.name == "problem"]
    if not constructors:
        raise BadInput(f"{path.name} defines no function problem(*, ...); a problem file needs one that returns its definition.")
    arguments, record = constructors[0].args, KINDS.get(ast.unparse(constructors[0].returns or ast.Constant(None)))
    if record is None:
        raise BadInput(f"problem() in {path.name} must be annotated to return one of {', '.join(KINDS)}.")
    found: dict[str, dict[str, float]] = {"float": {}, "int": {}}
    for argument, default in zip(arguments.kwonlyargs, arguments.kw_defaults, strict=True):
        kind = argument.annotation.id if isinstance(argument.annotation, ast.Name) else ""
        if kind not in found or default is None:
            raise BadInput(f"argument {argument.arg} of problem() in {path.name} must be annotated float or int and have a default.")
        found[kind][argument.arg] = ast.literal_eval(default)
    others = [other.read_text(encoding="utf-8") for other in sorted(path.parent.rglob("*.py")) if other != path]
    digest = hashlib.sha256("".join([text, *others]).encode()).hexdigest()
    structure = {name: int(value) for name, value in found["int"].items()}
    return Problem(path.stem, _summary(tree), found["float"], structure, digest, record)


def find_problem(name: str) -> Problem:
    """Return the problem of this name.

    Raises
    ------
    BadInput
        If there is none; the message has the nearest names.
    """
    names = [path.stem for path in _files("problems")]
    if name not in names:
        raise unknown("problem", name, names)
    return _problem(name)


def find_scene(
    problem: str,
    case: str | None = None,
    parameters: Mapping[str, float] | None = None,
    *,
    p0: Sequence[float] | None = None,
    q0: Sequence[float] | None = None,
) -> "Scene":
    """Return the scene of a constrained problem's case, see :func:`find_setting`; it refuses Poisson systems."""
    from daebench.scene import constrained

    return constrained(find_setting(problem, case, parameters, p0=p0, q0=q0))


def find_setting(
    problem: str, case: str | None = None, parameters: Mapping[str, float] | None = None, **start: Sequence[float] | None
) -> "Scene | PoissonScene":
    """Return a problem of any kind with the numbers of a case, by default its first, and parameters and start replaced where given.

    Raises
    ------
    BadInput
        If a name is unknown or a value is not what it must be.
    """
    from daebench.scene import make_setting

    found = find_problem(problem)
    given = dict(parameters or {})
    structure = {name: _whole(name, given.pop(name)) for name in list(given) if name in found.structure}
    source = found.source(structure)
    case = case if case is not None else next(iter(source.sheet.CASES))
    own = source.sheet.CASES.get(case, {"parameters": {}})["parameters"]
    declared = {name: int(value) for name, value in own.items() if name in found.structure and name not in structure}
    if declared:
        source = found.source(structure | declared)
    return make_setting(source, case, given, **start)


def _whole(name: str, value: float) -> int:
    if real(name, value) != int(value) or value < 1:
        raise BadInput(f"{name} = {value:g} must be a whole number of at least 1.")
    return int(value)
