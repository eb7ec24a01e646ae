"""Forces in single precision within functions of double precision."""

import ast

from daebench.compiler.syntax import TypedLiterals

FORCES = ("H_q", "U_q")
"""Functions of a problem that are its forces: H_q = U_q of H = T(p) + U(q)."""


class _Rounded(ast.NodeTransformer):
    """Round each entry of an argument to single precision."""

    def visit_Subscript(self, node: ast.Subscript) -> ast.expr:
        """Wrap an entry."""
        return _converted("float32", node)


def in_single(source: str) -> str:
    """Return the source of a function of tuples that computes in float32; its arguments and its results are float64.

    ::

        def U_q(q, par):                            def U_q(q, par):
            q_0 = q[0]                                  q_0 = numpy.float32(q[0])
            return (2.0*q_0, 0.0)                       return (numpy.float64(numpy.float32(2.0)*q_0), ...)
    """
    (function,) = ast.parse(source).body
    assert isinstance(function, ast.FunctionDef)
    *lines, result = function.body
    assert isinstance(result, ast.Return)
    assert isinstance(result.value, ast.Tuple)
    typed = TypedLiterals()
    values = [_converted("float64", typed.visit(value)) for value in result.value.elts]
    function.body = [typed.visit(_Rounded().visit(line)) for line in lines] + [ast.Return(ast.Tuple(values, ast.Load()))]
    return ast.unparse(ast.fix_missing_locations(function)) + "\n"


def _converted(dtype: str, value: ast.expr) -> ast.expr:
    """Return the conversion of a number to one of NumPy's types."""
    return ast.Call(ast.Attribute(ast.Name("numpy", ast.Load()), dtype, ast.Load()), [value], [])
