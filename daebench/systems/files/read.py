"""Reading of a problem file as text, without running it: summary, parameters, kind, and the files on which its definition depends."""

import ast
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from daebench.errors import BadInput, real
from daebench.systems.files.package import digest_of_files

if TYPE_CHECKING:
    from daebench.systems.chain import ConstrainedChain
    from daebench.systems.constrained import ConstrainedHamiltonian
    from daebench.systems.lattice import PoissonLattice
    from daebench.systems.poisson import PoissonSystem

    Definition = ConstrainedHamiltonian | ConstrainedChain | PoissonSystem | PoissonLattice

KINDS = {"ConstrainedHamiltonian": "constrained", "ConstrainedChain": "constrained"}
KINDS |= {"PoissonSystem": "poisson", "PoissonLattice": "poisson"}
"""Kinds of problems by the name of their record."""


@dataclass(frozen=True)
class Problem:
    """A problem file, read and not yet run."""

    name: str
    """Name by which it is requested: that of a problem of the catalogue, or the path of a file."""
    summary: str
    """First line of its docstring."""
    parameters: Mapping[str, float]
    """Run-time parameters and their defaults: the arguments of ``problem`` that are annotated float."""
    structure: Mapping[str, int]
    """Structural parameters and their defaults: the arguments annotated int. Each value gives another definition."""
    kind: str
    """"constrained" or "poisson", the annotated return type of ``problem``; of the former "nonholonomic" if there is a
    constraint on velocities, and "free" if there is none, with g=[]."""
    path: Path
    """The file."""
    package: str
    """Its provider: "daebench", a distribution, or "" for a file of the user's own."""
    depends_on: Callable[["Problem"], Sequence[Path]] = field(repr=False)
    """Returns the files that may determine the definition, including the file itself."""
    run: "Callable[[Problem, Mapping[str, int]], Definition]" = field(repr=False)
    """``run(problem, structure)`` runs the file and returns the definition; this imports SymPy."""
    again: "Callable[[Problem, Mapping[str, int]], Iterable[Definition]]" = field(default=lambda *_: (), repr=False)
    """``again(problem, structure)`` returns the definition again by each of the ways in which it may be requested; nothing for problems of
    daebench.
    """

    @cached_property
    def digest(self) -> str:
        """Content hash of the file and of all files that it may import, with their locations."""
        return digest_of_files(("" if self.own else str(file.resolve()), file.read_bytes()) for file in self.depends_on(self))

    @property
    def own(self) -> bool:
        """Whether it is a problem of daebench."""
        return self.package == "daebench"

    def define(self, /, **structure: int) -> "Definition":
        """Return the definition; this runs the file."""
        return self.run(self, structure)


def read(path: Path, *, name: str, **origin: Any) -> Problem:
    """Return a problem from its file's text, without running it; ``origin`` has the other fields of :class:`Problem`.

    BadInput is raised if the file cannot be read, is not Python, or has no function ``problem`` of the required form.
    """
    tree = parsed(path)
    constructor = _constructor(tree, path)
    kind, faults = _kind(constructor)
    floats, ints, more = _arguments(constructor)
    if faults := [*faults, *more]:
        raise BadInput(f"{path.name}, {'; '.join(faults)}.", "problem-file-faulty")
    return Problem(name, summary(tree), floats, ints, kind, path.absolute(), **origin)


def parsed(path: Path) -> ast.Module:
    """Return the syntax of a Python file; raise BadInput, with the line, if it cannot be read or is not Python."""
    if path.suffix != ".py":
        raise BadInput(
            f"{path} is not a Python file; of other files only models can be read, MJCF (.xml) and URDF (.urdf); give a .py file.",
            "not-a-problem-file",
        )
    try:
        return ast.parse(path.read_bytes())
    except OSError as error:
        raise BadInput(
            f"{path}: the file cannot be read ({error.strerror}); give the path of a problem file.", "problem-file-unreadable"
        ) from error
    except (MemoryError, RecursionError) as error:
        raise BadInput(
            f"{path}: its expressions are nested too deeply for Python to read; nest them less deeply.", "problem-file-too-deep"
        ) from error
    except (SyntaxError, ValueError) as error:
        line = f", line {error.lineno}" if isinstance(error, SyntaxError) and error.lineno else ""
        raise BadInput(f"{path}{line}: this is not Python: {getattr(error, 'msg', error)}.", "problem-file-not-python") from error


