"""Generated modules: their text; written once into the user's cache directory under the hash of all that determines them, then imported."""

import hashlib
import os
import re
import sys
import types
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache, lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from daebench.compiler import callbacks, sealed
from daebench.compiler.sealed import warn
from daebench.compiler.syntax import constants, text_of
from daebench.systems.files.package import digest_of_packages

GENERATORS = ("compiler", "joints", "methods", "runs", "schemes", "systems")
"""Packages that may determine the generated source. They are hashed whole, so that no file of them can be forgotten."""

LONGEST = 80
"""Maximum length of the readable part of a module's name: object files append a function's name and a key, and the limit is 255 letters."""

END = "# end of module, SHA-256 "
"""Beginning of the last line of a generated file. The digest of the file's name and of all lines before follows."""

NAME = "daebench_generated_"
"""Beginning of the names of generated modules, and so of all files in the cache directory."""


def cache_directory() -> Path:
    """Return the directory of generated modules: DAEBENCH_CACHE, or the platform's cache directory of this user."""
    chosen = os.environ.get("DAEBENCH_CACHE")
    if chosen:
        return Path(chosen)
    import platformdirs  # which takes longer to import than the rest of this module

    return platformdirs.user_cache_path("daebench")


@cache
def toolchain() -> str:
    """Return a text that identifies the code that generates source: a digest of our packages, and the versions of SymPy and Python."""
    return f"{digest_of_packages(*GENERATORS)} sympy {version('sympy')} python {sys.version_info[:2]}"


def generated(stem: str, key: str, build: Callable[[], str]) -> types.ModuleType:
    """Return the module made by ``build``, from this process, from the cache directory, or newly written there."""
    name = _name(stem, f"{key}\n{toolchain()}")
    if name in sys.modules:
        return sys.modules[name]
    path = cache_directory() / f"{name}.py"
    # A folder that others can write to is not even read: what is in it would be executed.
    source = "" if (refused := _refusal(path.parent)) else _read(path)
    if not source:
        source = f"{_with_names_used(build())}\n"
        refused = refused or _write(path, source)
    if refused:
        warn(refused)
    return _execute(name, source, name if refused else str(path))


@lru_cache(1000)
def _name(stem: str, text: str) -> str:
    """Return the name of a module, given the text that determines its content."""
    shown = re.split(r"[/\\]", stem)[-1][-LONGEST:]
    return NAME + "".join(c if c.isalnum() else "_" for c in shown) + f"_{hashlib.sha256(text.encode()).hexdigest()[:16]}"


def _with_names_used(source: str) -> str:
    """Return a source that imports from NumPy only the names in its text: among all others are modules that take long to import."""
    import numpy  # which `daebench list` does without

    used = sorted(set(re.findall(r"(?<![\w.])[A-Za-z_]\w*", source)) & set(numpy.__all__))
    return source.replace("from numpy import *", f"from numpy import {', '.join(used)}" if used else "", 1)


def _refusal(folder: Path) -> str:
    """Return why no files can be stored in a folder; "" if the folder belongs to this user and is protected from others."""
    try:
        why = sealed.refusal(folder, NAME)
    except OSError:
        return f"cannot write to the cache directory {folder}; {ELSEWHERE}."
    return f"the cache directory {folder} {why}, who could change the code that is run; {ELSEWHERE}." if why else ""


ELSEWHERE = "compiling in memory, set DAEBENCH_CACHE to a writable folder"


def _read(path: Path) -> str:
    """Return the source of a generated module; "" if there is none. A file that is damaged or belongs to another user is removed."""
    whole = sealed.owned_bytes(path)
    if whole is not None:
        content, _, last = whole.rpartition(END.encode())
        if last == sealed.digest(path.stem, content) + b"\n":
            return content.decode()
    sealed.remove(path)
    return ""


def _write(path: Path, source: str) -> str:
    """Write the source of a generated module; return the reason if that fails, "" otherwise."""
    content = source.encode()
    try:
        sealed.put(path, content + END.encode() + sealed.digest(path.stem, content) + b"\n")
    except OSError:
        return f"cannot write to the cache directory {path.parent}; {ELSEWHERE}."
    return ""


RECORDED = "\n# recorded, not executed:\n"
"""Line after which a module that lists names in ``NATIVE`` has the functions of which machine code is made."""


def _execute(name: str, source: str, file: str) -> types.ModuleType:
    """Return the module of a source. Its byte code is not stored, because nothing would check it."""
    module = types.ModuleType(name)
    vars(module).update(__file__=file, __digest__=hashlib.sha256(source.encode()).hexdigest())
    sys.modules[name] = module
    try:
        exec(compile(source.partition(RECORDED)[0], file, "exec"), module.__dict__)
        if "NATIVE" in vars(module):
            from daebench.compiler.native import Callback, Native  # which imports NumPy

            names, called, cached = vars(module)["NATIVE"], vars(module).get("CALLBACKS", {}), file != name
            vars(module).update({root: Native(module, source, root, cached=cached) for root in names})
            vars(module).update({root: Callback(module, source, root, letters, cached=cached) for root, letters in called.items()})
    # Ctrl-C must not leave half a module there either: the next call would find it and run it.
    except BaseException:
        del sys.modules[name]
        raise
    return module


@dataclass(frozen=True)
class Wrapper:
    """Functions that are written beside those of a generated module, and call them."""

    text: str
    """Their source."""
    roots: tuple[str, ...]
    """Names of the functions that are called from Python."""
    derived: Callable[[Any], str] | None = field(default=None, repr=False)
    """Returns the source of further functions, given the derivation of the problem, which alone determines it."""

    def source(self, derivation: Any) -> str:
        """Return their source."""
        return f"{self.text}\n\n{self.derived(derivation)}" if self.derived else self.text


def written(title: str, roots: Sequence[str], recorded: Sequence[str], executed: Sequence[str] = (), others: Sequence[str] = ()) -> str:
    """Return the text of a module."""
    body = "\n\n".join(recorded)
    names = re.findall(r"^def (\w+)\(", body, re.M)
    native = tuple(name for name in roots if name in names or name in others)
    called = {x: of for x, of in callbacks.SIGNATURES.items() if x in names}
    body = "\n\n".join([constants(callbacks), text_of(callbacks.noted), body]) if called else body
    head = [f'"""{title}"""\n\nimport numpy', *executed, f"NATIVE = {native}", f"CALLBACKS = {called}"]
    return "\n".join([*head, RECORDED, body, ""])
