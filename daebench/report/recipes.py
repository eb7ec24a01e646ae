"""Recipes of pages: found by name among daebench's own, or by the path of a file."""

import ast
import importlib
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path

from daebench.catalogue import reports
from daebench.errors import BadInput, DaebenchError, unknown
from daebench.neighbours import importable, imported
from daebench.outside_code import executed, existing, is_path, naming
from daebench.package_files import folder
from daebench.problem_files import parsed, summary
from daebench.report.page import Progress

FOLDER = folder("daebench.reports")
COMMON = ("page.html", "page.css", "page.js")
"""Files of the folder that every page is made with."""


@dataclass(frozen=True)
class Recipe:
    """A recipe, read and not yet run.

    Parameters
    ----------
    name : str
        Name of the report and of its folder.
    summary : str
        First line of its docstring.
    command : str
        What a reader calls to make the page again.
    files : callable
        Returns the files that decide what it writes, besides those that every report stands on.
    make : callable
        ``make(out, progress)`` writes ``out/index.html`` and returns its path.
    kind : str
        What the page is: "report", "lesson" or "reference".
    seconds : float
        How long it takes, about, on two cores with nothing compiled.
    """

    name: str
    summary: str
    command: str
    files: Callable[[], Iterable[Path]] = field(repr=False)
    make: Callable[[Path, Progress], Path] = field(repr=False)
    kind: str = "report"
    seconds: float = 60.0


def find(name: str) -> Recipe:
    """Return the recipe of this name, or of the file at this path.

    Raises
    ------
    BadInput
        If there is none.
    """
    if is_path(name):
        return _outside(name)
    if name not in reports():
        raise unknown("report", name, reports())
    return own(name)


def own(name: str) -> Recipe:
    """Return a recipe of daebench's own."""
    stem = name.replace("-", "_")

    def make(out: Path, progress: Progress) -> Path:
        page: Path = importlib.import_module(f"daebench.reports.{stem}").make(out, progress)
        return page

    return Recipe(name, reports()[name], f"daebench report {name}", lambda: depends_on(stem), make, seconds=_seconds(FOLDER / f"{stem}.py"))


def _seconds(path: Path) -> float:
    """Return what a recipe says that it takes: its constant SECONDS, read without running it; a minute where it says nothing."""
    for node in parsed(path).body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "SECONDS":
            return float(ast.literal_eval(node.value))
    return Recipe.seconds


def depends_on(stem: str) -> list[Path]:
    """Return the files of ``daebench.reports`` that a recipe is made of, in the same order in every process: modules, then templates."""
    found: dict[Path, None] = {}
    waiting = [FOLDER / f"{stem}.py"]
    while waiting:
        path = waiting.pop()
        if path in found or not path.is_file():
            continue
        found[path] = None
        waiting += [FOLDER / f"{each}.py" for each in imports(path)]
    return [*sorted(found), *(path for path in (FOLDER / f"{stem}.html", *(FOLDER / each for each in COMMON)) if path.is_file())]


def imports(path: Path) -> set[str]:
    """Return the modules of ``daebench.reports`` that a file imports."""
    found: set[str] = set()
    for node in ast.walk(parsed(path)):
        if isinstance(node, ast.ImportFrom) and node.module == "daebench.reports":
            found |= {each.name for each in node.names}
        elif isinstance(node, ast.ImportFrom) and (node.module or "").startswith("daebench.reports."):
            found.add((node.module or "").removeprefix("daebench.reports."))
    return found


def _outside(name: str) -> Recipe:
    path = existing(name, "report", "daebench list reports")
    about = summary(parsed(path))
    title = path.stem.replace("_", "-")
    if title in reports():
        raise BadInput(f"{name}: a report of daebench's own is called {title}, and both would be written to one folder; rename the file.")

    def files() -> list[Path]:
        return [path.absolute(), *imported(path.absolute()), *(FOLDER / each for each in COMMON)]

    def make(out: Path, progress: Progress) -> Path:
        module = f"daebench_report_{path.stem}"
        sys.modules.pop(module, None)
        with importable(path.absolute().parent), naming(name, path, files, BadInput, passing=(DaebenchError,)):
            maker = getattr(executed(path.absolute(), module), "make", None)
            if not callable(maker):
                raise BadInput(f"{name} defines no function make(out, progress); a recipe needs one that writes out/index.html.")
            maker(out, progress)
        if not (out / "index.html").is_file():
            raise BadInput(f"{name}: make(out, progress) wrote no out/index.html; end it by daebench.report.make_page or write_page.")
        return out / "index.html"

    return Recipe(title, about, f"daebench report {name}", files, make)
