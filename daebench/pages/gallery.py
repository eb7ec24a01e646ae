"""The pages of daebench's own gallery: its reports and its lessons."""

import importlib
import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from daebench.errors import unknown
from daebench.methods.catalogue import find_problem, lessons, reports
from daebench.pages.lesson.installed import missing
from daebench.pages.report.gallery import in_order
from daebench.pages.report.page import Progress
from daebench.pages.report.reports import Report, own

BY_HAND = frozenset({"engines"})
"""Reports that are made by hand, where what they need is installed: ``daebench report NAME`` puts each into the gallery, all does not."""


@dataclass(frozen=True)
class Asked:
    """A problem of the reader's for a lesson."""

    problem: str
    """Its name, or the path of its file."""
    case: str | None = None
    h: float | None = None
    """Case and step size at first; by default the first case, and a step of DOP853 at 1e-13."""

    @property
    def words(self) -> str:
        """The options of a command that name it."""
        given = {"--problem": self.problem, "--case": self.case, "--h": self.h}
        return "".join(f" {option} {shlex.quote(str(value))}" for option, value in given.items() if value is not None)


def pages() -> list[Report]:
    """Return all pages but those made by hand, in the order in which they are best read; lessons only where what they need is installed."""
    taught = [] if missing() else map(lesson_page, lessons())
    by_name = {page.name: page for page in (*map(own, sorted(set(reports()) - BY_HAND)), *taught)}
    return [by_name[name] for name in in_order(by_name)]


def lesson_page(name: str, asked: Asked | None = None) -> Report:
    """Return the page of a lesson, or of one on a problem of the reader's; what is refused is refused here, before anything is written."""
    if name not in lessons():
        raise unknown("lesson", name, lessons())
    problem = None if asked is None else _pages().posed(name, asked)

    def make(out: Path, progress: Progress) -> Path:
        page: Path = _pages().export(name, out, progress, problem)
        return page

    command = f"daebench lesson {name}"
    if asked is None:
        return Report(f"lesson-{name}", lessons()[name], command, make, kind="lesson")
    file = find_problem(asked.problem).path.absolute()
    title, about = f"lesson-{name}-{file.stem.replace('_', '-')}", f"{lessons()[name]} On {file.stem}."
    return Report(title, about, command + asked.words, make, lambda: [file], kind="lesson")


def _pages() -> Any:
    """Return the module that writes lessons, with packages that their list does without."""
    return importlib.import_module("daebench.pages.lesson.page")
