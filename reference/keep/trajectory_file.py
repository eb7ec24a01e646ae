"""A trajectory written by a user's program: a CSV file with a header, read with a message for every error in it."""

import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import compress
from pathlib import Path

import numpy as np

from daebench.errors import BadInput
from daebench.runs.ivp import Array
from daebench.runs.state import State

NAME = re.compile(r"([a-z]+)([1-9]\d*)")
"""A component: its part and its number, from 1."""


@dataclass(frozen=True, eq=False)
class TrajectoryFile:
    """Times and components of a file."""

    path: Path
    """The file."""
    text: Mapping[str, Sequence[str]]
    """Column t and the components, n numbers each, as written."""
    ignored: tuple[str, ...]
    """Other columns."""
    lines: Sequence[int]
    """Line of each row."""

    @property
    def components(self) -> list[str]:
        """Names of the columns other than t."""
        return [name for name in self.text if name != "t"]

    @cached_property
    def values(self) -> dict[str, Array]:
        """Columns in double precision, shape(n,) each."""
        return {name: self._numbers(name) for name in self.text}

    def half_unit(self, name: str) -> float:
        """Return half a unit of the last digit with which the largest number of a column is written.

        The column is assumed to have as many digits as its longest number: shorter numbers end with zeros.
        """
        largest = float(np.abs(self.values[name]).max())
        digits = max(map(_significant, self.text[name]))
        return 0.5 * 10.0 ** (np.floor(np.log10(largest)) - digits + 1) if largest else 0.0

    def _numbers(self, name: str) -> Array:
        column = self.text[name]
        numbers = np.array([_number(cell) for cell in column])
        wrong = np.flatnonzero(~np.isfinite(numbers))
        if wrong.size:
            k = int(wrong[0])
            raise BadInput(
                f"{self.path}, line {self.lines[k]}: {name} = {column[k]!r} is not a finite number; write one, for example 1.25e-3.",
                "csv-number-not-finite",
            )
        return numbers


def split(name: str) -> tuple[str, int]:
    """Return the part and the index of a component."""
    name_match = NAME.fullmatch(name)
    assert name_match is not None
    return name_match[1], int(name_match[2]) - 1


def read(path: Path, state: State) -> TrajectoryFile:
    """Return the trajectory of a file."""
    header, rows, lines = _rows(path, state)
    names = [name.strip() for name in header]
    known = [name == "t" or _is_component(name, state) for name in names]
    _require_header(path, names, known, state)
    for row, line in zip(rows, lines, strict=True):
        if len(row) != len(names):
            raise BadInput(
                f"{path}, line {line}: {len(row)} numbers for the {len(names)} columns of the header; give one for each.", "csv-row-length"
            )
    text = dict(zip(compress(names, known), compress(zip(*rows, strict=True), known), strict=True))
    trajectory = TrajectoryFile(path, text, tuple(name for name, flag in zip(names, known, strict=True) if not flag), lines)
    _require_times(trajectory)
    return trajectory


def _rows(path: Path, state: State) -> tuple[list[str], list[list[str]], list[int]]:
    """Return the header, the rows that are not blank, and their lines."""
    if not path.exists():
        raise BadInput(f"{path}: there is no such file; give the path of a CSV file.", "no-such-csv-file")
    if not path.is_file():
        raise BadInput(f"{path} is not a file; give the path of a CSV file.", "csv-not-a-file")
    rows, lines = [], []
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            reader = csv.reader(stream)
            for row in reader:
                if any(map(str.strip, row)):
                    rows.append(row)
                    lines.append(reader.line_num)
    except (UnicodeDecodeError, csv.Error) as error:
        raise BadInput(f"{path} is not a CSV file ({error}); {_header(state)}.", "csv-malformed") from error
    if not rows:
        raise BadInput(f"{path} is empty; {_header(state)}.", "csv-empty")
    if len(rows) == 1:
        raise BadInput(f"{path} has a header and no rows; write one row for each time.", "csv-without-rows")
    return rows[0], rows[1:], lines[1:]


def _is_component(name: str, state: State) -> bool:
    name_match = NAME.fullmatch(name)
    return name_match is not None and name_match[1] in state.stored


def _header(state: State) -> str:
    """Return a description of the first line."""
    first, *others = state.stored
    columns = ", ".join([f"{first}1, {first}2, ...", *(f"{part}1, ..." for part in others)])
    return f"the first line names the columns: t and any of {columns}, separated by commas"


def _require_header(path: Path, names: Sequence[str], known: Sequence[bool], state: State) -> None:
    if "t" not in names:
        raise BadInput(f"{path}, line 1: there is no column t among {_told(names)}; {_header(state)}.", "csv-without-time")
    if sum(known) == names.count("t"):
        raise BadInput(f"{path}, line 1: there is no component to compare among {_told(names)}; {_header(state)}.", "csv-without-component")
    twice = next((name for name in compress(names, known) if names.count(name) > 1), None)
    if twice is not None:
        raise BadInput(f"{path}, line 1: column {twice} occurs twice; name each column once.", "csv-column-twice")


def _told(names: Sequence[str]) -> str:
    """Return names as text of at most one line."""
    text = ", ".join(map(repr, names))
    return text if len(text) <= 80 else f"{text[:77]}..."


def _require_times(motion: TrajectoryFile) -> None:
    t = motion.values["t"]
    if t[0] < 0:
        raise BadInput(f"{motion.path}, line {motion.lines[0]}: t = {t[0]:g} is negative; references begin at t = 0.", "csv-time-negative")
    back = np.flatnonzero(np.diff(t) < 0)
    if back.size:
        k = int(back[0]) + 1
        raise BadInput(
            f"{motion.path}, line {motion.lines[k]}: t = {t[k]:.17g} comes after t = {t[k - 1]:.17g}; order the rows by time.",
            "csv-times-out-of-order",
        )


def _number(text: str) -> float:
    try:
        return float(text) if text.isascii() and "_" not in text else float("nan")
    except ValueError:
        return float("nan")


def _significant(text: str) -> int:
    """Return the number of significant digits of a written number."""
    return len(text.strip().lower().partition("e")[0].lstrip("+-0.").replace(".", ""))
