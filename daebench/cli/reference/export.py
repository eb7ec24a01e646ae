"""``daebench reference export``: a reference as a file for another program."""

from pathlib import Path
from typing import Annotated

import typer

from daebench.cli.arguments import Json, Overwrite
from daebench.cli.console import print_written
from daebench.cli.reference.arguments import Folder, Name
from daebench.errors import BadInput, unknown
from daebench.reference.keep.dense_evaluation import WRITERS, write
from daebench.reference.keep.form import require_name
from daebench.reference.keep.store import load
from daebench.runs.files import check_place
from daebench.runs.outputs import described, require_own
from daebench.runs.texts import number, numbers

MOST = 1_000_000
"""Largest number of times of a range."""


def export(
    name: Name,
    kind: Annotated[str, typer.Option("--format", help="csv, json, npz or parquet.")] = "csv",
    times: Annotated[str | None, typer.Option("--times", help="t1,t2,... or from:to:step; all stored times if left out.")] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="File to write; NAME.FORMAT in the current folder if left out.", show_default=False)
    ] = None,
    overwrite: Overwrite = False,
    folder: Folder = None,
    as_json: Json = False,
) -> None:
    """Write a reference to a file: stored digits at stored times, integrated ones between them; error bounds beside the numbers."""
    require_name(name)
    if kind not in WRITERS:
        raise unknown("format", kind, WRITERS)
    path = Path(f"{name}.{kind}") if out is None else out
    check_place(path)
    require_own(path)
    reference = load(name, folder)
    certificate = reference.certificate
    about = {
        "Reference": f"{name}, certified, with an error bound for every number",
        "Certificate": f"checksum {certificate['checksum']}",
        "Definition": str(certificate["definition"]),
        "Times": times or "all stored",
    }
    with described([path], about):
        write(path, kind, reference, _times(times))
    print_written([path], as_json=as_json, reference=name)


def _times(text: str | None) -> list[float] | None:
    """Return the times of a list or of a range with both ends."""
    if text is None or ":" not in text:
        return numbers("--times", text)
    parts = [number("--times", part) for part in text.split(":")]
    if len(parts) != 3 or not parts[2] > 0 or not parts[1] >= parts[0]:
        raise BadInput(f"--times {text}: a range is from:to:step, ascending, for example 0:10:0.5.", "times-range-malformed")
    steps = (parts[1] - parts[0]) / parts[2]
    if steps > MOST:
        raise BadInput(f"--times {text} has more than {MOST} times; give a larger step.", "too-many-times-in-range")
    # A quotient that is whole but for rounding counts as whole, so that the end of a range is in it.
    return [parts[0] + k * parts[2] for k in range(int(steps + 1e-9) + 1)]
