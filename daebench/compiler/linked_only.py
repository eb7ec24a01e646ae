"""Functions that only other compiled functions call: numba links them into their callers, and makes no machine code of them alone.

numba optimises each function and makes machine code of it, and does both again for every caller that it is linked into. Of a function that
nothing calls from outside only what is linked is needed: the first steps of fifteen methods came after 24 CPU-s in place of 30, and of nine
methods on two problems, solvers among them, after 36 in place of 41.
"""

from typing import Any

import numba
from numba.core.codegen import JITCodeLibrary
from numba.core.typed_passes import NopythonRewrites
from numba.core.untyped_passes import InlineClosureLikes

from daebench.compiler.pipeline import Pipeline


class _NoEnvironments:
    """What sets the environment of a function, an object of Python, where there is no address to put it: no generated function has one."""

    def __init__(self, codegen: Any) -> None:
        self._codegen = codegen

    def __getattr__(self, name: str) -> Any:
        return getattr(self._codegen, name)

    def set_env(self, env_name: str, env: Any) -> None:
        """Do nothing."""


class _Linked(JITCodeLibrary):  # type: ignore[misc]
    """The code of a function as LLVM has it, to be linked into other code."""

    @property
    def codegen(self) -> Any:
        """The generator of code."""
        return _NoEnvironments(self._codegen)

    def _optimize_final_module(self) -> None:
        """Do nothing: what it is linked into is optimised as a whole."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True


UNNEEDED = (InlineClosureLikes, NopythonRewrites)
"""Passes of numba's own compiler for what these functions have not: functions inside functions, and sums of whole arrays."""


class _Compiler(Pipeline):
    def define_pipelines(self) -> Any:
        """Return the passes of numba's own compiler but some, which put the code into a library that is only linked."""
        self.state.library = _Linked(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
        pipelines = super().define_pipelines()
        for pipeline in pipelines:
            pipeline.passes = [(which, about) for which, about in pipeline.passes if which not in UNNEEDED]
            pipeline.finalize()
        return pipelines


def linked_only(function: Any, **options: Any) -> Any:
    """Return a function that numba compiles for the functions that call it; nothing else can call it."""
    wrappers = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    return numba.njit(error_model="numpy", pipeline_class=_Compiler, **wrappers, **options)(function)
