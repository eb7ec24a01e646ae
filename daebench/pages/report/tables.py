"""Tables of a page: the first column heads the rows, and a reader can sort them by any column."""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from markupsafe import Markup, escape

from daebench.pages.report.sentences import number

if TYPE_CHECKING:
    import pandas as pd

Formats = dict[str, Callable[[Any], Any]]
"""What makes text of the values of each column, in order."""

Tabulate = Callable[[str], Markup]
"""Takes a caption to a table as HTML."""


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
    """
    kinds = {key: "n" if frame[key].dtype.kind in "fiu" or isinstance(frame[key].iloc[0], Markup) else "t" for key in formats}
    head = "".join(f'<th scope="col" class="{kinds[key]}">{headings.get(key, escape(key))}</th>' for key in formats)
    rows = []
    for record in frame.to_dict("records"):
        cells = [f'<td class="{kinds[key]}"{order(record[key])}>{escape(make(record[key]))}</td>' for key, make in formats.items()]
        cells[0] = cells[0].replace("<td", '<th scope="row"', 1).replace("</td>", "</th>")
        rows.append(f"<tr>{''.join(cells)}</tr>")
    body = f"<thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody>"
    above = f'<p class="caption" id="table-{name}">{caption}</p>'
    scroll = f'<div class="scroll" tabindex="0" role="region" aria-labelledby="table-{name}">'
    whole = f'<div class="tabular">{above}{scroll}<table aria-labelledby="table-{name}">{body}</table></div></div>'
    if len(frame) <= MOST_ROWS:
        return Markup(whole)
    return Markup(f'<details class="folded"><summary>{_first_words(caption)} ({len(frame)} rows)</summary>{whole}</details>')


MOST_ROWS = 12
"""Rows of a table that stands open; a longer one is folded."""


def _first_words(caption: str) -> str:
    """Return what a caption has in bold, or its first sentence, without a full stop."""
    bold = re.search(r"<b>(.*?)</b>", caption)
    words = bold[1] if bold else re.sub(r"<[^>]*>", "", caption).partition(". ")[0]
    return words.strip().rstrip(".,:") or "Table"


def order(value: Any) -> Markup:
    """Return the attribute by which a cell is put in order: the number itself, which its text has rounded, or that there is none."""
    if isinstance(value, bool) or not isinstance(value, float | int | np.floating | np.integer):
        return Markup("")
    return Markup(' data-order="{}"').format(repr(float(value)) if math.isfinite(value) else "none")


def text(value: Any) -> Any:
    """Return what is text already."""
    return value


def code(value: str) -> Markup:
    """Return a scheme's name as HTML."""
    return Markup("<code>{}</code>").format(value)


def tiny(value: float) -> Markup:
    """Return a residual or defect with two digits, with one where it is round-off."""
    return number(value, 2 if abs(value) > 1e-13 else 1)


def column(cells: Sequence[Markup], frame: "pd.DataFrame") -> "pd.Series[Any]":
    """Return HTML as a column of a frame; left to itself pandas would make plain text of it."""
    import pandas as pd

    return pd.Series(list(cells), index=frame.index, dtype=object)
