"""The imports of the package as a graph: every import statement of every file, those inside functions and under TYPE_CHECKING included."""

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
FOLDERS = {"daebench": ROOT / "daebench", **{f"daebench.{name}": ROOT / name for name in ("problems", "reference", "reports")}}


def modules() -> dict[str, Path]:
    """Return the files of the package by the names of their modules."""
    found = {}
    for package, folder in FOLDERS.items():
        for file in sorted(folder.rglob("*.py")):
            parts = file.relative_to(folder).with_suffix("").parts
            if not (package == "daebench" and parts[0] in ("problems", "reference", "reports")):
                found[".".join([package, *(part for part in parts if part != "__init__")])] = file
    return found


@cache
def imports() -> dict[str, set[str]]:
    """Return the modules that each module imports; a name that is imported from a package counts as an import of the package."""
    files = modules()
    return {name: {*_imported(ast.parse(file.read_text(encoding="utf-8")), files)} - {name} for name, file in files.items()}


def _imported(tree: ast.Module, files: dict[str, Path]) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in files)
        elif isinstance(node, ast.ImportFrom) and node.module in files:
            yield from (f"{node.module}.{alias.name}" if f"{node.module}.{alias.name}" in files else node.module for alias in node.names)


def circles(graph: dict[str, set[str]]) -> list[list[str]]:
    """Return the modules that import each other in a circle: what is left when modules without imports, or importers, are taken away."""
    left = dict(graph)
    while True:
        imported = {target for targets in left.values() for target in targets}
        inner = {name: targets & set(left) for name, targets in left.items() if targets & set(left) and name in imported}
        if inner == left:
            return sorted([name, *sorted(targets)] for name, targets in left.items())
        left = inner


def rooms(graph: dict[str, set[str]]) -> dict[str, set[str]]:
    """Return the same graph between the packages directly below daebench."""
    found: dict[str, set[str]] = {}
    for name, targets in graph.items():
        if (room := _room(name)) is not None:
            found.setdefault(room, set()).update(other for target in targets if (other := _room(target)) not in (None, room))
    return found


def _room(module: str) -> str | None:
    parts = module.split(".")
    return parts[1] if len(parts) > 1 and parts[1] != "__main__" else None


def reduced(graph: dict[str, set[str]]) -> set[tuple[str, str]]:
    """Return the arrows of a graph without circles that do not follow from others."""
    reach: dict[str, set[str]] = {}

    def reached(name: str) -> set[str]:
        if name not in reach:
            reach[name] = set().union(*(({target} | reached(target)) for target in graph.get(name, ())), set())
        return reach[name]

    return {
        (name, target)
        for name, targets in graph.items()
        for target in targets
        if not any(target in reached(other) for other in targets - {target})
    }
