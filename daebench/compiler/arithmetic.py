"""Arithmetic of numbers in scheme files, written so that every operation has the type of the run and no value is rounded twice."""

import ast
import math

from daebench.compiler.shapes import DATA, NUMBER, Kind


def typed(node: ast.expr, kind: Kind) -> ast.expr:
    """Return an integer as a float where a number of the run's type is wanted: 2 becomes 2.0."""
    if kind in (NUMBER, DATA) and isinstance(node, ast.Constant) and type(node.value) is int:
        return ast.Constant(float(node.value))
    return node


def times(a: ast.expr | None, b: ast.expr | None) -> ast.expr | None:
    """Return a b; None is 1."""
    return b if a is None else a if b is None else ast.BinOp(a, ast.Mult(), b)


def minus(a: ast.expr | None) -> ast.expr:
    """Return -a, with the sign at the first factor; None is 1."""
    if a is None:
        return ast.UnaryOp(ast.USub(), ast.Constant(1.0))
    if isinstance(a, ast.UnaryOp) and isinstance(a.op, ast.USub):
        return a.operand
    if isinstance(a, ast.BinOp) and isinstance(a.op, ast.Mult | ast.Div):
        return ast.BinOp(minus(a.left), a.op, a.right)
    return ast.UnaryOp(ast.USub(), a)


def over(a: ast.expr, b: ast.expr) -> ast.expr:
    """Return a / b. Division by a power of two becomes multiplication by its inverse, which is exact and faster."""
    if not (isinstance(b, ast.Constant) and isinstance(b.value, float) and math.frexp(b.value)[0] == 0.5):
        return ast.BinOp(a, ast.Div(), b)
    inverse = ast.Constant(1.0 / b.value)
    if isinstance(a, ast.Constant):
        return ast.Constant(a.value * inverse.value)  # type: ignore[operator]
    if isinstance(a, ast.UnaryOp) and isinstance(a.op, ast.USub):
        return ast.BinOp(minus(inverse), ast.Mult(), a.operand)
    return ast.BinOp(inverse, ast.Mult(), a)


def power(a: ast.expr, n: ast.expr) -> ast.expr:
    """Return a^n; a square becomes a product."""
    if isinstance(a, ast.Name) and isinstance(n, ast.Constant) and n.value == 2:
        return ast.BinOp(a, ast.Mult(), a)
    return ast.BinOp(a, ast.Pow(), n)
