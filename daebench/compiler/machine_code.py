"""Machine code made by numba, stored beside its generated module, and checked before it is read.

numba's own cache unpickles whatever it finds, and two processes that compile one function for two types at once can store the code of one
under the key of the other. Here each function has one sealed file for each of its types, see :mod:`daebench.compiler.sealed`.
"""

import hashlib
import pickle
from collections.abc import Callable, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import llvmlite
import numba
import numpy
from numba.core import caching, serialize, sigutils
from numba.core.ccallback import CFunc
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


def inlined(function: Any) -> Any:
    """Return a function that is inlined into its callers before they are compiled. It is never compiled alone, which halves the time."""
    return numba.njit(error_model="numpy", inline="always")(function)


class Callback:
    """A function of a generated module as a C function, compiled when its address is first asked for.

    Parameters
    ----------
    function : function
        The function.
    signature : str
        Its C types, as ``numba.cfunc`` takes them.
    cached : bool
        Whether the machine code is stored beside the file of the function.
    options : mapping of str to object
        Options of the compilation.
    """

    def __init__(self, function: Any, signature: str, cached: bool, options: Mapping[str, Any]) -> None:
        self._function, self._signature, self._cached, self._options = function, signature, cached, options

    @cached_property
    def address(self) -> int:
        """Its address, which is valid as long as this object exists."""
        signature = sigutils.normalize_signature(self._signature)
        compiled: Any = CFunc(self._function, signature, locals={}, options=dict(self._options), pipeline_class=Pipeline)
        if self._cached:
            compiled._cache = MachineCode(self._function)
        compiled.compile()
        self._compiled = compiled
        return int(compiled.address)


def callback(signature: str, *, cache: bool = False, **options: Any) -> Callable[[Any], Callback]:
    """Return the decorator of a function that C calls; with ``cache`` the machine code is stored beside the file of the function."""
    return lambda function: Callback(function, signature, cache, options)


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
