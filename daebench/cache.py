"""Generated modules: written once into the user's cache directory under the hash of what made them, then imported."""

import hashlib
import importlib.util
import os
import re
import sys
import tempfile
import types
import warnings
from collections.abc import Callable
from functools import cache
from importlib.metadata import version
from pathlib import Path

from daebench.errors import DaebenchError

GENERATORS: tuple[str, ...] = ("algebra", "cache", "circles", "codegen", "compiled", "compiled_elimination")
GENERATORS += (
    "definition_checks",
    "derive",
    "derive_local",
    "elimination",
    "equations",
    "fixed_step",
    "kinetic_flows",
    "lattice_algebra",
    "lattice_derivation",
    "lattice_sheet",
    "lattice_watch",
    "least_squares_solver",
    "link",
    "poisson_lattice",
    "poisson_derivation",
    "poisson_identities",
    "poisson_sheet",
    "poisson_step",
    "poisson_system",
    "poisson_watch",
    "pose",
)
GENERATORS += ("problem", "residuals", "scene", "sheet", "solvers", "source", "syntax", "unroll", "watch")
"""The modules that decide what generated source says; kernels and schemes do too."""


LONGEST = 80
"""Most characters of a module's name that are for people: numba's files beside it have its name and a kernel's, in 255 together."""

END = "# end of module"
"""Last line of a generated file; without it the file is not whole, and is written again."""


class CacheWarning(UserWarning):
    """The cache directory cannot be used, so everything is compiled again in this process."""


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
    package = Path(__file__).parent
    files = [package / f"{name}.py" for name in GENERATORS]
    digest = hashlib.sha256()
    folders = [sorted((package / folder).rglob("*.py")) for folder in ("kernels", "schemes", "chains")]
    for file in [*files, *(file for folder in folders for file in folder)]:
        digest.update(file.read_bytes())
    return f"{digest.hexdigest()} sympy {version('sympy')} python {sys.version_info[:2]}"


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
    hashed = hashlib.sha256(f"{key}\n{toolchain()}".encode()).hexdigest()[:16]
    shown = re.split(r"[/\\]", stem)[-1][-LONGEST:]
    name = "daebench_generated_" + "".join(c if c.isalnum() else "_" for c in shown) + f"_{hashed}"
    if name in sys.modules:
        return sys.modules[name]
    path = cache_directory() / f"{name}.py"
    try:
        if not path.exists():
            _write(path, build(True))
        return _load(name, path)
    except _Damaged:
        _write(path, build(True))
        return _load(name, path)
    except (OSError, RuntimeError) as error:
        if isinstance(error, RuntimeError) and "cannot cache function" not in str(error):
            raise
        _warn(f"cannot write to the cache directory {path.parent}; compiling in memory, set DAEBENCH_CACHE to a writable folder.")
        return _execute(name, compile(build(False), name, "exec"))


class _Damaged(Exception):
    """A file in the cache is not what was written there."""


def damaged(module: types.ModuleType) -> DaebenchError:
    """Return the error for machine code that numba cannot read back."""
    folder = Path(str(module.__file__)).parent
    return DaebenchError(f"the machine code of {module.__name__} in {folder} is damaged; delete that folder and run again.")


@cache
def _warn(message: str) -> None:
    """Say it once in a process, not once a kernel."""
    warnings.warn(message, CacheWarning, stacklevel=4)


def _write(path: Path, source: str) -> None:
    """Write the file so that no other process ever sees a part of it, and only where numba can write beside it too."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, scratch = tempfile.mkstemp(dir=path.parent, prefix=path.stem, suffix=".tmp")
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(f"{source}\n{END}\n")
        Path(scratch).replace(path)
    except BaseException:
        Path(scratch).unlink(missing_ok=True)
        raise


def _load(name: str, path: Path) -> types.ModuleType:
    if not path.read_bytes().endswith(f"\n{END}\n".encode()):
        raise _Damaged(path)
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise DaebenchError(f"cannot import the generated module {path}; delete it and run again.")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module


def _execute(name: str, code: types.CodeType) -> types.ModuleType:
    module = types.ModuleType(name)
    sys.modules[name] = module
    exec(code, module.__dict__)
    return module
