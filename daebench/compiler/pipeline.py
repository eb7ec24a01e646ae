"""numba's compiler, as functions of generated modules are compiled with it: the type of an operation on numbers is found once in a process.

numba finds the type of each sum anew, and tries all that it knows of addition, whole arrays among it. What it finds for numbers depends
on their types alone, and there are few.
"""

from typing import Any

from numba import types
from numba.core.compiler import Compiler

from daebench.compiler.under_way import compiling

SIGNATURES: dict[Any, Any] = {}
"""Signatures by operation and types of numbers, for all functions of this process."""


class MemoisedContext:
    """A typing context of numba that resolves an operation on numbers of the same types once in a process.

    Parameters
    ----------
    context : BaseContext
        The context that resolves it.
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
    """numba's own compiler with a memoised typing context; progress names the module of what is compiled by its first line."""

    def define_pipelines(self) -> Any:
        """Return the passes."""
        self.state.typingctx = MemoisedContext(self.state.typingctx)
        return super().define_pipelines()

    def _compile_core(self) -> Any:
        title = str(self.state.func_id.func.__globals__.get("__doc__") or "functions").partition("\n")[0]
        with compiling(title.rstrip(".")):
            return super()._compile_core()
