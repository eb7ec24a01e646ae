"""The docstring of a problem as HTML: its coordinates, prose and formulas, none of which is left out, and the meaning of each parameter."""

import ast
import inspect
import re
from collections.abc import Mapping
from pathlib import Path

from markupsafe import Markup, escape


def docstring(path: Path) -> str:
    """Return the docstring of the function ``problem`` of a file."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    function = next(node for node in tree.body if isinstance(node, ast.FunctionDef) and node.name == "problem")
    return inspect.cleandoc(ast.get_docstring(function) or "")


def description(doc: str) -> Markup:
    """Return a docstring up to its parameters as HTML: paragraphs, and formulas as they are written."""
    text = doc.partition("\nParameters\n")[0].removeprefix("Return ")
    blocks = [block for block in (text[:1].upper() + text[1:]).split("\n\n") if block.strip("\n :")]
    return Markup("\n").join(map(_block, blocks))


def _block(block: str) -> Markup:
    if block.startswith(" "):
        return Markup("<pre><code>{}</code></pre>").format(inspect.cleandoc(block))
    marked = re.sub(r"``(.+?)``", r"<code>\1</code>", str(escape(" ".join(block.split()))))
    return Markup("<p>{}</p>").format(Markup(re.sub(r"\*(\w[^*]*)\*", r"<cite>\1</cite>", marked)))


def meanings(doc: str) -> Mapping[str, str]:
    """Return the meaning of each parameter in a docstring, by name; several names may share a line."""
    texts: dict[str, str] = {}
    names: list[str] = []
    for line in doc.partition("\nParameters\n")[2].splitlines()[1:]:
        if line.startswith(" "):
            texts |= {name: f"{texts.get(name, '')} {line.strip()}".strip() for name in names}
        else:
            names = line.partition(" : ")[0].split(", ")
    return texts
