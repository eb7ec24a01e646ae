"""Files beside a problem file: importable by their plain names while it runs but not afterwards, and known before it runs.

Two folders may contain files of the same name, and neither sees the other's. Modules imported from a folder are removed when its problem
file has run, and the previous meanings of the names are restored. Names of Python's own modules, and of the packages on which daebench
depends, keep their meaning.
"""

import ast
import importlib
import sys
import types
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib.abc import MetaPathFinder
from importlib.machinery import FileFinder, ModuleSpec, PathFinder, SourceFileLoader
from pathlib import Path

TAKEN = sys.stdlib_module_names | {
    "daebench",
    "dask",
    "distributed",
    "heyoka",
    "imageio_ffmpeg",
    "jinja2",
    "latex2mathml",
    "lazy_loader",
    "llvmlite",
    "markupsafe",
    "matplotlib",
    "mpl_toolkits",
    "mpmath",
}
TAKEN |= {"PIL", "isympy", "numba", "numpy", "pandas", "platformdirs", "pyarrow", "pylab", "rich", "scipy"}
TAKEN |= {"sksundae", "solve_dae", "sympy", "typer"}
"""Names that no file beside a problem file can have."""


class Fresh(SourceFileLoader):
    """Loads a file from its text only: Python's stored byte code may belong to a version that was edited within the same second."""

    def get_code(self, fullname: str) -> types.CodeType:
        """Return the code of the file as it is now."""
        path = self.get_filename(fullname)
        return compile(self.get_data(path), path, "exec", dont_inherit=True)


class Neighbours(MetaPathFinder):
    """Finds the modules of one folder, that of a problem file, and records which it found."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder.resolve()
        self.found: dict[str, Path] = {}

    def find_spec(self, name: str, path: Sequence[str] | None = None, target: types.ModuleType | None = None) -> ModuleSpec | None:
        """Return the place of a module of the folder, or of a package in it; None for any other."""
        top = name.partition(".")[0]
        if top in TAKEN or (path is not None and top not in self.found):
            return None
        places = [str(self.folder)] if path is None else list(path)
        specs = (FileFinder(place, (Fresh, [".py"])).find_spec(name) for place in places)
        spec = next((candidate for candidate in specs if candidate is not None), None)
        # A folder without __init__.py has no loader, and gives way to a package found elsewhere, as in Python itself.
        if spec is None or (spec.loader is None and PathFinder.find_spec(name, path) is not None):
            return None
        self.found[name] = Path(spec.origin) if spec.origin and spec.has_location else self.folder
        return spec


@contextmanager
def importable(folder: Path) -> Iterator[Neighbours]:
    """Make the files of a folder importable by their plain names, and remove them afterwards."""
    finder, names = Neighbours(folder), {name for name in _names(folder) if name not in TAKEN}
    # Modules of these names that are imported already are of another folder; they come back at the end.
    hidden = {name: sys.modules.pop(name) for name in list(sys.modules) if name.partition(".")[0] in names}
    # First, so that the folder is searched before what is installed: a file beside the problem file is meant.
    sys.meta_path.insert(0, finder)
    importlib.invalidate_caches()  # finders remember which files a folder had
    try:
        yield finder
    finally:
        sys.meta_path.remove(finder)
        for name in finder.found:
            sys.modules.pop(name, None)
        sys.modules.update(hidden)


def imported(path: Path) -> list[Path]:
    """Return the files that a problem file may import: those of its folder that it names, those that these name, and whole packages.

    They are in a fixed order, without the problem file itself.
    """
    folder, files, names = path.parent, dict[Path, None](), list(_imports(_syntax(path)))
    seen: set[str] = set()
    while names:
        name = names.pop(0)
        top = name.partition(".")[0]
        if top in TAKEN or top in seen:
            continue
        seen.add(top)
        for file in _files(folder, top):
            if file != path and file not in files:
                files[file] = None
                names += _imports(_syntax(file))
    return list(files)


def _files(folder: Path, top: str) -> list[Path]:
    """Return the file of a module, or all files of a package."""
    package, module = folder / top, folder / f"{top}.py"
    return sorted(package.rglob("*.py")) if package.is_dir() else [module] if module.is_file() else []


def _imports(tree: ast.Module) -> Iterator[str]:
    """Yield the names of all modules that a file imports, anywhere in it."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.module


def _syntax(path: Path) -> ast.Module:
    """Return the syntax of a file, empty if it is not Python; the error then comes when it is imported."""
    try:
        return ast.parse(path.read_bytes())
    except (OSError, SyntaxError, ValueError):
        return ast.Module([], [])


def _names(folder: Path) -> set[str]:
    """Return the names under which files or folders in a folder could be imported."""
    return {path.stem if path.suffix == ".py" else path.name for path in folder.iterdir() if path.suffix == ".py" or path.is_dir()}
