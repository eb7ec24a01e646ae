"""Machine code made by numba, stored beside its generated module, and checked before it is read.

numba's own cache unpickles whatever it finds, and two processes that compile one function for two types at once can store the code of one
under the key of the other. Here each function has one sealed file for each of its types, see :mod:`daebench.compiler.sealed`.
"""

import hashlib
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import llvmlite
import numba
import numpy
from numba.core import caching, serialize
from numba.core.compiler import CompileResult

from daebench.compiler import sealed
from daebench.compiler.pipeline import Pipeline

MADE_BY = tuple(f"{library.__name__} {library.__version__}" for library in (numba, llvmlite, numpy))
"""Versions and settings on which the machine code of a source depends."""

SUFFIX = ".code"
"""Ending of files of machine code."""


def njit(*, cache: bool = False, **options: Any) -> Callable[[Any], Any]:
    """Return numba's decorator; with ``cache`` the machine code is stored beside the file of the function."""

    def made(function: Any) -> Any:
        compiled = numba.njit(no_cfunc_wrapper=True, pipeline_class=Pipeline, **options)(function)
        if cache:
            compiled._cache = MachineCode(function)
        return compiled

    return made


class MachineCode(caching._Cache):  # type: ignore[misc]
    """Machine code of one function, in one file for each of the types that it is compiled for.

    Parameters
    ----------
    function : function
        A function of a generated module; its globals contain the digest of the module's source, ``__digest__``.
    """

    def __init__(self, function: Any) -> None:
        code = function.__code__
        self._file = Path(code.co_filename)
        self._name = f"{self._file.stem}.{function.__name__}-{code.co_firstlineno}"
        self._digest = function.__globals__["__digest__"]
        self._enabled = True

    @property
    def cache_path(self) -> str:
        """The folder."""
        return str(self._file.parent)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the compiled function for some types; None if it is not stored, or its file is damaged."""
        target_context.refresh()
        if not self._enabled:
            return None
        path, purpose = self._place(sig, target_context.codegen())
        content = sealed.read(path, purpose)
        return None if content is None else CompileResult._rebuild(target_context, *pickle.loads(content))

    def save_overload(self, sig: Any, data: Any) -> None:
        """Store a compiled function; if it cannot be written, the run goes on without it."""
        if not self._enabled or data.lifted or data.library.has_dynamic_globals:
            return
        path, purpose = self._place(sig, data.codegen)
        content = serialize.dumps(data._reduce())
        try:
            sealed.write(path, purpose, content)
        except OSError as error:
            sealed.warn(f"cannot store machine code in {path.parent} ({error.strerror}); it is compiled again next time.")

    def enable(self) -> None:
        """Allow files to be read and written."""
        self._enabled = True

    def disable(self) -> None:
        """Neither read nor write files."""
        self._enabled = False

    def flush(self) -> None:
        """Remove the files of this function."""
        for path in self._file.parent.glob(f"{self._name}.*{SUFFIX}"):
            sealed.remove(path)

    def _place(self, sig: Any, codegen: Any) -> tuple[Path, str]:
        """Return the file for some types, and a text of everything that its content depends on."""
        purpose = "\n".join([self._name, self._digest, str(sig), str(codegen.magic_tuple()), *MADE_BY])
        name = f"{self._name}.{hashlib.sha256(purpose.encode()).hexdigest()[:16]}{SUFFIX}"
        return self._file.with_name(name), purpose
