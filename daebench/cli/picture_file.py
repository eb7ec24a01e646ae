"""The picture of a result as a separate file, for slides and papers: its options, checked before the runs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import typer

from daebench.cli.console import printable
from daebench.diagnostics.along import LABELS
from daebench.draw.figures import PICTURES, save_picture, save_table
from daebench.errors import BadInput, unknown
from daebench.runs.files import check_place
from daebench.runs.outputs import described, require_own
from daebench.runs.provenance import definition
from daebench.runs.result import Look
from daebench.runs.texts import sides, words

LEAST, MOST = 2.0, 60.0
"""Widths and heights, inches."""

OPTIONS: Mapping[str, Any] = {
    "size": Annotated[str | None, typer.Option("--size", help="Width and height of FILE in inches, for example 16x9.")],
    "title": Annotated[str | None, typer.Option("--title", help="Title of FILE; problem and case if left out.")],
    "labels": Annotated[str | None, typer.Option("--labels", help="Display names of the methods in FILE, comma-separated.")],
    "colors": Annotated[str | None, typer.Option("--colors", help="Colours of the methods in FILE: black,#0072b2.")],
    "panels": Annotated[
        str | None, typer.Option("--panels", help=f"Panels of FILE in their order, comma-separated: {', '.join(LABELS)}; all if left out.")
    ],
}
"""Options of the layout."""


@dataclass(frozen=True)
class PictureFile:
    """FILE.pdf, .svg or .png of ``--out``, and its layout."""

    path: Path
    look: Look

    @property
    def _files(self) -> tuple[Path, Path]:
        return self.path, self.path.with_suffix(".csv")

    def check(self) -> None:
        """Refuse, before the runs, a path that cannot be written to, and files that the command did not write."""
        for path in self._files:
            check_place(path)
            require_own(path)

    def write(self, result: Any) -> list[str]:
        """Write picture and data, and beside each how it was made; return their paths."""
        with described(self._files, definition(result.ivp) | result.origin):
            save_picture(result.signed(result.plot(self.look)), self.path)
            save_table(self._files[1], result.drawn)
        return [str(path) for path in self._files]


def picture_file(out: Path | None, methods: int, given: Mapping[str, str | None]) -> PictureFile | None:
    """Return the file that --out names, with the layout that :data:`OPTIONS` give; None if it is a folder, or is left out.

    BadInput is raised if the options do not fit the number of methods, or are given for a folder.
    """
    if out is None or out.suffix.lower() not in PICTURES or out.is_dir():
        if any(given.values()):
            raise BadInput(
                "--size, --title, --labels, --colors and --panels belong to one picture; add --out FILE.pdf, .svg or .png.",
                "style-of-no-single-picture",
            )
        return None
    labels, colors = (_one_a_method(f"--{name}", given[name], methods) for name in ("labels", "colors"))
    _check_colors(colors)
    panels = words(given["panels"] or "")
    for panel in panels:
        if panel not in LABELS:
            raise unknown("panel", panel, LABELS)
    # Matplotlib would set what is between two dollar signs as a formula.
    return PictureFile(out, Look(_size(given["size"]), printable(given["title"] or "").replace("$", r"\$"), labels, colors, panels))


def _one_a_method(option: str, text: str | None, methods: int) -> list[str]:
    entries = words(text or "")
    if entries and len(entries) != methods:
        raise BadInput(
            f"{option} has {len(entries)} entries for {methods} methods; give one entry per method, separated by commas.",
            "entries-not-per-method",
        )
    return entries


def _check_colors(colors: Sequence[str]) -> None:
    if not colors:
        return
    from matplotlib.colors import is_color_like

    for color in colors:
        if not is_color_like(color):
            raise BadInput(f"--colors: {color!r} is not a colour; give names such as black, or #rrggbb.", "not-a-colour")


def _size(text: str | None) -> tuple[float, float] | None:
    """Return width and height of a text such as 16x9."""
    if text is None:
        return None
    width, height = sides(text, float) or (0.0, 0.0)
    if not (LEAST <= width <= MOST and LEAST <= height <= MOST):
        raise BadInput(
            f"--size {text!r} must be width x height in inches, each from {LEAST:g} to {MOST:g}, for example 16x9.",
            "size-in-inches-malformed",
        )
    return width, height
