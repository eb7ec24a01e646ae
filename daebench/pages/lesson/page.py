"""A lesson as one page, with a notebook beside it for those who want to change the code."""

import importlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jinja2
from markupsafe import Markup

from daebench.errors import BadInput
from daebench.methods.catalogue import lessons
from daebench.methods.fixed_step.script import Script
from daebench.pages.lesson.formula import formula
from daebench.pages.lesson.installed import require_installed
from daebench.pages.lesson.notebook import notebook
from daebench.pages.report import Progress, write_page
from daebench.pages.report.thumbnail import draw_thumbnail
from daebench.runs.csv_files import write_frame
from daebench.runs.files import atomic

if TYPE_CHECKING:
    import pandas as pd

PACKAGE = "daebench.reports.lessons"

DRAWN = 0.9
"""Part of the time after which the picture in the index is drawn, about."""


OWN = {"why-symplectic": "_own_potential"}
"""Lessons that can be on a problem of the reader's, and the files of those pages."""


@dataclass(frozen=True)
class Content:
    """The content that a lesson puts into its page."""

    title: str
    """Its title."""
    scripts: Mapping[str, Script] = field(default_factory=dict)
    """Kernels by the name that the page has for them; none where pictures were drawn beforehand."""
    functions: str = "{}"
    """Functions of the problem as a JavaScript object."""
    data: Mapping[str, Any] = field(default_factory=dict)
    """Numbers and names that the page's own script reads, as JSON takes them."""
    text: Mapping[str, Any] = field(default_factory=dict)
    """What the template of the page names."""
    tables: Mapping[str, "pd.DataFrame"] = field(default_factory=dict)
    """Numbers behind the pictures, by the names of their files."""
    style: str = ""
    """Style of its own, as CSS."""
    under: str = ""
    """Line below the title; by default the first line of the lesson's docstring."""
    notebook: Mapping[str, str] = field(default_factory=dict)
    """Words of the notebook, and what stands in their place."""


def posed(name: str, asked: Any) -> Any:
    """Return a problem of the reader's as the lesson needs it; refuse one on which it has nothing to show, and a lesson that takes none."""
    require_installed()
    if name not in OWN:
        raise BadInput(
            f"the lesson {name} takes no --problem; leave it out, or take the lesson {' or '.join(OWN)}.", "lesson-takes-no-problem"
        )
    return importlib.import_module(f"{PACKAGE}.{OWN[name]}").posed(asked)


def export(name: str, folder: Path, progress: Progress | None = None, problem: Any = None) -> Path:
    """Write a lesson into a folder as a page that needs nothing else to be read, and return its path.

    Its notebook, its picture in an index of pages, and tables of what was computed beforehand stand beside it. ``problem`` is that of
    :func:`posed`, where the lesson is on one of the reader's.
    """
    require_installed()
    tell = progress or (lambda fraction, doing: None)
    tell(0.0, "the lesson itself")
    given = () if problem is None else (problem,)
    file = OWN[name] if given else name.replace("-", "_")
    lesson = importlib.import_module(f"{PACKAGE}.{file}")
    content: Content = lesson.content(lambda fraction, doing: tell(DRAWN * fraction, doing), *((problem, folder) if given else ()))
    folder.mkdir(parents=True, exist_ok=True)
    for table, frame in content.tables.items():
        with atomic(folder / f"{table}.csv") as scratch:
            write_frame(scratch, frame)
    with atomic(folder / f"{name}.ipynb") as scratch:
        scratch.write_text(notebook(replaced(text_of(PACKAGE, f"{file}.md"), content.notebook)), encoding="utf-8")
    parts = {"lesson_style": style(content), "lesson_script": script_text(file, content), "body": body(file, content)}
    more = {"notebook": f"{name}.ipynb", "computes": bool(content.scripts)}
    command, under = f"daebench lesson {name}{problem.asked.words if given else ''} --export DIR", content.under or lessons()[name]
    page = write_page("lesson.html", folder / "index.html", command, title=content.title, under=under, **parts, **more)
    tell(DRAWN, "its picture in the index")
    figures = folder / "figures"
    figures.mkdir(exist_ok=True)
    draw_thumbnail(figures, lambda axis: lesson.thumbnail(axis, *given))
    tell(1.0, "done")
    return page


def replaced(text: str, words: Mapping[str, str]) -> str:
    """Return a text with other words in the place of some."""
    for word, other in words.items():
        text = text.replace(word, other)
    return text


def body(file: str, content: Content) -> Markup:
    """Return the screens of a page as HTML."""
    template = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined).from_string(text_of(PACKAGE, f"{file}.html"))
    return Markup(template.render(tex=tex, **content.text))


def tex(latex: str, display: bool = False) -> Markup:
    """Return a formula as MathML."""
    return Markup(formula(latex, display=display))


def style(content: Content) -> Markup:
    """Return the style that lessons share, and that of one."""
    return Markup("\n".join([text_of("daebench.pages.lesson", "runtime.css"), content.style]))


def script_text(file: str, content: Content) -> Markup:
    """Return the script of a page: kernels, numbers, what lessons share, and what this lesson draws."""
    script = text_of(PACKAGE, f"{file}.js")
    if not content.scripts:
        return Markup(script)
    kernels = ",".join(f"{json.dumps(key)}:{object_of(one)}" for key, one in content.scripts.items())
    # The end of an element in a text would end the script.
    data = json.dumps(content.data).replace("</", "<\\/")
    lines = [f"const DATA=Object.assign({data},{{methods:{{{kernels}}},functions:{content.functions}}});"]
    return Markup("\n".join([*lines, text_of("daebench.pages.lesson", "runtime.js"), script]))


def object_of(script: Script) -> str:
    """Return a kernel with its numbers as a JavaScript object."""
    numbers = {"state": script.state, "par": script.par, "weights": script.weights, "directions": script.directions}
    return f"{{kernel:{script.text},{json.dumps(numbers)[1:]}"


def text_of(package: str, file: str) -> str:
    """Return the text of a file of a package."""
    return (resources.files(package) / file).read_text(encoding="utf-8")
