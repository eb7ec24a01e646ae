"""Source files as syntax, and the small rewritings that the linker applies to them."""

import ast
import hashlib
from collections.abc import Callable, Mapping, Sequence
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


def decorated(
    body: str, roots: Sequence[str], cached: bool, constants: Mapping[str, str], *, threaded: bool = False, tuples: bool = False
) -> str:
    """Decorate each function for numba; only the roots, with everything else inside them, are stored on disk and can be called from Python.

    The wrapper of a function for Python takes as long to compile as a small function itself. Functions other than roots are named by their
    text, and are shared with modules in which it is the same, see :func:`daebench.compiler.sharing.shared`; ``constants`` are the texts of
    constants that they read. Functions of at most :data:`INLINED` operations, with all that they call, are inlined into their callers; LLVM
    would call some. With ``threaded`` the roots release the interpreter lock. With ``tuples`` vectors are tuples, and functions that make
    no array are compiled without counts of references to arrays, which takes less time.
    """
    tree = ast.parse(body)
    functions = {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}
    options = f"error_model='numpy'{', cache=True' * cached}{', nogil=True' * threaded}"
    hashed = cache(lambda name: _hash(functions[name], [hashed(callee) for callee in _names(functions[name], functions)], constants))
    size = cache(lambda name: _operations(functions[name], lambda called: size(called) if called in functions else 0))
    numeric = cache(lambda name: all(f in _of_numbers() or (f in functions and numeric(f)) for f in _callees(functions[name])))
    more = {name: ", inlined=True" * (size(name) <= INLINED) + ", numeric=True" * (tuples and numeric(name)) for name in functions}
    for name, node in functions.items():
        decorator = f"njit({options})" if name in roots else f"shared({hashed(name)!r}{more[name]})"
        node.decorator_list = [ast.parse(decorator, mode="eval").body]
    return ast.unparse(tree)


@cache
def _of_numbers() -> frozenset[str]:
    """Return the names of functions whose values are numbers where those of their arguments are."""
    import numpy

    ufuncs = {name for name in numpy.__all__ if isinstance(getattr(numpy, name), numpy.ufunc)}
    return frozenset(ufuncs | {"abs", "bool", "float", "int", "len", "max", "min", "range"})


def _callees(node: ast.FunctionDef) -> list[str]:
    """Return what a function calls, as source."""
    return [ast.unparse(n.func) for n in ast.walk(node) if isinstance(n, ast.Call)]


INLINED = 2000
"""Number of operations of the longest function that is inlined into its callers."""


def _operations(node: ast.FunctionDef, size: Callable[[str], int]) -> int:
    """Return the number of operations of a function, including those of the functions that it calls; ``size`` gives their numbers."""
    calls = [n.func.id for n in ast.walk(node) if isinstance(n, ast.Call) and isinstance(n.func, ast.Name)]
    return sum(isinstance(n, ast.BinOp | ast.UnaryOp | ast.Compare | ast.Call) for n in ast.walk(node)) + sum(map(size, calls))


def _names(node: ast.FunctionDef, functions: Mapping[str, ast.FunctionDef]) -> list[str]:
    """Return which of some functions a function calls, or whose result form it uses, see :func:`daebench.compiler.lanes.nested.absent`."""
    calls = [n for n in ast.walk(node) if isinstance(n, ast.Call) and isinstance(n.func, ast.Name)]
    absent = [n.args[0] for n in calls if isinstance(n.func, ast.Name) and n.func.id == "absent"]
    return sorted({n.id for n in (*(n.func for n in calls), *absent) if isinstance(n, ast.Name)} & set(functions))


def _hash(node: ast.FunctionDef, called: Sequence[str], constants: Mapping[str, str]) -> str:
    """Return the hash of a function's text, of the hashes of the functions that it calls, and of the constants that it reads."""
    read = sorted({n.id for n in ast.walk(node) if isinstance(n, ast.Name)} & set(constants))
    text = "\n".join([ast.unparse(node), *called, *(f"{name} = {constants[name]}" for name in read)])
    return hashlib.sha256(text.encode()).hexdigest()[:16]


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
