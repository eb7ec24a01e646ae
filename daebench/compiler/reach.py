"""The functions that a function of a file calls, and the work that one call counts for: read from its syntax, without running it."""

import ast
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Protocol

from daebench.compiler.files import Function, Name
from daebench.compiler.syntax import path_of, unrolled
from daebench.errors import InvalidProblem


class Linking(Protocol):
    """Interface of the linker for reading a function; :class:`daebench.compiler.link.Linker` describes the results."""

    @property
    def kinds(self) -> Sequence[str]:
        """Kinds of work that are counted."""
        ...

    def reached(self, function: Function, bound: Mapping[str, str]) -> str:
        """Read a function of a file with these functions for its callable parameters; return its key."""
        ...

    def needed(self, name: str) -> str:
        """Provide a name of the scheme language; return the key of its function."""
        ...

    def work_of(self, key: str, name: str) -> Sequence[int]:
        """Return the work that one call of a function counts for."""
        ...

    def iterates(self, update: str) -> None:
        """Take note of a function whose calls are counted by number of iterations."""
        ...


class Reach(ast.NodeVisitor):
    """Reads one function: asks for what it calls, and adds up the work of its calls."""

    def __init__(self, linker: Linking, function: Function, bound: Mapping[str, str]) -> None:
        self.linker, self.module, self.bound = linker, function.module, bound
        self.names = function.plain.__globals__
        self.work = [0] * len(linker.kinds)
        self.calls: dict[str, int] = {}
        self.branches = 0
        self.indices: dict[str, int] = {}
        for statement in function.node.body:
            self.visit(statement)

    def _known(self, name: str) -> Any:
        """Return the value of a constant of the language, or of an index; None for another name."""
        value = self.indices.get(name, self.names.get(name))
        return value if isinstance(value, int | float) else None

    def visit_If(self, node: ast.If) -> None:
        """Read the side that is taken of a branch on a constant of the language; of any other branch, both sides."""
        if isinstance(node.test, ast.Name) and (known := self._known(node.test.id)) is not None:
            for statement in node.body if known else node.orelse:
                self.visit(statement)
        else:
            self.generic_visit(node)

    def generic_visit(self, node: ast.AST) -> None:
        """Keep track of branches and loops: the number of calls inside them is not known."""
        inside = isinstance(node, ast.If | ast.For | ast.While | ast.IfExp | ast.BoolOp | ast.comprehension)
        self.branches += inside
        super().generic_visit(node)
        self.branches -= inside

    def visit_For(self, node: ast.For) -> None:
        """Read a loop over stages or constraints as often as it turns."""
        over = node.iter.args[0] if isinstance(node.iter, ast.Call) and node.iter.args else node.iter
        if not unrolled(over):
            self.generic_visit(node)
            return
        for _ in self._turns(over, node.target):
            for statement in node.body:
                self.visit(statement)

    def visit_GeneratorExp(self, node: ast.GeneratorExp) -> None:
        """Read terms as often as there are."""
        (loop,) = node.generators
        if not unrolled(loop.iter):
            raise self._refused(node, "a generator may be over stages or constraints alone")
        for _ in self._turns(loop.iter, loop.target):
            self.visit(node.elt)

    def _turns(self, over: ast.expr, target: ast.expr) -> Iterator[None]:
        assert isinstance(target, ast.Name)
        known = {part.id: self._known(part.id) for part in ast.walk(over) if isinstance(part, ast.Name) and part.id != "range"}
        for self.indices[target.id] in eval(ast.unparse(over), {"__builtins__": {}, "range": range, **known}):
            yield
        self.indices.pop(target.id, None)

    def visit_Call(self, node: ast.Call) -> None:
        """Ask for the function that is called, and count its work."""
        if not isinstance(node.func, ast.Name):
            self.generic_visit(node)
            return
        name, callee = node.func.id, self.names.get(node.func.id)
        slots: Sequence[str] = ()
        if isinstance(callee, Name) and callee.name == "tally":
            assert isinstance(node.args[0], ast.Name)
            self.linker.iterates(self.bound[node.args[0].id])
            slots = ["update"]
        elif name in self.bound:
            self.calls[self.bound[name]] = self.calls.get(self.bound[name], 0) + 1
            if not self.branches:  # an iteration counts its own loop
                self._count(node, self.linker.work_of(self.bound[name], self.bound[name]))
        elif isinstance(callee, Name | Function):
            slots = self._asked(callee, node)
        for place, argument in enumerate(node.args):
            if place >= len(slots) or not slots[place]:
                self.visit(argument)

    def _asked(self, callee: Name | Function, node: ast.Call) -> Sequence[str]:
        """Ask for a function; return the names of its parameters that are called, in the places of its arguments."""
        slots: list[str] = []
        if isinstance(callee, Name):
            key = self.linker.needed(callee.name)
        else:
            slots, bound = _called(callee.node), dict[str, str]()
            for slot, argument in zip(slots, node.args, strict=False):
                if slot:
                    if not isinstance(argument, ast.Name):
                        raise self._refused(argument, "a function is passed by its name")
                    bound[slot] = self.bound.get(argument.id) or self.linker.reached(self.names[argument.id], {})
            key = self.linker.reached(callee, bound)
        self.calls[key] = self.calls.get(key, 0) + 1
        self._count(node, self.linker.work_of(key, callee.name))
        return slots

    def _refused(self, node: ast.expr, why: str) -> InvalidProblem:
        return InvalidProblem(f"{path_of(self.module)}, line {node.lineno}: {ast.unparse(node)}: {why}.", "scheme-out-of-reach")

    def _count(self, node: ast.Call, work: Sequence[int]) -> None:
        """Add the work of one call. Work in branches cannot be counted, except in the loop over steps, which counts its own steps."""
        if any(work) and self.branches and not self.module.endswith(".loop"):
            raise self._refused(node, "in a branch or a loop its work cannot be counted; call it unconditionally")
        self.work = [mine + more for mine, more in zip(self.work, work, strict=True)]


def _called(node: ast.FunctionDef) -> list[str]:
    """Return the parameters of a function that it calls, "" in the places of others."""
    calls = {n.func.id for n in ast.walk(node) if isinstance(n, ast.Call) and isinstance(n.func, ast.Name)}
    return [argument.arg if argument.arg in calls else "" for argument in node.args.args]
