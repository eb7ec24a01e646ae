"""Files of schemes run as Python does, on numbers of Python and NumPy."""

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from daebench.compiler import values
from daebench.compiler.files import Files, Function, Operation, Space, roots


class Plain:
    """The machine that does so; ``space`` has the names of the generated module."""

    names: Space = {"float32": np.float32}  # noqa: RUF012

    def __init__(self, space: Space) -> None:
        self.space = space

    def add(self, text: str) -> None:
        """Add functions to the generated module, given by their source, and what they take from NumPy."""
        for name in {*re.findall(r"\w+", text)} & {*np.__all__}:
            self.space.setdefault(name, getattr(np, name))
        exec(text, self.space)

    def take(self, name: str, operation: Operation) -> None:
        """Add an operation to the generated module."""
        self.space[name] = operation

    def body(self, function: Function) -> Operation:
        """Return the function itself, whose errors of type are misfits."""

        def run(*args: Any) -> Any:
            try:
                return function.plain(*args)
            except TypeError as error:
                raise values.Misfit(str(error)).with_traceback(error.__traceback__) from error

        return run


def files(space: Space, plan: Mapping[str, Any], algebra: str) -> Files:
    """Return the files of a generated module, whose names get those of its roots, for Python."""
    scheme_files = Files(plan, Plain(space), algebra)
    space.update(roots(scheme_files))
    return scheme_files
