"""A lesson as one static page: its text, its answers folded, and pictures drawn beforehand in the place of each experiment."""

import contextlib
import importlib
import io
import re
from pathlib import Path
from typing import Any

from markupsafe import Markup

from daebench.methods.catalogue import lessons
from daebench.pages.lesson import live_page
from daebench.pages.lesson.control import defaults
from daebench.pages.lesson.installed import require_lesson
from daebench.pages.lesson.live_page import PACKAGE, lives_in_a_page
from daebench.pages.lesson.static import SCRIPT, static_experiment
from daebench.pages.report import Progress, write_page
from daebench.pages.report.thumbnail import draw_thumbnail
from daebench.runs.csv_files import write_frame
from daebench.runs.files import atomic

PREPARED = 0.3
"""Part of the time that goes into running the lesson once, about."""

DRAWN = 0.9
"""Part of the time after which the picture in the index is drawn, about."""

HEADING = re.compile(r"<h1[^>]*>(.*?)</h1>", re.DOTALL)


def export(name: str, folder: Path, progress: Progress | None = None) -> Path:
    """Write a lesson into a folder as a page that needs nothing else to be read, and return its path.

    Its picture in an index of pages stands beside it, and, where pictures are drawn beforehand, for each experiment a table of what it
    measures with its default values.

    Parameters
    ----------
    name : str
        Name as ``daebench list lessons`` has it.
    folder : Path
        Folder of the page; made where it is missing.
    progress : callable, optional
        Called with the fraction done and a label of the current task.

    Raises
    ------
    BadInput
        If there is no such lesson, or marimo is not installed.
    ClaimRefuted
        If a sentence of the lesson does not hold in this run; nothing is written over an older page then.
    """
    require_lesson(name)
    tell = progress or (lambda fraction, doing: None)
    tell(0.0, "the lesson itself")
    page = (live if lives_in_a_page(name) else still)(name, folder, tell)
    tell(DRAWN, "its picture in the index")
    figures = folder / "figures"
    figures.mkdir(exist_ok=True)
    draw_thumbnail(figures, importlib.import_module(f"{PACKAGE}._{name.replace('-', '_')}").thumbnail)
    tell(1.0, "done")
    return page


def live(name: str, folder: Path, tell: Progress) -> Path:
    """Write a lesson whose page computes by itself, and return the path of the page."""
    notebook = importlib.import_module(f"{PACKAGE}.{name.replace('-', '_')}")
    folder.mkdir(parents=True, exist_ok=True)
    return live_page.write(name, notebook.app._config.app_title, folder)


def still(name: str, folder: Path, tell: Progress) -> Path:
    """Write a lesson whose pictures are drawn beforehand, and return the path of the page."""
    title, parts, experiments = content(name, lambda fraction, doing: tell((1 - fraction) * PREPARED + fraction * DRAWN, doing))
    folder.mkdir(parents=True, exist_ok=True)
    for experiment in experiments:
        with atomic(folder / f"{experiment.name}.csv") as scratch:
            write_frame(scratch, experiment.table(defaults(experiment.controls)))
    from daebench.pages.lesson.live import style_text

    command = f"daebench lesson {name} --export DIR"
    rest: dict[str, Any] = {"lesson_style": Markup(style_text()), "frame_script": Markup(SCRIPT), "live": f"daebench lesson {name}"}
    return write_page("lesson.html", folder / "index.html", command, title=title, under=lessons()[name], parts=parts, **rest)


def content(name: str, tell: Progress) -> tuple[Markup, list[Markup], list[Any]]:
    """Return the title of a lesson, its parts as HTML, and its experiments."""
    from daebench.pages.lesson.live import Picture
    from daebench.pages.lesson.mathml import static_html

    outputs = [result for result in run(name) if result is not None]
    pictures = [picture for picture in outputs if isinstance(picture, Picture)]
    title, parts = Markup(""), []
    for output in outputs:
        if isinstance(output, Picture):
            k = pictures.index(output)
            parts.append(static_experiment(output.experiment, lambda part, k=k: tell((k + part) / len(pictures), "frames")))  # type: ignore[misc]
        elif type(output).__module__ == "marimo._output.md":
            text = static_html(output.text)
            if heading := HEADING.search(text):
                title, text = Markup(heading[1]), HEADING.sub("", text, count=1)
            parts.append(Markup(text))
    return title, parts, [picture.experiment for picture in pictures]


def run(name: str) -> Any:
    """Return what the cells of a lesson put out, as in the notebook; what it prints as a script is not for the page."""
    module = importlib.import_module(f"{PACKAGE}.{name.replace('-', '_')}")
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        outputs, _ = module.app.run()
    return outputs
