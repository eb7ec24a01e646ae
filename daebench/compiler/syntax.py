"""The syntax of files of schemes, prepared to be executed; texts of functions, in double and in single precision."""

import ast
import linecache
from collections.abc import Iterable, Mapping, Sequence

from daebench.errors import InvalidProblem


def function(signature: str, *lines: str) -> str:
    """Return the source of a function with these lines as its body."""
    return f"def {signature}:\n    " + "\n    ".join(lines) + "\n"


def pack(items: Iterable[str]) -> str:
    """Return the source of a tuple of these items."""
    inner = ", ".join(items)
    return f"({inner},)" if inner else "()"


PREFIX = "scheme:"
"""Beginning of the file name of compiled files of schemes."""


def placed(error: BaseException) -> InvalidProblem | None:
    """Return an error with file, line and expression of the innermost statement of a file in which it was raised; None if in none."""
    trace, innermost = error.__traceback__, None
    while trace:
        if trace.tb_frame.f_code.co_filename.startswith(PREFIX):
            innermost = trace
        trace = trace.tb_next
    if innermost is None:
        return None
    module = innermost.tb_frame.f_code.co_filename.removeprefix(PREFIX)
    positions = list(innermost.tb_frame.f_code.co_positions())[innermost.tb_lasti // 2]
    first, last, begin, end = (0 if x is None else x for x in positions)
    lines = linecache.getlines(f"{PREFIX}{module}")[first - 1 : last]
    lines[-1] = lines[-1][:end]
    text = " ".join(line.strip() for line in [lines[0][begin:], *lines[1:]])
    return InvalidProblem(f"{path_of(module)}, line {first}: {text}: {error}.", "scheme-syntax-error")


def path_of(module: str) -> str:
    """Return the path of a file."""
    return f"{module.replace('.', '/')}.py"


LANGUAGE = "daebench.schemes.kernels.language"
LANGUAGES = (LANGUAGE, "daebench.schemes.kernels.poisson_language", "daebench.schemes.kernels.spaces")
"""The files that declare the names of the scheme language; their declarations form one set of names."""

RUN_TIME: Mapping[str, tuple[int, ...]] = {"LENGTH": (0, 0), "RATE": (0, 1), "DATA": (1,), "FORM_DATA": (2,)}
RUN_TIME = {**RUN_TIME, "ITERATIONS_ASKED": (3, 0), "ROUNDINGS": (3, 1)}
"""Places of the run-time data behind the parameters of the problem, in what each function gets last."""


class _Prepared(ast.NodeTransformer):
    """Changes the syntax of a file: run-time data are asked for, and values that are bound, chosen or returned are made whole."""

    def __init__(self, path: str, deferred: bool, single: bool) -> None:
        self.path, self.inside, self.deferred, self.single = path, False, deferred, single

    def visit_Constant(self, node: ast.Constant) -> ast.expr:
        typed = self.inside and self.single and isinstance(node.value, float)
        return ast.copy_location(call("float32", [node]), node) if typed else node

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.FunctionDef:
        self.inside = True
        node.body = [self.visit(statement) for statement in node.body]
        self.inside = False
        return node

    def visit_Name(self, node: ast.Name) -> ast.expr:
        if self.inside and node.id in RUN_TIME:
            return ast.copy_location(call("_run_time", [ast.Constant(node.id)]), node)
        return node

    def _whole(self, node: ast.expr) -> ast.expr:
        """Return an expression that is whole: sums, multiples and transposes are made so."""
        wanting = self.inside and isinstance(node, ast.BinOp | ast.UnaryOp | ast.Attribute)
        return ast.copy_location(call("_whole", [node]), node) if wanting else node

    def visit_Call(self, node: ast.Call) -> ast.Call:
        self.generic_visit(node)
        if not (isinstance(node.func, ast.Name) and node.func.id == "range"):
            node.args = [self._whole(argument) for argument in node.args]
        return node

    def visit_Tuple(self, node: ast.Tuple) -> ast.Tuple:
        self.generic_visit(node)
        node.elts = [self._whole(entry) for entry in node.elts]
        return node

    def visit_List(self, node: ast.List) -> ast.List:
        self.generic_visit(node)
        node.elts = [self._whole(entry) for entry in node.elts]
        return node

    def visit_GeneratorExp(self, node: ast.GeneratorExp) -> ast.GeneratorExp:
        self.generic_visit(node)
        node.elt = self._whole(node.elt)
        return node

    def visit_Assign(self, node: ast.Assign) -> ast.Assign:
        node.value = self._whole(self.visit(node.value))
        return node

    def visit_AugAssign(self, node: ast.AugAssign) -> ast.Assign:
        assert isinstance(node.target, ast.Name)
        value = ast.copy_location(ast.BinOp(ast.Name(node.target.id, ast.Load()), node.op, self.visit(node.value)), node)
        return ast.copy_location(ast.Assign([node.target], self._whole(value)), node)

    def visit_Return(self, node: ast.Return) -> ast.Return:
        node.value = node.value and self._whole(self.visit(node.value))
        return node

    def visit_IfExp(self, node: ast.IfExp) -> ast.expr:
        self.generic_visit(node)
        node.body, node.orelse = self._whole(node.body), self._whole(node.orelse)
        if not self.deferred:
            return node
        nothing = ast.arguments(posonlyargs=[], args=[], kwonlyargs=[], kw_defaults=[], defaults=[])
        return ast.copy_location(call("selected", [node.test, *(ast.Lambda(nothing, side) for side in (node.body, node.orelse))]), node)

    def visit_Global(self, node: ast.Global) -> ast.Global:
        raise self._refused(node, "a scheme changes no global name")

    def visit_While(self, node: ast.While) -> ast.While:
        raise self._refused(node, "a loop needs a bound, as for k in range(n) has")

    def _refused(self, node: ast.stmt, why: str) -> InvalidProblem:
        return InvalidProblem(
            f"{self.path}, line {node.lineno}: {ast.unparse(node).splitlines()[0].rstrip(':')}: {why}.", "scheme-syntax-refused"
        )

    def visit_For(self, node: ast.For) -> ast.For:
        self.generic_visit(node)
        if unrolled(node.iter):
            node.iter = ast.copy_location(call("_unrolled", [node.iter]), node.iter)
        return node


def unrolled(node: ast.expr) -> bool:
    """Whether an expression is a range over the number of stages or of constraints."""
    ranged = isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "range"
    return ranged and any(isinstance(part, ast.Name) and part.id in ("STAGES", "CONSTRAINTS") for part in ast.walk(node))


def steers(node: ast.AST) -> bool:
    """Whether a function has branches, loops or tests."""
    kinds = (ast.If, ast.For, ast.While, ast.IfExp, ast.BoolOp, ast.Compare, ast.Not)
    return any(isinstance(part, kinds) for part in ast.walk(node))


def prepared(path: str, text: str, deferred: bool, single: bool) -> ast.Module:
    """Return a file of a scheme as it is executed.

    ``deferred`` choices call ``selected`` with functions; numbers of ``single`` precision are made by ``float32``.
    """
    tree = ast.parse(text)
    _Prepared(path, deferred, single).visit(tree)
    return ast.fix_missing_locations(tree)


class TypedLiterals(ast.NodeTransformer):
    """Give every float literal the type float32, so that none promotes a result."""

    def visit_Constant(self, node: ast.Constant) -> ast.expr:
        """Wrap a float."""
        return ast.parse(f"numpy.float32({node.value!r})", mode="eval").body if isinstance(node.value, float) else node


def call(name: str, arguments: Sequence[ast.expr]) -> ast.Call:
    """Return the call of a function by name."""
    return ast.Call(ast.Name(name, ast.Load()), list(arguments), [])


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
