"""Unrolling of loops over stages and constraints, so that a step is straight-line code."""

import ast
from collections.abc import Callable, Sequence
from typing import Any

from daebench.compiler.syntax import copied
from daebench.errors import InvalidProblem


class Unroller(ast.NodeTransformer):
    """Rewrites a function of a file by unrolling ranges over a number of stages or of constraints."""

    def __init__(self, where: str) -> None:
        self.where = where
        self.indices: dict[str, int] = {}

    def counts(self, name: str) -> bool:
        """Whether a name denotes the number of stages or of constraints."""
        raise NotImplementedError

    def visited(self, statements: Sequence[ast.stmt]) -> list[ast.stmt]:
        """Return rewritten copies of statements; one statement may become several."""
        copies = [self.visit(copied(statement)) for statement in statements]
        return [statement for item in copies for statement in (item if isinstance(item, list) else [item])]

    def visit_For(self, node: ast.For) -> ast.stmt | list[ast.stmt]:
        """Unroll a loop over stages or constraints."""
        values = self._unrolled(node.iter)
        if values is None:
            visited = self.generic_visit(node)
            assert isinstance(visited, ast.For)
            return visited
        return [statement for value in values for statement in self._with(node.target, value, lambda: self.visited(node.body))]

    def _unrolled(self, node: ast.expr) -> Sequence[int] | None:
        """Return the values of a range over a number of stages or of constraints; None for any other."""
        if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "range"):
            return None
        names = {n.id for argument in node.args for n in ast.walk(argument) if isinstance(n, ast.Name)}
        if not any(map(self.counts, names)):
            return None
        bounds = [ast.unparse(self.visit(copied(argument))) for argument in node.args]
        return range(*(eval(bound, {"__builtins__": {}}) for bound in bounds))

    def _with(self, target: ast.expr, value: int, visit: Callable[[], Any]) -> Any:
        """Return the result of ``visit`` while an index has this value."""
        assert isinstance(target, ast.Name)
        self.indices[target.id] = value
        result = visit()
        del self.indices[target.id]
        return result

    def written_out(self, node: ast.GeneratorExp) -> list[ast.expr]:
        """Return the terms of a generator over stages or constraints."""
        (loop,) = node.generators
        values = self._unrolled(loop.iter)
        if values is None:
            raise InvalidProblem(f"{self.where} loops over {ast.unparse(loop.iter)}; a scheme may loop only over stages or constraints.")
        return [self._with(loop.target, value, lambda: self.visit(copied(node.elt))) for value in values]