def summary(tree: ast.Module) -> str:
    """Return the first line of a file's docstring."""
    return (ast.get_docstring(tree) or "").split("\n")[0]


def _constructor(tree: ast.Module, path: Path) -> ast.FunctionDef:
    constructors = [node for node in tree.body if isinstance(node, ast.FunctionDef) and node.name == "problem"]
    if not constructors:
        raise BadInput(
            f"{path.name} defines no function problem(*, ...); a problem file needs one that returns its definition.",
            "file-without-problem",
        )
    # The last, as in Python, where a later definition replaces an earlier one.
    return constructors[-1]


def _kind(constructor: ast.FunctionDef) -> tuple[str, list[str]]:
    """Return the kind of problem that a constructor is annotated to return, and what is wrong with it."""
    returns = constructor.returns
    text = returns.value if isinstance(returns, ast.Constant) else ast.unparse(returns) if returns else ""
    kind = KINDS.get(str(text).rpartition(".")[2], "")
    if kind == "constrained":
        kind = "nonholonomic" if _on_velocities(constructor) else "free" if _without_constraints(constructor) else kind
    return kind, [] if kind else [f"line {constructor.lineno}: problem() must be annotated to return one of {', '.join(KINDS)}"]


def _on_velocities(constructor: ast.FunctionDef) -> bool:
    """Return whether a constructor declares constraints on velocities, as velocity=[...] or by joints that roll or slide."""
    nodes = list(ast.walk(constructor))
    joints = {node.func.id for node in nodes if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)}
    return bool(joints & {"Rolling", "KnifeEdge"}) or any(isinstance(node, ast.keyword) and node.arg == "velocity" for node in nodes)


def _without_constraints(constructor: ast.FunctionDef) -> bool:
    """Return whether a constructor declares that there are no constraints, as g=[] without ``velocity``."""
    constraints = [node.value for node in ast.walk(constructor) if isinstance(node, ast.keyword) and node.arg in ("g", "velocity")]
    return bool(constraints) and all(isinstance(value, ast.List | ast.Tuple) and not value.elts for value in constraints)


def _arguments(constructor: ast.FunctionDef) -> tuple[dict[str, float], dict[str, int], list[str]]:
    """Return run-time and structural parameters with their defaults, and what is wrong with them."""
    arguments, faults = constructor.args, []
    # All faults are collected, so that one reading of the message is enough to correct the file.
    if others := [*arguments.posonlyargs, *arguments.args, *filter(None, (arguments.vararg, arguments.kwarg))]:
        given = ", ".join(parameter.arg for parameter in others)
        faults.append(f"line {constructor.lineno}: problem() takes {given}; write problem(*, ...): keyword-only arguments")
    floats: dict[str, float] = {}
    ints: dict[str, int] = {}
    for argument, default in zip(arguments.kwonlyargs, arguments.kw_defaults, strict=True):
        kind = argument.annotation.id if isinstance(argument.annotation, ast.Name) else ""
        where = f"line {argument.lineno}: argument {argument.arg} of problem()"
        if kind not in ("float", "int") or default is None:
            faults.append(f"{where} must be annotated float or int and have a default")
            continue
        value = _default(default)
        if value is None:
            faults.append(f"{where} has the default {ast.unparse(default)}, but must have a literal number")
        elif kind == "float":
            floats[argument.arg] = value
        elif value == int(value) >= 1:
            ints[argument.arg] = int(value)
        else:
            faults.append(f"{where} is annotated int, but its default {value:g} is not a whole number of at least 1")
    return floats, ints, faults


def _default(default: ast.expr) -> float | None:
    """Return the number that a default is, or None if it is no finite literal number."""
    try:
        return real("", ast.literal_eval(default))
    except (BadInput, ValueError, TypeError, SyntaxError):
        return None
