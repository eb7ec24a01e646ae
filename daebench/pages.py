"""The pages of daebench's own gallery: its reports, its lessons and the reference of all that is public."""

from pathlib import Path

from daebench.catalogue import lessons, reports
from daebench.errors import unknown
from daebench.lesson.installed import missing
from daebench.package_files import folder
from daebench.report.gallery import in_order
from daebench.report.page import Progress
from daebench.report.recipes import COMMON, FOLDER, Recipe, own

REFERENCE = "reference"


def pages() -> list[Recipe]:
    """Return the recipes of all pages, in the order in which they are best read; lessons only where what they need is installed."""
    by_name = {each.name: each for each in (*map(own, reports()), *([] if missing() else map(lesson_page, lessons())), _reference())}
    return [by_name[name] for name in in_order(by_name)]


def lesson_page(name: str) -> Recipe:
    """Return the recipe of a lesson's static page.

    Raises
    ------
    BadInput
        If there is no such lesson.
    """
    if name not in lessons():
        raise unknown("lesson", name, lessons())

    def files() -> list[Path]:
        stem = name.replace("-", "_")
        notebooks = folder("daebench.reports.lessons")
        own = [notebooks / f"{stem}.py", *sorted(notebooks.glob("_*.py")), notebooks / "lesson.css"]
        return [*own, *(FOLDER / each for each in ("lesson.html", *COMMON))]

    def make(out: Path, progress: Progress) -> Path:
        from daebench.lesson.page import export

        return export(name, out, progress)

    return Recipe(f"lesson-{name}", lessons()[name], f"daebench lesson {name}", files, make, kind="lesson", seconds=20.0)


def _reference() -> Recipe:
    def files() -> list[Path]:
        apart = [*folder("daebench.cli").rglob("*.py"), *FOLDER.glob("*.py")]
        return [*sorted(apart), *(FOLDER / name for name in ("_api.html", *COMMON))]

    def make(out: Path, progress: Progress) -> Path:
        from daebench.api_reference.page import write

        progress(0.0, "docstrings")
        return write(out)

    about = "Everything public in Python, by task, and every command."
    return Recipe(REFERENCE, about, "daebench report all", files, make, kind="reference", seconds=5.0)
