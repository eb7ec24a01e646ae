"""Access to the memory of callbacks, handed to numba once for all generated modules that call it."""

import ast
import inspect

from daebench.compiler import callbacks
from daebench.compiler.cache import generated

NAMES = ("head", "words", "numbers", "vector", "matrix", "band", "noted")


def source(cached: bool) -> str:
    """Return the source of :mod:`daebench.compiler.callbacks` with its functions handed to numba."""
    tree = ast.parse(inspect.getsource(callbacks))
    decorator = ast.parse(f"njit(error_model='numpy'{', cache=True' * cached})", mode="eval").body
    for node in tree.body:
        if isinstance(node, ast.FunctionDef):
            node.decorator_list = [decorator]
    tree.body.insert(1, ast.parse("from daebench.compiler.machine_code import njit").body[0])
    return ast.unparse(tree)


_MODULE = generated("callbacks", "callbacks", source)
head, words, numbers, vector, matrix, band, noted = (getattr(_MODULE, name) for name in NAMES)
