"""What a report recipe writes with: numbers in words, tables, figures in the page, and the page itself as one HTML file."""

import importlib
import math
import platform
import re
import time
from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime
from importlib import resources
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, TypeVar

from markupsafe import Markup, escape

from daebench.errors import unknown
from daebench.files import atomic
from daebench.machine import machine

if TYPE_CHECKING:
    import pandas as pd

Progress = Callable[[float, str], None]
"""Told the fraction of the report that is done, and what is being done."""

Numbers = TypeVar("Numbers")

PACKAGES = ("daebench", "numpy", "scipy", "sympy", "mpmath", "numba", "pandas", "matplotlib", "scikit-sundae")
PEERS = ("heyoka", "solve_dae")
"""Packages that methods come from where they are installed."""

PLAIN = (1e-3, 1e5)
"""Moduli that are written without a power of ten."""

THIN, MINUS, TIMES, NONE = "\N{NARROW NO-BREAK SPACE}", "\N{MINUS SIGN}", "\N{MULTIPLICATION SIGN}", "\N{EN DASH}"


def build(name: str, out: Path, progress: Progress | None = None) -> Path:
    """Write the report of this name into ``out/name`` and return the path of its page.

    Parameters
    ----------
    name : str
        Name as ``daebench list reports`` has it.
    out : Path
        Folder for all reports; made where it is missing.
    progress : callable, optional
        Told the fraction done and what is being done.

    Raises
    ------
    BadInput
        If there is no such report.
    DaebenchError
        If what the report is about to say is not what was measured; nothing is written over an older page then.
    """
    from daebench.catalogue import reports

    if name not in reports():
        raise unknown("report", name, reports())
    recipe = importlib.import_module(f"daebench.reports.{name.replace('-', '_')}")
    page: Path = recipe.make(Path(out) / name, progress or (lambda fraction, label: None))
    return page


def number(value: float, digits: int = 2) -> Markup:
    """Return a number with so many significant digits as HTML: 0.0123, 1.2 x 10^-5; an en dash if it is not finite."""
    value = float(value)
    if not math.isfinite(value):
        return Markup(NONE)
    mantissa, _, exponent = f"{value:.{digits - 1}e}".partition("e")
    if value == 0:
        return Markup("0")
    if PLAIN[0] <= abs(value) < PLAIN[1]:
        return Markup(f"{value:.{max(0, digits - 1 - int(exponent))}f}".replace("-", MINUS))
    return Markup(f"{mantissa}{THIN}{TIMES}{THIN}10<sup>{exponent_text(int(exponent))}</sup>".replace("-", MINUS))


def exponent_text(exponent: int) -> str:
    """Return an exponent with a proper minus sign."""
    return str(exponent).replace("-", MINUS)


def power_of_ten(value: float) -> Markup:
    """Return 10^k for the k nearest to a positive number on a logarithmic scale."""
    return Markup(f"10<sup>{exponent_text(round(math.log10(value)))}</sup>")


def with_error(value: float, error: float) -> Markup:
    """Return value +- error as HTML, both to the first digit of the error, or to its second where the first is 1 or 2.

    A value that is not finite gives an en dash, and an error that is not finite leaves the value alone.
    """
    if not math.isfinite(value) or not math.isfinite(error) or error <= 0:
        return number(value, 3)
    last = math.floor(math.log10(error)) - (error < 3 * 10 ** math.floor(math.log10(error)))
    plain = PLAIN[0] <= abs(value) < PLAIN[1]
    power = 0 if plain else math.floor(math.log10(max(abs(value), error)))
    places = max(0, power - last)
    both = "\N{NO-BREAK SPACE}±\N{NO-BREAK SPACE}".join(f"{each / 10.0**power:.{places}f}" for each in (value, error)).replace("-", MINUS)
    return Markup(both if plain else f"({both}){THIN}{TIMES}{THIN}10<sup>{exponent_text(power)}</sup>")


def count(value: float) -> Markup:
    """Return a whole number with its digits in threes; an en dash if it is not known."""
    return Markup(NONE) if value != value else Markup(f"{round(value):,}".replace(",", THIN))


def percent(value: float) -> Markup:
    """Return a share as a percentage with a digit after the point, or more where it is close to 0 or 100."""
    near = min(abs(value), abs(1 - value))
    places = 1 if near >= 1e-3 or near == 0 else min(6, 1 - math.floor(math.log10(near)) - 2)
    return Markup(f"{100 * value:.{places}f}{THIN}%")


def listing(items: Sequence[Any]) -> Markup:
    """Return "a, b and c"."""
    parts = [escape(item) for item in items]
    return Markup(", ").join(parts[:-1]) + Markup(" and ") + parts[-1] if len(parts) > 1 else Markup("").join(parts)


