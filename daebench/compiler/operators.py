"""Operators in scheme files, replaced by operations of the algebra before linking: ``q0 + h * v`` becomes ``axpy(h, v, q0)``.

Annotations and the declarations of ``kernels/language.py`` give every expression a kind, see :mod:`daebench.compiler.shapes`. The kinds of
names are followed through assignments, branches and loops.
"""

import ast
import copy
from collections.abc import Mapping, Sequence

from daebench.compiler import shapes
from daebench.compiler.expressions import NUMBERS, Expressions
from daebench.compiler.shapes import INDEX, Kind, said


class Lowering(Expressions):
    """Replaces the operators in one function of a scheme file; the parameters are those of :class:`Expressions`."""

    def function(self, node: ast.FunctionDef) -> ast.FunctionDef:
        """Return the function with calls in place of operators.

        Raises
        ------
        InvalidProblem
            If shapes do not match, or a kind is not known; the message gives the file, the line and the expression.
        """
        self.kinds = {argument.arg: self.scope.annotated(argument.annotation) for argument in node.args.args}
        self.result = self.scope.annotated(node.returns)
        lowered = copy.copy(node)
        lowered.body = self._block(node.body)
        if taken := self.used & self.kinds.keys():
            raise self._refusal(node, f"{min(taken)} is the name of an operation; give the variable another", node.name)
        return ast.fix_missing_locations(lowered)

    def _block(self, statements: Sequence[ast.stmt]) -> list[ast.stmt]:
        return [self._statement(statement) for statement in statements]

    def _statement(self, node: ast.stmt) -> ast.stmt:
        """Return a statement with its operators replaced, and record the kinds of the names that it assigns."""
        lowered = node
        match node:
            case ast.Assign(targets=[target], value=value):
                expression = self._whole(value)
                self._bind(target, expression.kind, value)
                lowered = ast.Assign([target], expression.node)
            case ast.AugAssign(target=ast.Name() as target):
                lowered = self._changed(node, target)
            case ast.Return(value=ast.expr() as value):
                lowered = ast.Return(self._returned(value))
            case ast.Expr(value=ast.Call() as value):
                lowered = ast.Expr(self._whole(value).node)
            case ast.If():
                lowered = self._branches(node)
            case ast.For():
                lowered = self._loop(node)
            case ast.Expr(value=ast.Constant()) | ast.Pass():
                pass
            case _:
                raise self._refusal(node, "a scheme may only contain assignments, branches and loops")
        return ast.copy_location(lowered, node)

    def _changed(self, node: ast.AugAssign, target: ast.Name) -> ast.stmt:
        """Return ``x += y`` unchanged for numbers, and as ``x = x + y`` otherwise."""
        operation = self._finished(self._operation(ast.copy_location(ast.BinOp(target, node.op, node.value), node)))
        self._bind(target, operation.kind, node.value)
        if operation.kind in NUMBERS and isinstance(operation.node, ast.BinOp):
            return ast.AugAssign(target, node.op, operation.node.right)
        return ast.Assign([target], operation.node)

    def _returned(self, value: ast.expr) -> ast.expr:
        expression = self._whole(value)
        if not shapes.fits(expression.kind, self.result):
            raise self._refusal(value, f"its annotation says {said(self.result)}, but the function returns {said(expression.kind)} here")
        return expression.node

    def _branches(self, node: ast.If) -> ast.If:
        test = self._whole(node.test).node
        before = dict(self.kinds)
        body, after_body = self._block(node.body), self.kinds
        self.kinds = before
        orelse = self._block(node.orelse)
        self.kinds = _merged(after_body, self.kinds)
        return ast.If(test, body, orelse)

    def _loop(self, node: ast.For) -> ast.For:
        """Return a loop; a variable whose kind changes in the loop has no known kind there."""
        before = dict(self.kinds)
        self._bind(node.target, INDEX, node.iter)
        self._block(node.body)
        self.kinds = _merged(before, self.kinds)
        self._bind(node.target, INDEX, node.iter)
        return ast.For(node.target, self._whole(node.iter).node, self._block(node.body), self._block(node.orelse))


def _merged(one: Mapping[str, Kind], other: Mapping[str, Kind]) -> dict[str, Kind]:
    """Return the kinds after either of two branches."""
    return {name: shapes.joined([one.get(name, other.get(name)), other.get(name, one.get(name))]) for name in {*one, *other}}
