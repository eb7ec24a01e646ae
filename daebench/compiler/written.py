"""The text of generated modules of which machine code is made: what Python executes, and the functions that are recorded."""

import ast
import inspect
import re
import textwrap
import types
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from daebench.compiler import callbacks
from daebench.compiler.cache import RECORDED


@dataclass(frozen=True)
class Wrapper:
    """Functions that are written beside those of a generated module, and call them."""

    text: str
    """Their source."""
    roots: tuple[str, ...]
    """Names of the functions that are called from Python."""
    derived: Callable[[Any], str] | None = field(default=None, repr=False)
    """Returns the source of further functions, given the derivation of the problem, which alone determines it."""

    def source(self, derivation: Any) -> str:
        """Return their source."""
        return f"{self.text}\n\n{self.derived(derivation)}" if self.derived else self.text


def written(title: str, roots: Sequence[str], recorded: Sequence[str], executed: Sequence[str] = (), others: Sequence[str] = ()) -> str:
    """Return the text of a module."""
    body = "\n\n".join(recorded)
    names = re.findall(r"^def (\w+)\(", body, re.M)
    native = tuple(name for name in roots if name in names or name in others)
    called = {x: of for x, of in callbacks.SIGNATURES.items() if x in names}
    body = "\n\n".join([constants(callbacks), text_of(callbacks.noted), body]) if called else body
    head = [f'"""{title}"""\n\nimport numpy', *executed, f"NATIVE = {native}", f"CALLBACKS = {called}"]
    return "\n".join([*head, RECORDED, body, ""])


def text_of(function: Any) -> str:
    """Return the text of a function without its docstring, and without annotations in it."""
    (node,) = ast.parse(textwrap.dedent(inspect.getsource(function))).body
    for child in ast.walk(node):
        if isinstance(child, ast.FunctionDef):
            child.returns = None
        elif isinstance(child, ast.arg):
            child.annotation = None
    assert isinstance(node, ast.FunctionDef)
    if ast.get_docstring(node) is not None:
        del node.body[0]
    return ast.unparse(node)


def constants(*tables: types.ModuleType) -> str:
    """Return the text that binds the numbers of some modules."""
    numbers = {name: x for table in tables for name, x in vars(table).items() if isinstance(x, int | float) and name.isupper()}
    return "\n".join(f"{name} = {x!r}" for name, x in numbers.items())