def table(
    name: str, frame: "pd.DataFrame", formats: Mapping[str, Callable[[Any], Any]], headings: Mapping[str, str], caption: str
) -> Markup:
    """Return a table as HTML: the first column heads the rows, numbers are set to the right (text that is HTML counts as such).

    Parameters
    ----------
    name : str
        Name of the table, unique in the page.
    frame : DataFrame
        The rows.
    formats : mapping of str to callable
        Columns that are shown, in order, each with what makes text of its value.
    headings : mapping of str to str
        HTML of a column's heading, where it is not the column's name.
    caption : str
        HTML above the table.
    """
    kinds = {key: "n" if frame[key].dtype.kind in "fiu" or isinstance(frame[key].iloc[0], Markup) else "t" for key in formats}
    head = "".join(f'<th scope="col" class="{kinds[key]}">{headings.get(key, escape(key))}</th>' for key in formats)
    rows = []
    for record in frame.to_dict("records"):
        cells = [f'<td class="{kinds[key]}">{escape(make(record[key]))}</td>' for key, make in formats.items()]
        cells[0] = cells[0].replace("<td", '<th scope="row"', 1).replace("</td>", "</th>")
        rows.append(f"<tr>{''.join(cells)}</tr>")
    body = f"<thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody>"
    above = f'<p class="caption" id="table-{name}">{caption}</p>'
    scroll = f'<div class="scroll" tabindex="0" role="region" aria-labelledby="table-{name}">'
    return Markup(f'<div class="tabular">{above}{scroll}<table aria-labelledby="table-{name}">{body}</table></div></div>')


def picture(svg: Path, alt: str, caption: str) -> Markup:
    """Return a figure as HTML: the drawing itself, what it shows in words for those who cannot see it, and links to its files."""
    files = ", ".join(f'<a href="{svg.parent.name}/{svg.stem}.{ending}">{ending.upper()}</a>' for ending in ("svg", "png", "csv"))
    drawing = inline_svg(svg.read_text(encoding="utf-8"), svg.stem, alt)
    files = f'<span class="files">{files}</span>'
    return Markup(f'<figure id="figure-{svg.stem}"><div class="drawing">{drawing}</div><figcaption>{caption} {files}</figcaption></figure>')


def inline_svg(text: str, prefix: str, alt: str) -> str:
    """Return a drawing to be put into a page: no prolog, no metadata, no fixed size, names that no other drawing has, and alt text."""
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r'(<svg[^>]*?) width="[^"]*"', r"\1", re.sub(r'(<svg[^>]*?) height="[^"]*"', r"\1", text, count=1), count=1)
    text = re.sub(r'\bid="([^"]+)"', rf'id="{prefix}-\1"', text)
    text = re.sub(r'href="#([^"]+)"', rf'href="#{prefix}-\1"', text).replace("url(#", f"url(#{prefix}-")
    return text.replace("<svg ", f'<svg role="img" aria-label="{escape(alt)}" ', 1)


def write_page(template: str, path: Path, command: str, **content: Any) -> Path:
    """Fill a template of ``daebench.reports``, or the text of one, and write one file that needs no other to be read; return its path.

    The templates know the functions of this module as filters, ``machine`` and ``versions`` as they were at this run.
    """
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    folder = Path(str(resources.files("daebench.reports")))
    environment = Environment(
        loader=FileSystemLoader(folder), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters |= {each.__name__: each for each in (number, power_of_ten, count, percent, listing)}
    environment.globals |= {"with_error": with_error}
    style = Markup((folder / "page.css").read_text(encoding="utf-8"))
    about = {"machine": machine(), "versions": versions(), "command": command, "day": datetime.now(UTC).date().isoformat()}
    filled = environment.from_string(template) if "{%" in template else environment.get_template(template)
    text = filled.render(style=style, **about, **content)
    with atomic(path) as scratch:
        scratch.write_text(text, encoding="utf-8")
    return path


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
    """Compute, check, draw and write a page; return its path.

    Parameters
    ----------
    template : str
        File of ``daebench.reports``.
    out : Path
        Folder of the report; made where it is missing.
    command : str
        What a reader calls to make it again.
    progress : callable
        Told the fraction done, and what is being done.
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
    """
    began = time.perf_counter()
    out.mkdir(parents=True, exist_ok=True)
    progress(0.0, "runs")
    numbers = measure(lambda fraction, doing: progress(MEASURED * fraction, doing))
    found = check(numbers)
    progress(MEASURED, "figures")
    rest = {"picture": picture} | dict(content(numbers, found))
    page = write_page(template, out / "index.html", command, **vars(found), **rest, took=time.perf_counter() - began)
    progress(1.0, "done")
    return page


def versions() -> dict[str, str]:
    """Return the versions of Python and of the packages that the numbers come from."""
    found = {"Python": platform.python_version()} | {name: version(name) for name in PACKAGES}
    return found | {name: version(name) for name in PEERS if find_spec(name)}
