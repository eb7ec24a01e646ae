"""The types of numbers that a module is linked for: those of NumPy, and those that have a package of this compiler.

Such a package has functions of its numbers, which generated modules import. Two of them add a type to numba, and have a file of entries:
since Python itself has no such numbers, ``integrate_dual`` stands there for ``integrate``, and takes them apart.
"""

import ast
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from daebench.compiler.syntax import SourceFile
from daebench.systems.files.package import text_of

DOUBLE = "2.220446049250313e-16"


@dataclass(frozen=True, kw_only=True)
class NumberType:
    """What the linker has to know of a type of numbers.

    Parameters
    ----------
    kind : str
        Its name, without the number that says how wide it is.
    dtype : str
        NumPy's name of it, or of what it consists of.
    eps : str
        Source of the distance from 1 to the next larger number.
    again : int
        How many times over Newton's iterations are done: 2 where derivatives are carried in the imaginary part.
    package : str
        Package of the type; "" for a type of NumPy.
    width : int
        How many derivatives, or runs, a number holds that a package adds to numba; 0 for other numbers.
    """

    kind: str
    dtype: str
    eps: str = DOUBLE
    again: int = 1
    package: str = ""
    width: int = 0

    @property
    def directions(self) -> int:
        """In how many directions numbers carry derivatives beside their values."""
        return self.width if self.package == "daebench.compiler.dual" else 0

    @property
    def lanes(self) -> int:
        """How many runs there are at once, 0 where there is one."""
        return self.width if self.kind == "lanes" else 0

    @property
    def threaded(self) -> bool:
        """Whether runs are shared out over threads."""
        return self.kind in ("lanes", "tangent")

    @cached_property
    def functions(self) -> Sequence[str]:
        """Functions of such numbers that modules import: what ``nested.py`` of the package says that it has."""
        if not self.package:
            return ()
        assigned = (node for node in ast.parse(text_of(f"{self.package}.nested")).body if isinstance(node, ast.Assign))
        return next(list(ast.literal_eval(node.value)) for node in assigned if ast.unparse(node.targets[0]) == "__all__")

    @property
    def imports(self) -> list[str]:
        """Lines that a module begins with."""
        return [f"from {self.package}.nested import {', '.join(self.functions)}"] if self.package else []

    def entries(self, roots: Sequence[str]) -> tuple[list[str], list[str]]:
        """Return the sources of functions that stand for some of the roots of a module, and the names of its roots with these.

        Numbers that the file of entries gives names to, and functions that these call, come before them.
        """
        if not self.width:
            return [], list(roots)
        file = SourceFile(self.package, text_of(f"{self.package}.entries"), {"REMEMBERS": "initialise" in roots})
        names = [stand_in if (stand_in := f"{name}_{self.kind}") in file.functions else name for name in roots]
        stand_ins = [file.functions[name] for name in names if name in file.functions]
        read = {node.id for function in stand_ins for node in ast.walk(function) if isinstance(node, ast.Name)}
        numbers = [f"{name} = {ast.unparse(value)}" for name, value in file.literals.items() if name in read]
        helpers = [function for name, function in file.functions.items() if name in read]
        return [*numbers, *map(_plain, [*helpers, *stand_ins])], names


NUMBER_TYPES = {
    number.kind: number
    for number in (
        NumberType(kind="float64", dtype="float64"),
        NumberType(kind="float32", dtype="float32", eps="numpy.float32(1.1920929e-07)"),
        NumberType(kind="complex128", dtype="complex128", again=2),
        NumberType(kind="dual", dtype="float64", package="daebench.compiler.dual"),
        NumberType(kind="tangent", dtype="float64", package="daebench.compiler.dual"),
        NumberType(kind="lanes", dtype="float64", package="daebench.compiler.lanes"),
        NumberType(kind="columns", dtype="float64", package="daebench.compiler.columns"),
    )
}


def number_type(name: str) -> NumberType:
    """Return a type by name: "float64", "dual4" for dual numbers with derivatives in 4 directions, "lanes8" for 8 runs at once.

    "tangent1" are dual numbers of one direction, with an entry that brings the derivatives back to length 1 again and again.
    """
    if name in NUMBER_TYPES:
        return NUMBER_TYPES[name]
    kind = name.rstrip("0123456789")
    return replace(NUMBER_TYPES[kind], width=int(name.removeprefix(kind)))


def _plain(function: ast.FunctionDef) -> str:
    """Return the source of a function without annotations."""
    for node in ast.walk(function):
        if isinstance(node, ast.FunctionDef):
            node.returns = None
        elif isinstance(node, ast.arg):
            node.annotation = None
    return ast.unparse(function)
