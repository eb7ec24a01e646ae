"""Calls of functions that are being followed, and the knowledge about their variables."""

import ast
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from daebench.compiler.javascript.statements import Variables


class Again(Exception):
    """A variable turned out to be of another kind than its first value. The next attempt uses this knowledge."""


@dataclass
class Known:
    """Knowledge about variables before a module is followed.

    Parameters
    ----------
    changing : set of (str, str)
        Function and variable, if it is assigned in one block and read in another.
    directions : dict of (str, str, int) to int
        For a function, a variable and a place in it that holds dual numbers: the number of directions.
    """

    changing: set[tuple[str, str]] = field(default_factory=set)
    directions: dict[tuple[str, str, int], int] = field(default_factory=dict)


@dataclass
class Frame:
    """A call of a function that is being followed.

    Parameters
    ----------
    function : str
        Its name.
    changing : set of str
        Variables that are assigned in more than one block.
    values, storage : dict
        Values of the other variables, and storage of the changing ones.
    """

    function: str
    changing: set[str]
    declared: Variables
    label: str
    values: dict[str, Any] = field(default_factory=dict)
    storage: dict[str, Any] = field(default_factory=dict)
    escaped: set[str] = field(default_factory=set)
    depth: int = 0


def several_places(node: ast.FunctionDef, parameters: Sequence[str]) -> set[str]:
    """Return the names of variables that are assigned in more than one block of a function."""
    places: dict[str, set[int]] = {name: {id(node.body)} for name in parameters}

    def look(body: Sequence[ast.stmt]) -> None:
        for statement in body:
            targets = statement.targets if isinstance(statement, ast.Assign) else []
            targets = [statement.target] if isinstance(statement, ast.AugAssign) else targets
            for target in targets:
                for inner in ast.walk(target):
                    if isinstance(inner, ast.Name) and isinstance(inner.ctx, ast.Store):
                        places.setdefault(inner.id, set()).add(id(body))
            for inner_body in (getattr(statement, part, []) for part in ("body", "orelse")):
                look(inner_body)

    look(node.body)
    return {name for name, blocks in places.items() if len(blocks) > 1}
