"""Source files as syntax, and the small rewritings that the linker applies to them."""

import ast
from collections.abc import Mapping, Sequence
from functools import cache, reduce
from typing import Any

LANGUAGE = "daebench.schemes.kernels.language"
LANGUAGES = (LANGUAGE, "daebench.schemes.kernels.poisson_language", "daebench.schemes.kernels.spaces")
"""The files that declare the names which the linker provides; their declarations form one set of names."""

DATA = "scheme_data"
"""Name of the run-time data of scheme and form. Only functions that read them get them, so that others are the same for all schemes."""

RUN_TIME = {"DATA": f"{DATA}[0]", "FORM_DATA": f"{DATA}[1]", "LENGTH": "par[{0}][0]", "RATE": "par[{0}][1]"}
RUN_TIME |= {"ITERATIONS_ASKED": f"{DATA}[2][0]", "ROUNDINGS": f"{DATA}[2][1]"}
"""Places of the run-time data; length and rate come after the problem's parameters, whose number is inserted."""


@cache
def _statements(text: str) -> Sequence[ast.stmt]:
    """Return the statements of a source text, which nobody may change: all linkers share them."""
    return ast.parse(text).body


class SourceFile:
    """One source file as syntax, with its constant ``if`` statements settled.

    ``imports`` joins both files of the language, ``homes`` distinguishes them; ``lowered`` holds the functions with operators replaced.
    """

    def __init__(self, name: str, text: str, constants: Mapping[str, bool | int | float]) -> None:
        self.name = name
        self.functions: dict[str, ast.FunctionDef] = {}
        self.lowered: dict[str, ast.FunctionDef] = {}
        self.literals: dict[str, ast.Constant] = {}
        self.imports: dict[str, tuple[str, str]] = {}
        self.homes: dict[str, tuple[str, str]] = {}
        self.aliases: dict[str, ast.expr] = {}
        self.annotations: dict[str, ast.expr] = {}
        self._read(_statements(text), constants)

    def _read(self, body: Sequence[ast.stmt], constants: Mapping[str, bool | int | float]) -> None:
        for node in body:
            if isinstance(node, ast.FunctionDef):
                self.functions[node.name] = node
            elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith(("daebench.schemes.kernels", "daebench.schemes")):
                module = LANGUAGE if node.module in LANGUAGES else str(node.module)
                self.imports |= {alias.asname or alias.name: (module, alias.name) for alias in node.names}
                self.homes |= {alias.asname or alias.name: (str(node.module), alias.name) for alias in node.names}
            elif isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id in constants:
                self._read(node.body if constants[node.test.id] else node.orelse, constants)
            elif isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
                self._assigned(node.targets[0].id, node.value)
            elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
                self.annotations[node.target.id] = node.annotation

    def _assigned(self, name: str, value: ast.expr) -> None:
        """Record a literal, or an expression that may name a kind of value."""
        if isinstance(value, ast.Constant):
            self.literals[name] = value
        else:
            self.aliases[name] = value


class TypedLiterals(ast.NodeTransformer):
    """Give every float literal the type float32, so that none promotes a result."""

    def visit_Constant(self, node: ast.Constant) -> ast.expr:
        """Wrap a float."""
        return ast.parse(f"numpy.float32({node.value!r})", mode="eval").body if isinstance(node.value, float) else node


def gathered(name: str, terms: Sequence[ast.expr]) -> ast.expr:
    """Return a tuple, a sum, a minimum or a maximum of terms."""
    if name == "tuple":
        return ast.Tuple(list(terms), ast.Load())
    if name == "sum":
        return reduce(lambda x, y: ast.BinOp(x, ast.Add(), y), terms)
    return terms[0] if len(terms) == 1 else call(name, terms)


def call(name: str, arguments: Sequence[ast.expr]) -> ast.Call:
    """Return the call of a function by name."""
    return ast.Call(ast.Name(name, ast.Load()), list(arguments), [])


def copied(node: Any) -> Any:
    """Return a copy of syntax that shares nothing that can be changed with it; ``copy.deepcopy`` takes three times as long."""
    if type(node) is list:
        return [copied(part) for part in node]
    if not isinstance(node, ast.AST) or not node._fields:
        return node
    new = type(node).__new__(type(node))
    new.__dict__ = {name: copied(part) for name, part in node.__dict__.items()}
    return new


def parameters_of(node: ast.FunctionDef) -> list[str]:
    """Return the names of a function's parameters."""
    return [argument.arg for argument in node.args.args]


def called(node: ast.FunctionDef) -> list[str]:
    """Return the parameters of a function that it calls."""
    calls = {n.func.id for n in ast.walk(node) if isinstance(n, ast.Call) and isinstance(n.func, ast.Name)}
    return [parameter for parameter in parameters_of(node) if parameter in calls]
