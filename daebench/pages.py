"""The pages of daebench's own gallery: its reports and the reference of all that is public."""

from pathlib import Path

from daebench.catalogue import PACKAGE, reports
from daebench.report.gallery import FIRST
from daebench.report.page import Progress
from daebench.report.recipes import COMMON, FOLDER, Recipe, own

REFERENCE = "reference"


def pages() -> list[Recipe]:
    """Return the recipes of all pages, in the order in which they are best read."""
    names = sorted(reports(), key=lambda name: (FIRST.index(name) if name in FIRST else len(FIRST), name))
    return [*map(own, names), _reference()]


def _reference() -> Recipe:
    def files() -> list[Path]:
        apart = [*(PACKAGE / "cli").rglob("*.py"), *FOLDER.resolve().glob("*.py")]
        return [*sorted(apart), *(FOLDER / name for name in ("_api.html", *COMMON))]

    def make(out: Path, progress: Progress) -> Path:
        from daebench.api_reference.page import write

        progress(0.0, "docstrings")
        return write(out)

    about = "Everything public in Python, by task, and every command."
    return Recipe(REFERENCE, about, "daebench report all", files, make, kind="reference", seconds=5.0)
