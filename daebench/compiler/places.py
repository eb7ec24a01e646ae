"""Names of functions of scheme files in generated modules, and the way back from a name to its file."""

import ast
from pathlib import Path

UNIQUE = ("loop", "constrained", "poisson", "composed", "mechanical", "rank", "canonical")
"""Files whose functions keep their names."""


def emitted(module: str, name: str) -> str:
    """Return the name that a function of a file has in a generated module."""
    file = module.rsplit(".", 1)[1]
    return name if file in UNIQUE else f"{file}_{name}"


def place_of(name: str) -> str:
    """Return file and line of a function of a generated module, or its name where it is of no file: a problem's function, for example."""
    import daebench.schemes

    folder = Path(str(daebench.schemes.__file__)).parent
    for path in sorted(folder.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef) and emitted(f"schemes.{path.stem}", node.name) == name.partition("__")[0]:
                return f"{node.name} of daebench/schemes/{path.relative_to(folder).as_posix()}, line {node.lineno}"
    return f"its function {name}"
