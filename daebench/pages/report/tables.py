"""Tables of a page, declared as columns over a frame: the first column heads the rows, and a reader can sort them by any column."""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup, escape

from daebench.draw.figures import save_table
from daebench.pages.report.sentences import NONE, number
from daebench.systems.lazily import pandas as pd

Formats = dict[str, Callable[[Any], Any]]
"""What makes text of the values of each column, in order."""

Tabulate = Callable[[str], Markup]
"""Takes a caption to a table as HTML."""

Columns = dict[str, Any]
"""Columns that are shown, in order: of each its format, its heading as HTML, or both as a pair. Text needs no format."""


class Of:
    """Format of a cell that is made of several columns: of the values of these, or of the whole row where none is named."""

    def __init__(self, make: Callable[..., Any], *names: str) -> None:
        self.make, self.names = make, names

    def __call__(self, row: Mapping[Any, Any]) -> Any:
        """Return the cell of a row."""
        return self.make(*(row[name] for name in self.names)) if self.names else self.make(row)


@dataclass(frozen=True)
class Table:
    """A table of a page."""

    frame: "pd.DataFrame"
    """The rows."""
    columns: Columns
    """See :data:`Columns`."""
    data: "pd.DataFrame | Mapping[str, Any] | None" = None
    """Columns of the CSV file, by default the rows; without any, there is no file."""


def write_tables(folder: Path, tables: "Mapping[str, Table | pd.DataFrame]") -> dict[str, Tabulate]:
    """Write frames as CSV, all columns and rows; return functions from a caption to HTML of the tables that have rows."""
    shown = {name: entry for name, entry in tables.items() if isinstance(entry, Table)}
    for name, entry in tables.items():
        data = entry if not isinstance(entry, Table) else entry.frame if entry.data is None else entry.data
        if len(data.keys()):
            save_table(folder / f"{name}.csv", data)
    return {name: partial(_html, name, entry.frame, entry.columns) for name, entry in shown.items() if len(entry.frame)}


def table(
    name: str, frame: "pd.DataFrame", formats: Mapping[str, Callable[[Any], Any]], headings: Mapping[str, str], caption: str
) -> Markup:
    """Return a table as HTML: the first column heads the rows, numbers are set to the right (text that is HTML counts as such).

    A table of more than :data:`MOST_ROWS` rows is folded: a reader opens it.

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

    Examples
    --------
    >>> import pandas as pd
    >>> frame = pd.DataFrame({"method": ["rattle"], "order": [2]})
    >>> html = table("orders", frame, {"method": str, "order": str}, {}, "Orders of methods.")
    >>> html.count("<tr"), "Orders of methods." in html
    (2, True)
    """
    return _html(name, frame, {key: (make, headings.get(key, escape(key))) for key, make in formats.items()}, caption)


def _html(name: str, frame: "pd.DataFrame", columns: Columns, caption: str) -> Markup:
    """Return a declared table as HTML."""
    shown = [_column(key, declared, frame) for key, declared in columns.items()]
    head = "".join(f'<th scope="col" class="{kind}">{heading}</th>' for kind, heading, _ in shown)
    rows = []
    for texts in zip(*(texts for _, _, texts in shown), strict=True):
        cells = [f'<td class="{kind}"{text}</td>' for (kind, _, _), text in zip(shown, texts, strict=True)]
        cells[0] = cells[0].replace("<td", '<th scope="row"', 1).replace("</td>", "</th>")
        rows.append(f"<tr>{''.join(cells)}</tr>")
    body = f"<thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody>"
    above = f'<p class="caption" id="table-{name}">{caption}</p>'
    scroll = f'<div class="scroll" tabindex="0" role="region" aria-labelledby="table-{name}">'
    whole = f'<div class="tabular">{above}{scroll}<table aria-labelledby="table-{name}">{body}</table></div></div>'
    if len(frame) <= MOST_ROWS:
        return Markup(whole)
    return Markup(f'<details class="folded"><summary>{_first_words(caption)} ({len(frame)} rows)</summary>{whole}</details>')


def _column(key: str, declared: Any, frame: "pd.DataFrame") -> tuple[str, str, list[str]]:
    """Return the alignment of a column, its heading, and its cells: the attribute by which each is put in order, and its text."""
    make, heading = declared if isinstance(declared, tuple) else (text, declared) if isinstance(declared, str) else (declared, escape(key))
    if isinstance(make, Of):
        values = [make(row) for row in frame.to_dict("records")]
        return "n" if isinstance(values[0], Markup) else "t", heading, [f">{escape(value)}" for value in values]
    values = frame[key].tolist()
    numeric = frame[key].dtype.kind in "fiu" or isinstance(values[0], Markup)
    return "n" if numeric else "t", heading, [f"{order(value)}>{escape(make(value))}" for value in values]


MOST_ROWS = 12
"""Rows of a table that stands open; a longer one is folded."""


def _first_words(caption: str) -> str:
    """Return the bold part of a caption, or its first sentence, without a full stop."""
    bold = re.search(r"<b>(.*?)</b>", caption)
    words = bold[1] if bold else re.sub(r"<[^>]*>", "", caption).partition(". ")[0]
    return words.strip().rstrip(".,:") or "Table"


def order(value: Any) -> Markup:
    """Return the attribute by which a cell is put in order: the number itself, which its text has rounded, or that there is none."""
    if isinstance(value, bool) or not isinstance(value, float | int | np.floating | np.integer):
        return Markup("")
    return Markup(' data-order="{}"').format(repr(float(value)) if math.isfinite(value) else "none")


def text(value: Any) -> Any:
    """Return text as it is."""
    return value


def code(value: str) -> Markup:
    """Return a scheme's name as HTML."""
    return Markup("<code>{}</code>").format(value)


def tiny(value: float) -> Markup:
    """Return a residual or defect with two digits, with one where it is round-off."""
    return number(value, 2 if abs(value) > 1e-13 else 1)


def column(cells: Sequence[Markup], frame: "pd.DataFrame") -> "pd.Series[Any]":
    """Return HTML as a column of a frame; left to itself pandas would make plain text of it."""
    return pd.Series(list(cells), index=frame.index, dtype=object)


def part(frame: "pd.DataFrame", **values: Any) -> "pd.DataFrame":
    """Return the rows of a frame whose columns have these values; a tuple of values stands for any of them."""
    chosen = np.ones(len(frame), dtype=bool)
    for name, value in values.items():
        chosen &= (frame[name].isin(value) if isinstance(value, tuple) else frame[name] == value).to_numpy()
    return frame[chosen]


def once(names: "pd.Series[Any]") -> "pd.Series[Any]":
    """Return a column of names as it is read down the rows: a name that is that of the row above is left out."""
    return names.where(names != names.shift(), "")


def finite(make: Callable[[Any], Markup]) -> Callable[[Any], Markup]:
    """Return a format that gives an en dash where a number is not finite."""
    return lambda value: make(value) if np.isfinite(value) else Markup(NONE)


def long(value: str) -> Markup:
    """Return a sentence that may wrap over several lines."""
    return Markup('<span class="long">{}</span>').format(value)
