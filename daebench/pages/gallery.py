"""The pages of daebench's own gallery: its reports, its lessons and the reference of all that is public."""

from pathlib import Path
from typing import Any

from daebench.errors import unknown
from daebench.methods.catalogue import lessons, reports
from daebench.pages.lesson.installed import missing
from daebench.pages.report.gallery import in_order
from daebench.pages.report.page import Progress
from daebench.pages.report.reports import Report, own

REFERENCE = "reference"

BY_HAND = frozenset({"engines"})
"""Reports that are made by hand, where what they need is installed: ``daebench report NAME`` puts each into the gallery, all does not."""


def pages(command_line: Any) -> list[Report]:
    """Return all pages but those made by hand, in the order in which they are best read; lessons only where what they need is installed.

    Parameters
    ----------
    command_line : click.Group
        The commands that the page of reference describes.
    """
    notebooks = [] if missing() else map(lesson_page, lessons())
    by_name = {page.name: page for page in (*map(own, sorted(set(reports()) - BY_HAND)), *notebooks, _reference(command_line))}
    return [by_name[name] for name in in_order(by_name)]


def lesson_page(name: str) -> Report:
    """Return the static page of a lesson; refuse one that there is not."""
    if name not in lessons():
        raise unknown("lesson", name, lessons())

    def make(out: Path, progress: Progress) -> Path:
        from daebench.pages.lesson.page import export

        return export(name, out, progress)

    return Report(f"lesson-{name}", lessons()[name], f"daebench lesson {name}", make, kind="lesson")


def _reference(command_line: Any) -> Report:
    def make(out: Path, progress: Progress) -> Path:
        from daebench.pages.api.page import write

        progress(0.0, "docstrings")
        return write(out, command_line)

    about = "Everything public in Python, by task, and every command."
    return Report(REFERENCE, about, "daebench report all", make, kind="reference")
