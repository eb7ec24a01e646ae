"""Reports before they are made: found by name among daebench's own, or by the path of a file."""

import importlib
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path

from daebench.errors import BadInput, DaebenchError, unknown
from daebench.methods.catalogue import reports
from daebench.pages.report.deferred import at_once
from daebench.pages.report.page import Progress
from daebench.systems.files.execute import executed, existing, is_path, naming, telling_exits
from daebench.systems.files.imports import importable, imported
from daebench.systems.files.read import parsed, summary


@dataclass(frozen=True)
class Report:
    """A page of the gallery, not yet made."""

    name: str
    """Its name, and that of its folder."""
    summary: str
    """First line of its docstring."""
    command: str
    """What a reader calls to make the page again."""
    make: Callable[[Path, Progress], Path] = field(repr=False)
    """``make(out, progress)`` writes ``out/index.html`` and returns its path."""
    files: Callable[[], Iterable[Path]] = field(default=tuple, repr=False)
    """Returns the files outside of the package that decide what it writes."""
    kind: str = "report"
    """What the page is: "report", "lesson" or "reference"."""


def find(name: str) -> Report:
    """Return the report of this name, or of the file at this path."""
    if is_path(name):
        return _outside(name)
    if name not in reports():
        raise unknown("report", name, reports())
    return own(name)


def own(name: str) -> Report:
    """Return one of daebench's own reports."""

    def make(out: Path, progress: Progress) -> Path:
        page: Path = importlib.import_module(f"daebench.reports.{name.replace('-', '_')}").make(out, progress)
        return page

    return Report(name, reports()[name], f"daebench report {name}", make)


def _outside(name: str) -> Report:
    path = existing(name, "report", "daebench list reports")
    about = summary(parsed(path))
    title = path.stem.replace("_", "-")
    if title in reports():
        raise BadInput(
            f"{name}: a report of daebench's own is called {title}, and both would be written to one folder; rename the file.",
            "report-name-taken",
        )

    def files() -> list[Path]:
        return [path.absolute(), *imported(path.absolute())]

    def make(out: Path, progress: Progress) -> Path:
        module = f"daebench_report_{path.stem}"
        sys.modules.pop(module, None)
        with at_once(), importable(path.absolute().parent), naming(name, path, files, BadInput, passing=(DaebenchError,)), telling_exits():
            maker = getattr(executed(path.absolute(), module), "make", None)
            if not callable(maker):
                raise BadInput(
                    f"{name} defines no function make(out, progress); a report needs one that writes out/index.html.", "report-without-make"
                )
            maker(out, progress)
        if not (out / "index.html").is_file():
            raise BadInput(
                f"{name}: make(out, progress) wrote no out/index.html; end it by daebench.pages.report.make_page or write_page.",
                "report-wrote-no-page",
            )
        return out / "index.html"

    return Report(title, about, f"daebench report {name}", make, files)
