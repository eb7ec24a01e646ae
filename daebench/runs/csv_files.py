"""Writing of all CSV files: numbers as numbers, and no text that a spreadsheet takes for a formula.

A spreadsheet evaluates a cell that begins with = + - @, a tab or an end of line when it opens a file, and a name or a message may come
from another person's problem file. An apostrophe before the text prevents this in every spreadsheet. A text that already looks so marked
gets one more, so that every text can be read back: :func:`read_text` removes one.
"""

import csv
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TextIO

import numpy as np
from numpy.typing import NDArray

from daebench.systems.lazily import pandas as pd

FORMULA = re.compile(r"'*[=+\-@\t\r\n\uff1d\uff0b\uff0d\uff20]")
"""Beginning of a text that a spreadsheet evaluates, with half- or full-width characters, or of a text that is already marked."""


def text_cell(value: Any) -> str:
    """Return a value as the text of a cell: numbers are unchanged, and text that begins like a formula is preceded by an apostrophe."""
    text = str(value)
    return f"'{text}" if FORMULA.match(text) and not _is_number(text) else text


def read_text(cell: str) -> str:
    """Return the text that was passed to :func:`text_cell`."""
    return cell[1:] if cell.startswith("'") and FORMULA.match(cell) else cell


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    # float() also takes spaces and digits of other scripts, which a spreadsheet does not read as a number.
    return text.isascii() and text == text.strip()


class _Lines:
    """A file for writers of CSV, which quote a cell only if it has a character of their end of line: here carriage return and line feed.

    Rows are written to the file with an end of line of one character.
    """

    END = "\r\n"

    def __init__(self, file: TextIO) -> None:
        self.file = file

    def write(self, row: str) -> int:
        """Write one row."""
        return self.file.write(row.removesuffix(self.END) + "\n")


def write_frame(path: Path, data: "pd.DataFrame | Mapping[str, Any]", float_format: str | None = None) -> None:
    """Write columns. Columns that are not numbers are texts. Without a format, numbers have all digits of the round trip."""
    frame = pd.DataFrame(data)
    texts = frame.select_dtypes(exclude=["number", "bool"]).columns
    # As objects, because a column of categories takes no text that is none of them.
    marked = frame.astype(dict.fromkeys(texts, object))
    marked[texts] = marked[texts].map(_cell, na_action="ignore")
    header = [text_cell(name) for name in frame]
    with path.open("w", newline="", encoding="utf-8") as file:
        lines: Any = _Lines(file)
        marked.to_csv(lines, index=False, header=header, float_format=float_format, lineterminator=_Lines.END)


def _cell(value: Any) -> Any:
    """Return a value unchanged, unless its text begins like a formula."""
    text = text_cell(value)
    return text if text != str(value) else value


def write_rows(path: Path, header: Iterable[str], rows: Iterable[Sequence[str]]) -> None:
    """Write rows of texts, some of which are numbers with any digits, under a header."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(_Lines(file), lineterminator=_Lines.END)
        writer.writerow(map(text_cell, header))
        writer.writerows(map(text_cell, row) for row in rows)


def write_numbers(path: Path, columns: Mapping[str, NDArray[np.float64] | NDArray[np.int64]]) -> None:
    """Write columns of numbers under their names, with enough decimal digits for the round trip."""
    header = ",".join(map(text_cell, columns))
    # 17 digits: the fewest with which every double is read back to the bit.
    np.savetxt(path, np.column_stack(list(columns.values())), fmt="%.17g", delimiter=",", header=header, comments="")
