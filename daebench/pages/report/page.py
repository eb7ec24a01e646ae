"""The page itself: computed, checked, drawn and written as one HTML file."""

import re
from collections.abc import Callable, Iterable, Mapping
from datetime import UTC, datetime
from functools import cache
from importlib import resources
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import TYPE_CHECKING, Any, TypeVar

from markupsafe import Markup

from daebench.draw.figures import drawing
from daebench.pages.report.citation import AUTHORS, commit, licence, links, versions
from daebench.pages.report.deferred import clock, later
from daebench.pages.report.formulas import set_parentheses
from daebench.pages.report.pictures import picture
from daebench.pages.report.sentences import at_least, at_most, count, listing, number, percent, power_of_ten, with_error
from daebench.pages.report.tables import Table, write_tables
from daebench.runs.files import atomic
from daebench.runs.machine import machine
from daebench.runs.request import Told
from daebench.systems.lazily import jinja2

if TYPE_CHECKING:
    import pandas as pd

Progress = Told
"""Called with the fraction of the report that is done, and what is being done."""

Numbers = TypeVar("Numbers")

HERE = Path(__file__).parent


def write_page(template: str, path: Path, command: str, **content: Any) -> Path:
    """Fill a template and write it as one file that needs no other to be read; return its path.

    Parameters
    ----------
    template : str
        Template of a report, such as ``methods/page.html``, or its text: what has ``{%`` in it. It extends ``page.html`` and knows the
        functions of ``daebench.pages.report.sentences`` as filters, ``machine`` and ``versions`` as they were at this run.
    path : Path
        The page.
    command : str
        What a reader calls to make it again.
    **content
        What else the template names.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import mkdtemp
    >>> template = '{% extends "page.html" %}{% block title %}Mine{% endblock %}{% block content %}<p>{{ text }}</p>{% endblock %}'
    >>> page = write_page(template, Path(mkdtemp()) / "index.html", "python mine.py", text="Two and two is four.")
    >>> "<p>Two and two is four.</p>" in page.read_text(encoding="utf-8")
    True
    """
    environment = _templates()
    style, script = (Markup((HERE / f"page.{ending}").read_text(encoding="utf-8")) for ending in ("css", "js"))
    about = {"machine": machine(), "versions": versions(), "command": command, "day": datetime.now(UTC).date().isoformat()}
    about |= {"commit": commit(), "licence": licence(), "links": links(), "authors": AUTHORS}
    filled = environment.from_string(template) if "{%" in template else environment.get_template(template)
    text = set_parentheses(filled.render(style=style, script=script, **about, **content))
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic(path) as scratch:
        scratch.write_text(text, encoding="utf-8")
    return path


@cache
def _templates() -> Any:
    """Return the templates of all pages, each compiled once."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader([HERE, str(resources.files("daebench.reports"))]),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {function.__name__: function for function in (number, at_most, at_least, power_of_ten, count, percent, listing)}
    environment.globals |= {"with_error": with_error, "headings": headings}
    return environment


def headings(body: str) -> list[tuple[str, Markup]]:
    """Return the names and the texts of a page's sections: those of its headings of second order that have a name."""
    return [(name, Markup(text)) for name, text in re.findall(r'<h2[^>]* id="([^"]+)"[^>]*>(.*?)</h2>', body, re.DOTALL)]


def constants(*modules: ModuleType) -> SimpleNamespace:
    """Return the constants of modules, names in capitals, for a template to print."""
    return SimpleNamespace(**{name: value for module in modules for name, value in vars(module).items() if name.isupper()})


MEASURED = 0.92
"""Part of a report's time that goes into its numbers, about."""


def make_page(
    template: str,
    out: Path,
    command: str,
    progress: Progress,
    *,
    measure: Callable[[Progress], Numbers],
    check: Callable[[Numbers], SimpleNamespace],
    content: Callable[[Numbers, SimpleNamespace], Mapping[str, Any]],
) -> Path:
    """Compute and check a page, and draw and write it: at once, or later where a gallery is made; return its path.

    Parameters
    ----------
    template : str
        Template of a report, such as ``methods/page.html``.
    out : Path
        Folder of the report; made where it is missing.
    command : str
        What a reader calls to make it again.
    progress : callable
        Called with the fraction done and a label of the current task.
    measure : callable
        Returns the numbers; it is given what to tell of its own progress.
    check : callable
        Returns what the page says of them, or raises ClaimRefuted.
    content : callable
        Draws and writes figures and tables, and returns what else the template names.

    Raises
    ------
    ClaimRefuted
        If a sentence of the page does not hold in this run; nothing is written over an older page then.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import mkdtemp
    >>> from types import SimpleNamespace
    >>> template = '{% extends "page.html" %}{% block title %}Mine{% endblock %}{% block content %}<p>{{ total }}</p>{% endblock %}'
    >>> page = make_page(
    ...     template,
    ...     Path(mkdtemp()),
    ...     "python mine.py",
    ...     lambda fraction, label: None,
    ...     measure=lambda progress: [2, 2],
    ...     check=lambda numbers: SimpleNamespace(total=sum(numbers)),
    ...     content=lambda numbers, findings: {},
    ... )
    >>> "<p>4</p>" in page.read_text(encoding="utf-8")
    True
    """
    began = clock()
    out.mkdir(parents=True, exist_ok=True)
    progress(0.0, "runs")
    numbers = measure(lambda fraction, doing: progress(MEASURED * fraction, doing))
    findings = check(numbers)
    progress(MEASURED, "figures")
    measured, page = clock() - began, out / "index.html"

    def write() -> None:
        again = clock()
        rest = {"picture": picture} | dict(content(numbers, findings))
        write_page(template, page, command, **vars(findings), **rest, took=measured + clock() - again)

    later(write)
    progress(1.0, "done")
    return page


def make_report(
    name: str,
    out: Path,
    progress: Progress,
    measure: Callable[[Progress], Numbers],
    check: Callable[[Numbers], SimpleNamespace],
    draw: Callable[[Numbers, SimpleNamespace, Path], Iterable[Path]],
    tables: "Callable[[Numbers, SimpleNamespace], Mapping[str, Table | pd.DataFrame]]",
    beside: Callable[[Numbers, SimpleNamespace], Mapping[str, Mapping[str, Any]]] = lambda *_: {},
    **content: Any,
) -> Path:
    """Make one of daebench's own reports, see :func:`make_page`.

    Its template is ``page.html`` in the folder of the report. It knows the numbers as ``numbers``, the findings by their names, the paths
    of the figures by their stems as ``drawn``, and functions from a caption to each table as ``tables``. ``beside`` returns what further
    pages know besides, by their names; their template is ``beside.html``.
    """
    folder, command = name.replace("-", "_"), f"daebench report {name}"

    def shown(numbers: Numbers, findings: SimpleNamespace) -> Mapping[str, Any]:
        with drawing():
            drawn = {path.stem: path for path in draw(numbers, findings, out / "figures")}
        common = {"numbers": numbers, "drawn": drawn, "tables": write_tables(out / "tables", tables(numbers, findings))} | content
        for page, more in beside(numbers, findings).items():
            write_page(f"{folder}/beside.html", out / f"{page}.html", command, picture=picture, **vars(findings), **common, **more)
        return common

    return make_page(f"{folder}/page.html", out, command, progress, measure=measure, check=check, content=shown)
