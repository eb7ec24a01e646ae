"""The tutorials as notebooks to download: ``NAME.ipynb`` beside the page of each, and a link to it at the top of the page."""

import re
from pathlib import Path
from typing import Any

from daebench.pages.lesson.notebook import notebook

FOLDER = "tutorials"
FRONT = re.compile(r"\A---\n.*?\n---\n", re.DOTALL)
CELL = re.compile(r"^```\{code-cell\} python\n(?::.*\n)*\n?", re.MULTILINE)
LINK = re.compile(r"\[([^\]]+)\]\((?!https?:)[^)]+\)")
"""A link to a page of the site, which a notebook elsewhere does not reach."""


def of_tutorial(text: str) -> str:
    """Return a tutorial in MyST Markdown as a notebook of Jupyter."""
    return notebook(LINK.sub(r"*\1*", CELL.sub("```python\n", FRONT.sub("", text))))


def names(source: Path) -> list[str]:
    """Return the names of the tutorials in a folder of documentation."""
    return sorted(path.stem for path in (source / FOLDER).glob("*.md") if path.stem != "index")


def put_notebooks(app: Any, exception: Exception | None) -> None:
    """Write the notebooks beside the pages."""
    if exception or app.builder.format != "html":
        return
    for name in names(Path(app.srcdir)):
        text = (Path(app.srcdir) / FOLDER / f"{name}.md").read_text(encoding="utf-8")
        (Path(app.outdir) / FOLDER / f"{name}.ipynb").write_text(of_tutorial(text), encoding="utf-8")


def offer(app: Any, page: str, template: str, context: dict[str, Any], doctree: Any) -> None:
    """Put the link at the top of the page of a tutorial."""
    folder, _, name = page.rpartition("/")
    if folder == FOLDER and name in names(Path(app.srcdir)):
        context["body"] = f'<p class="download"><a href="{name}.ipynb" download>Download this page as a notebook</a></p>{context["body"]}'


def setup(app: Any) -> None:
    """Add both to a build."""
    app.connect("html-page-context", offer)
    app.connect("build-finished", put_notebooks)
