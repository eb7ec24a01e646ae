"""Names in a function whose values are common to all runs that are computed at once."""

import ast
from collections.abc import Sequence

COMMON = frozenset({"steps", "left", "every", "weights", "states", "stage_lams", "row"})
"""Parameters that are common to all runs."""


def names(node: ast.AST | Sequence[ast.AST], *, stored: bool = False) -> set[str]:
    """Return the names that are read, or that are assigned, in a piece of source."""
    nodes = [node] if isinstance(node, ast.AST) else node
    context = ast.Store if stored else ast.Load
    return {n.id for part in nodes for n in ast.walk(part) if isinstance(n, ast.Name) and isinstance(n.ctx, context)}


class Common:
    """Names in a function whose values are common to all runs."""

    def __init__(self, node: ast.FunctionDef) -> None:
        parameters = {argument.arg for argument in node.args.args}
        self.different = parameters - COMMON
        self.assigned = names(node.body, stored=True)
        before = -1
        while len(self.different) != before:
            before = len(self.different)
            self._statements(node.body, apart=False)

    def __call__(self, node: ast.expr) -> bool:
        """Whether an expression has the same value for all runs."""
        calls = {n.func.id for n in ast.walk(node) if isinstance(n, ast.Call) and isinstance(n.func, ast.Name)}
        return not (names(node) & self.different) and calls <= {"len", "range"}

    def _statements(self, body: Sequence[ast.stmt], *, apart: bool) -> None:
        for node in body:
            if isinstance(node, ast.If):
                inside = apart or not self(node.test)
                self._statements(node.body, apart=inside)
                self._statements(node.orelse, apart=inside)
            elif isinstance(node, ast.For):
                self._assigned(node.target, node.iter, apart)
                self._statements(node.body, apart=apart)
            elif isinstance(node, ast.Assign):
                self._assigned(node.targets[0], node.value, apart)
            elif isinstance(node, ast.AugAssign):
                self._assigned(node.target, node.value, apart)

    def _assigned(self, target: ast.expr, value: ast.expr, apart: bool) -> None:
        if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
            for item, part in zip(target.elts, value.elts, strict=True):
                self._assigned(item, part, apart)
        elif apart or not self(value):
            self.different |= names(target, stored=True)
