"""Results of studies: a result is its JSON, what a command prints, its picture with a table beside it, and what a notebook displays."""

import base64
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import wraps
from importlib import import_module
from inspect import signature
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, ParamSpec

from markupsafe import escape

from daebench.errors import DaebenchError

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

MOST_ITEMS = 6
"""Largest number of numbers or entries in one row of the table; a longer row is only in :meth:`Result.summary`."""

DPI = 90
"""Dots per inch of the picture in a notebook."""

STYLE = "display:flex;flex-wrap:wrap;gap:1.5em;align-items:flex-start"

Given = ParamSpec("Given")


@dataclass(frozen=True)
class Table:
    """A table that a command prints: names of columns, rows of texts, a title, and the width in characters, 0 where it is free."""

    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    title: str = ""
    width: int = 0

    @classmethod
    def of(cls, frame: "pd.DataFrame", title: str) -> "Table":
        """Return a frame as a table, floats with three digits, and nothing where a value is missing."""

        def cell(value: Any) -> str:
            return "" if value != value or value is None else f"{value:.3g}" if isinstance(value, float) else str(value)

        return cls(list(frame.columns), [[cell(value) for value in row] for row in frame.itertuples(index=False)], title)


@dataclass(frozen=True)
class Look:
    """Layout of a picture that is written to a file alone."""

    size: tuple[float, float] | None = None
    """Width and height, inches; by default the width of a page, and what the panels need."""
    title: str = ""
    """Title; by default problem and case."""
    labels: Sequence[str] = ()
    colors: Sequence[str] = ()
    """Names and colours of the methods in their order; where there are none, those that they have in every picture."""
    panels: Sequence[str] = ()
    """Columns of the panels in their order; all by default."""


class Result:
    """A result with a summary, a table and a picture."""

    drawn_by: ClassVar[str] = ""
    """Module whose function ``figure`` draws the result. It lies in a higher layer, and is imported by name on request."""

    stem: ClassVar[str] = ""
    """Name, without extension, of the files of the picture and its table; "" if a command writes none."""

    table_files: ClassVar[tuple[str, ...]] = ()
    """Names of files of tables beside that of the picture."""

    generates: ClassVar[bool] = False
    """Whether a command can write the answer as code, see :meth:`to_generate`."""

    fails_if: ClassVar[str] = ""
    """When the status of a command is 1, as the end of a sentence."""

    ivp: Any
    """The problem."""

    frame: "pd.DataFrame"
    """The numbers, of a result that has them in one table."""

    @property
    def table(self) -> "pd.DataFrame":
        """The numbers of the result."""
        return self.frame

    @property
    def posed(self) -> dict[str, Any]:
        """The names of the problem and of the case, and the parameters."""
        return {"problem": self.ivp.problem, "case": self.ivp.case, "parameters": dict(self.ivp.parameters)}

    @property
    def drawn(self) -> "pd.DataFrame":
        """The numbers of the picture, where they are not those of the table, which then has the first file of :attr:`table_files`."""
        return self.table

    @classmethod
    def outputs(cls, **asked: Any) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Return the tables, and the stems of pictures with a table each, that a study with these arguments may write."""
        return cls.table_files, (cls.stem,) if cls.stem else ()

    @property
    def origin(self) -> Mapping[str, str]:
        """How the result was made, beyond the definition of the problem, for the text beside its table."""
        return {}

    @property
    def status(self) -> int:
        """Exit status of a command with this result."""
        return 0

    def summary(self) -> Mapping[str, Any]:
        """Return a summary of the result, by name."""
        raise NotImplementedError

    def printed(self) -> Iterator[str | Table | Mapping[str, Any]]:
        """Yield the output of a command: sentences, tables, and mappings, of which each name is a line."""
        yield self.summary()

    def to_generate(self) -> tuple[Mapping[str, Any], str]:
        """Return arguments of :func:`daebench.generate` for the answer, none if there is none, and a note on it."""
        raise NotImplementedError

    def plot(self) -> "Figure":
        """Return a figure of Matplotlib that shows the result; a notebook displays it, and ``savefig`` writes it."""
        if not self.drawn_by:
            raise DaebenchError("this result has no picture.", "result-without-picture")
        figure: Figure = import_module(self.drawn_by).figure(self)
        return figure

    def write(self, folder: Path) -> list[Path]:
        """Write the picture as STEM.svg and STEM.png with its table STEM.csv, and the table, into a folder; return the paths."""
        figures = import_module("daebench.draw.figures")
        for name in self.table_files:
            figures.save_table(folder / name, self.table)
        picture = figures.save(self.signed(self.plot()), folder, self.stem, self.drawn)
        return [*(folder / name for name in self.table_files or (f"{self.stem}.csv",)), picture]

    def signed(self, figure: "Figure") -> "Figure":
        """Return a figure, which names the module that draws it in its files."""
        figure.set_label(self.drawn_by or type(self).__module__)
        return figure

    def _repr_html_(self) -> str:
        """Return the table and the picture as HTML for a notebook."""
        rows = "".join(
            f'<tr><th style="text-align:left">{escape(name)}</th><td style="text-align:left">{escape(text)}</td></tr>'
            for name, value in self.summary().items()
            if (text := in_words(value))
        )
        return f'<div style="{STYLE}"><table>{rows}</table>{self._picture()}</div>'

    def _picture(self) -> str:
        """Return the picture as an element of a page, or a sentence that says why there is none."""
        try:
            figure = self.plot()
        # A notebook shows the numbers even where there is no picture of them.
        except DaebenchError as error:
            return f"<p>{escape(str(error))}</p>"
        return image(figure)


def tabular(study: "Callable[Given, Result]") -> "Callable[Given, pd.DataFrame]":
    """Return a study as a function that returns the table of its result; its command is made from the study, which it wraps."""

    @wraps(study)
    def function(*given: Given.args, **named: Given.kwargs) -> "pd.DataFrame":
        return study(*given, **named).table

    function.__signature__ = signature(study).replace(return_annotation="pandas.DataFrame")  # type: ignore[attr-defined]
    return function


def image(figure: Any) -> str:
    """Return a figure as an element of a page that contains its pixels."""
    with import_module("daebench.draw.figures").drawing():
        pixels = BytesIO()
        figure.savefig(pixels, format="png", dpi=DPI)
    code = base64.b64encode(pixels.getvalue()).decode("ascii")
    return f'<img style="max-width:100%" alt="picture of the result" src="data:image/png;base64,{code}">'


def in_words(value: Any) -> str:
    """Return a value as text for one row of a table; "" if it is missing, empty or too long."""
    if isinstance(value, Mapping):
        return "" if len(value) > MOST_ITEMS else ", ".join(f"{name} {words}" for name, item in value.items() if (words := in_words(item)))
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return "" if len(value) > MOST_ITEMS else ", ".join(filter(None, map(in_words, value)))
    if isinstance(value, float):
        return f"{value:.6g}"
    return "" if value is None else str(value)
