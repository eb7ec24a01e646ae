"""How numba compiles functions of generated modules: as its own compiler does, with its rules for numbers applied once in a process.

Where two numbers are added, numba tries all that it knows of addition, whole arrays among it, and tries again at the next sum. Types of
numbers decide what comes of it, and there are few: with a memory the first steps of twenty methods come after 42 CPU-s in place of 44.
"""

from typing import Any

from numba import types
from numba.core.compiler import Compiler

SIGNATURES: dict[Any, Any] = {}
"""Signature by operation and types, for all functions of this process."""


class Remembered:
    """A typing context of numba that resolves an operation on numbers of the same types once.

    Parameters
    ----------
    context : BaseContext
        What resolves it.
    """

    def __init__(self, context: Any) -> None:
        self._context = context

    def __getattr__(self, name: str) -> Any:
        return getattr(self._context, name)

    def resolve_function_type(self, function: Any, arguments: Any, named: Any) -> Any:
        """Return the signature of a call, as numba's own context does."""
        numbers = all(isinstance(argument, types.Number | types.Boolean) for argument in arguments)
        if named or not numbers or not isinstance(function, types.Function):
            return self._context.resolve_function_type(function, arguments, named)
        call = function, tuple(arguments)
        if call not in SIGNATURES:
            SIGNATURES[call] = self._context.resolve_function_type(function, arguments, named)
        return SIGNATURES[call]


class Pipeline(Compiler):  # type: ignore[misc]
    """numba's own compiler with that memory."""

    def define_pipelines(self) -> Any:
        """Return the passes."""
        self.state.typingctx = Remembered(self.state.typingctx)
        return super().define_pipelines()
