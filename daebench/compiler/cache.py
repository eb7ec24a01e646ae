"""Generated modules: written once into the user's cache directory under the hash of what made them, then imported."""

import ast
import hashlib
import os
import re
import sys
import types
from collections.abc import Callable
from functools import cache, lru_cache
from importlib.metadata import version
from pathlib import Path

from daebench.compiler import sealed
from daebench.compiler.sealed import CacheWarning, warn
from daebench.systems.files.package import digest_of_packages

__all__ = ["GENERATORS", "CacheWarning", "cache_directory", "generated", "toolchain"]

GENERATORS = ("compiler", "joints", "methods", "runs", "schemes", "systems")
"""Packages that may decide what generated source says: whole ones, so that no file of them can be forgotten."""

LONGEST = 80
"""Most characters of a module's name that are for people: numba's files beside it have its name and a kernel's, in 255 together."""

END = "# end of module, SHA-256 "
"""Beginning of the last line of a generated file: the digest of its name and of all lines before."""

NAME = "daebench_generated_"
"""Beginning of the names of generated modules, and so of all files in the cache directory."""


def cache_directory() -> Path:
    """Return the directory of generated modules: DAEBENCH_CACHE, or the platform's cache directory for this user."""
    chosen = os.environ.get("DAEBENCH_CACHE")
    if chosen:
        return Path(chosen)
    import platformdirs

    return platformdirs.user_cache_path("daebench")


@cache
def toolchain() -> str:
    """Return the text that stands for everything that turns definitions into source: this package's own code and SymPy's version."""
    return f"{digest_of_packages(*GENERATORS)} sympy {version('sympy')} python {sys.version_info[:2]}"


def generated(stem: str, key: str, build: Callable[[bool], str]) -> types.ModuleType:
    """Return the module made by ``build``, from this process, from the cache directory, or newly written there.

    Parameters
    ----------
    stem : str
        First part of the module's name, for people: of a path, and of what is longer than a file may be called, the end is taken.
    key : str
        Text that decides the content, together with :func:`toolchain`; hashed before anything is derived.
    build : callable
        ``build(cached)`` returns the source; ``cached`` says whether numba may keep its machine code beside the file.
    """
    name = _name(stem, f"{key}\n{toolchain()}")
    if name in sys.modules:
        return sys.modules[name]
    path = cache_directory() / f"{name}.py"
    source = "" if (refused := _refusal(path.parent)) else _read(path)
    if not source and not refused:
        source = f"{_with_names_used(build(True))}\n"
        refused = _write(path, source)
    if refused:
        warn(refused)
        return _execute(name, _with_names_used(build(False)), name)
    return _execute(name, source, str(path))


@lru_cache(1000)
def _name(stem: str, text: str) -> str:
    """Return the name of a module, given what decides its content."""
    shown = re.split(r"[/\\]", stem)[-1][-LONGEST:]
    return NAME + "".join(c if c.isalnum() else "_" for c in shown) + f"_{hashlib.sha256(text.encode()).hexdigest()[:16]}"


def _with_names_used(source: str) -> str:
    """Return a source that imports what it uses of NumPy in place of all there is, which takes NumPy longer than to start."""
    import numpy

    names = {node.id for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Name)}
    used = sorted(names & set(numpy.__all__))
    return source.replace("from numpy import *", f"from numpy import {', '.join(used)}" if used else "", 1)


def _refusal(folder: Path) -> str:
    """Return why nothing is kept in a folder; "" where it is this user's and can be kept from others."""
    try:
        why = sealed.refusal(folder, NAME)
    except OSError:
        return f"cannot write to the cache directory {folder}; {ELSEWHERE}."
    return f"the cache directory {folder} {why}, who could change what is run; {ELSEWHERE}." if why else ""


ELSEWHERE = "compiling in memory, set DAEBENCH_CACHE to a writable folder"


def _read(path: Path) -> str:
    """Return the source of a generated module; "" where there is none, and where it is damaged or another's, and so removed."""
    whole = sealed.own(path)
    if whole is not None:
        content, _, last = whole.rpartition(END.encode())
        if last == sealed.digest(path.stem, content) + b"\n":
            return content.decode()
    sealed.remove(path)
    return ""


def _write(path: Path, source: str) -> str:
    """Write the source of a generated module; return why that cannot be done, "" where it is done."""
    content = source.encode()
    try:
        sealed.put(path, content + END.encode() + sealed.digest(path.stem, content) + b"\n")
    except OSError:
        return f"cannot write to the cache directory {path.parent}; {ELSEWHERE}."
    return ""


def _execute(name: str, source: str, file: str) -> types.ModuleType:
    """Return the module of a source; no byte code of it is kept, which nobody would check."""
    module = types.ModuleType(name)
    vars(module).update(__file__=file, __digest__=hashlib.sha256(source.encode()).hexdigest())
    sys.modules[name] = module
    try:
        exec(compile(source, file, "exec"), module.__dict__)
    except BaseException:
        del sys.modules[name]
        raise
    return module
