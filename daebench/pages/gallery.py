"""The pages of daebench's own gallery: its reports and its lessons."""

from pathlib import Path

from daebench.errors import unknown
from daebench.methods.catalogue import lessons, reports
from daebench.pages.lesson.installed import missing
from daebench.pages.report.gallery import in_order
from daebench.pages.report.page import Progress
from daebench.pages.report.reports import Report, own

BY_HAND = frozenset({"engines"})
"""Reports that are made by hand, where what they need is installed: ``daebench report NAME`` puts each into the gallery, all does not."""


def pages() -> list[Report]:
    """Return all pages but those made by hand, in the order in which they are best read; lessons only where what they need is installed."""
    taught = [] if missing() else map(lesson_page, lessons())
    by_name = {page.name: page for page in (*map(own, sorted(set(reports()) - BY_HAND)), *taught)}
    return [by_name[name] for name in in_order(by_name)]


def lesson_page(name: str) -> Report:
    """Return the page of a lesson; refuse one that there is not."""
    if name not in lessons():
        raise unknown("lesson", name, lessons())

    def make(out: Path, progress: Progress) -> Path:
        from daebench.pages.lesson.page import export

        return export(name, out, progress)

    return Report(f"lesson-{name}", lessons()[name], f"daebench lesson {name}", make, kind="lesson")
