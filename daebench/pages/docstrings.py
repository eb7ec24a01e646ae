"""The docstring of a problem: that of the function ``problem`` in the text of its file, and the meaning of each parameter in it."""

import ast
import inspect
import re
from collections.abc import Mapping


def docstring(text: str) -> str:
    """Return the docstring of the function ``problem`` in a text; "" if it has none."""
    functions = [node for node in ast.parse(text).body if isinstance(node, ast.FunctionDef) and node.name == "problem"]
    return inspect.cleandoc(ast.get_docstring(functions[0]) or "") if functions else ""


def meanings(doc: str) -> Mapping[str, str]:
    """Return the meaning of each parameter in a docstring, by name; several names may share a line."""
    texts: dict[str, str] = {}
    names: list[str] = []
    for line in re.split(r"\n\w[\w ]*\n-+\n", doc.partition("\nParameters\n")[2])[0].splitlines()[1:]:
        if line.startswith(" "):
            texts |= {name: f"{texts.get(name, '')} {line.strip()}".strip() for name in names}
        else:
            names = line.partition(" : ")[0].split(", ")
    return texts
