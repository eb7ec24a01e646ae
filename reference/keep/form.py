"""The form of a reference: its name, its folder, and what each field of its certificate and each column of its digits must be."""

import os
import re
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

from daebench.errors import BadInput
from daebench.runs.schema import (
    DIGEST,
    LARGEST,
    NOT_NEGATIVE,
    POSITIVE,
    Either,
    Fields,
    Items,
    Kind,
    Named,
    Number,
    Text,
    Whole,
    WrongField,
    maybe,
    numbers,
    shown,
)
from daebench.runs.state import FREE, STATES, State
from daebench.systems.lazily import platformdirs

DATA = Path(__file__).parent.parent / "data"
"""Folder of the references that come with the package."""

NAME = re.compile(r"\w[\w.,+-]{0,150}", re.ASCII)
"""Pattern of names. A name becomes that of a folder and of a file, so it must not look like a path, a drive or an option."""


def own_folder() -> Path:
    """Return the folder of the user's own references: DAEBENCH_REFERENCES, or one in the platform's data folder of this user."""
    chosen = os.environ.get("DAEBENCH_REFERENCES")
    if chosen:
        return Path(chosen)
    return platformdirs.user_data_path("daebench") / "references"


def folders(folder: Path | None = None) -> tuple[Path, ...]:
    """Return the folders in which references are searched, in this order."""
    if folder is None:
        return (DATA, user_folder) if (user_folder := own_folder()).is_dir() else (DATA,)
    if not folder.is_dir():
        raise BadInput(f"{folder}: there is no such folder of references.", "no-reference-folder")
    return (folder,)


def require_name(name: str) -> None:
    """Check that a reference may have a name."""
    if not NAME.fullmatch(name) or name.endswith("."):
        shown = ascii(name if len(name) <= 80 else f"{name[:77]}...")
        raise BadInput(
            f"{shown} is not a name of a reference, which is PROBLEM-CASE, of letters, digits and . , + - _ only, no path.",
            "reference-name-malformed",
        )


NUMBER = re.compile(r"-?\d{1,40}(\.\d{0,80})?(e[-+]?\d{1,4})?", re.ASCII)
"""A stored number."""

MOST_ROWS = 10**6
"""Largest number of rows."""

DECIMAL = Text(form=NUMBER.pattern, told="a decimal number in a text")
SENTENCE = Text(10_000)
FORMULA = Text(10**6)
FORMULAS = Either((FORMULA, Items(FORMULA, most=10_000), Named(FORMULA)), "a text, or a list or a mapping of texts")
TIME = maybe(NOT_NEGATIVE, "a time of at least 0")


def require_form(certificate: Mapping[str, Any], text: Mapping[str, Sequence[str]]) -> None:
    """Accept a reference that has the form of one: all else that is wrong with it is for a verification to find."""
    state, sizes = _sizes(list(text))
    rows = _require_numbers(text)
    _certificate(state, sizes, rows, list(text)).read(certificate)


def _sizes(columns: Sequence[str]) -> tuple[State, dict[str, int]]:
    """Return the parts that columns have, and their numbers of components."""
    for state in (FREE, *STATES.values()):
        sizes = {part: sum(re.fullmatch(rf"{part}[0-9]+", name) is not None for name in columns) for part in state.stored}
        expected = ["t", *(f"{part}{i + 1}" for part, size in sizes.items() for i in range(size))]
        if all(sizes[part] for part in state.columns) and len({sizes[part] for part in state.columns}) == 1 and list(columns) == expected:
            return state, sizes
    raise WrongField(f"columns are {shown(', '.join(columns))}, and must be t, and q, p and any lam, or y, each with its number")


