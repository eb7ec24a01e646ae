"""The picture of a comparison as a separate file, for slides and papers: its options, checked before the runs."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from daebench.cli.console import printable
from daebench.errors import BadInput
from daebench.runs.files import check_place
from daebench.runs.outputs import described, require_own
from daebench.runs.provenance import definition
from daebench.runs.texts import sides, words

if TYPE_CHECKING:
    from daebench.studies.comparison.figure import Look

LEAST, MOST = 2.0, 60.0
"""Widths and heights, inches."""


@dataclass(frozen=True)
class PictureFile:
    """FILE.pdf, .svg or .png of ``compare --out``, and its layout."""

    path: Path
    look: "Look"

    @classmethod
    def of(
        cls, out: Path | None, methods: int, *, size: str | None, title: str | None, labels: str | None, colors: str | None
    ) -> "PictureFile | None":
        """Return the file that --out names; None if it is a folder, or is left out.

        Raises
        ------
        BadInput
            If the options do not fit, or are given for a folder.
        """
        from daebench.draw.figures import PICTURES

        if out is None or out.suffix.lower() not in PICTURES or out.is_dir():
            if size or title or labels or colors:
                raise BadInput("--size, --title, --labels and --colors belong to one picture; add --out FILE.pdf, .svg or .png.")
            return None
        from daebench.studies.comparison.figure import Look

        named, painted = _of_each("--labels", labels, methods), _of_each("--colors", colors, methods)
        _check_colors(painted)
        return cls(out, Look(_size(size), printable(title or "").replace("$", r"\$"), named, painted))

    @property
    def _files(self) -> tuple[Path, Path]:
        return self.path, self.path.with_suffix(".csv")

    def check(self) -> None:
        """Refuse, before the runs, a path that cannot be written to, and files that the command did not write."""
        for path in self._files:
            check_place(path)
            require_own(path)

    def written(self, ivp: Any, runs: Sequence[Any]) -> list[str]:
        """Write picture and data, and beside each how it was made; return their paths."""
        from daebench.studies.comparison.figure import write_picture

        methods = ", ".join(f"{run.method} with {run.knob} = {run.value:g}" for run in runs)
        with described(self._files, {**definition(ivp), "Methods": methods}):
            return [str(path) for path in write_picture(self.path, ivp, runs, self.look)]


def _of_each(option: str, text: str | None, methods: int) -> list[str]:
    """Return the entries of an option, one for each method."""
    given = words(text or "")
    if given and len(given) != methods:
        raise BadInput(f"{option} has {len(given)} entries for {methods} methods; give one entry per method, separated by commas.")
    return given


def _check_colors(colors: Sequence[str]) -> None:
    if not colors:
        return
    from matplotlib.colors import is_color_like

    for color in colors:
        if not is_color_like(color):
            raise BadInput(f"--colors: {color!r} is not a colour; give names such as black, or #rrggbb.")


def _size(text: str | None) -> tuple[float, float] | None:
    """Return width and height of a text such as 16x9."""
    if text is None:
        return None
    width, height = sides(text, float) or (0.0, 0.0)
    if not (LEAST <= width <= MOST and LEAST <= height <= MOST):
        raise BadInput(f"--size {text!r} must be width x height in inches, each from {LEAST:g} to {MOST:g}, for example 16x9.")
    return width, height