def _require_numbers(text: Mapping[str, Sequence[str]]) -> int:
    """Refuse columns that are not of decimal numbers, and times that do not ascend from 0 or later; return the number of rows."""
    rows = len(text["t"])
    if not 2 <= rows <= MOST_ROWS:
        raise WrongField(f"there are {rows} rows, and must be 2 to {MOST_ROWS}")
    for name, column in text.items():
        for k, cell in enumerate(column):
            if not NUMBER.fullmatch(cell) or not abs(float(cell)) <= LARGEST:
                raise WrongField(f"{name} in row {k + 1} is {shown(cell)}, and must be a decimal number")
    t = [float(cell) for cell in text["t"]]
    if t[0] < 0 or any(a >= b for a, b in pairwise(t)):
        raise WrongField("times must be at least 0, and ascend")
    return rows


def _certificate(state: State, sizes: Mapping[str, int], rows: int, columns: list[str]) -> Fields:
    """Return the kind of the certificate of such columns."""
    errors = Fields(dict.fromkeys(state.stored, NOT_NEGATIVE), open=True)
    check = Fields({"against": SENTENCE, "largest_difference": errors}, open=True)
    growth = numbers(rows, of=POSITIVE)
    ida: dict[str, Kind] = {"method": Text(), "tol": POSITIVE, "t_end": POSITIVE, "t_reached": NOT_NEGATIVE, "error": errors}
    ida |= {"estimate": maybe(errors, "an error of each part"), "lost": TIME, "steps": Whole(), "residuals": Whole(), "status": SENTENCE}
    rank: dict[str, Kind] = {"smallest_singular_value": POSITIVE, "t": NOT_NEGATIVE, "largest": POSITIVE}
    losses: dict[str, Kind] = {"rule": SENTENCE, "lost": Items(NOT_NEGATIVE), "values": growth}
    required: dict[str, Kind] = {
        "format": Whole(),
        "name": Text(400),
        "problem": Text(form=NAME.pattern, told="the name of a problem, and no path"),
        "case": Text(200, 1),
        "about": SENTENCE,
        "definition": _Definition(),
        "made": Fields({"by": SENTENCE, "method": SENTENCE, "checks": Items(check)}, open=True),
        "horizon": Fields({"truth": POSITIVE, "double": TIME, "asked": POSITIVE, "rule": SENTENCE}, open=True),
        "drift": Named(NOT_NEGATIVE),
        "ida": Items(Fields(ida, open=True)),
        "amplification": Fields({"rule": SENTENCE, "largest": POSITIVE, "values": growth, "worst": growth, "step": growth}, open=True),
        "bound": Fields({"rule": SENTENCE, **{part: numbers(rows, size, POSITIVE) for part, size in sizes.items()}}),
        "versions": Named(Text()),
        "data": Fields({"file": Text(400), "sha256": DIGEST, "columns": _Same(columns), "rows": Whole(rows, rows)}, open=True),
        "checksum": DIGEST,
    }
    return Fields(required, {"rank": _Rank(Fields(rank, losses))})


class _Definition:
    """The definition: formulas as texts, decimal numbers of parameters, and whole ones."""

    known = Fields({"parameters": Named(DECIMAL), "structure": Named(Whole(1, 10**6)), "sha256": DIGEST}, open=True)

    def read(self, value: Any, place: str) -> Any:
        """Return the definition."""
        fields = self.known.read(value, place)
        for name, formula in fields.items():
            if name not in self.known.required:
                FORMULAS.read(formula, f"{place}.{name[:40]}")
        for name, digits in fields["parameters"].items():
            Number().read(float(digits), f"{place}.parameters.{name}")
        return fields


class _Rank:
    """Facts on the rank of a matrix; where it is lost, a singular value at each time too."""

    def __init__(self, fields: Fields) -> None:
        self.fields = fields

    def read(self, value: Any, place: str) -> Any:
        """Return the facts."""
        fields = self.fields.read(value, place)
        if fields.get("lost") and "values" not in fields:
            raise WrongField(f"{place} has no values")
        return fields


class _Same:
    """A list that is another."""

    def __init__(self, other: list[str]) -> None:
        self.other = other

    def read(self, value: Any, place: str) -> Any:
        """Return the list."""
        if value != self.other:
            raise WrongField(f"{place} is {shown(value)}, and must be those of the file")
        return value
