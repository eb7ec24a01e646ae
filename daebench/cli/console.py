"""Input and output that commands share: parsing of lists, tables, JSON, and a progress bar that appears after two seconds."""

import json
import sys
import threading
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from daebench.compiler.under_way import under_way
from daebench.errors import BadInput
from daebench.runs.json_values import plain
from daebench.runs.texts import words
from daebench.systems.lazily import rich

PATIENCE = 2.0
"""Seconds before a progress bar appears."""

SILENCE = 20.0
"""Seconds before a command prints its progress if no bar can be shown."""

PLAN = "plan: "
"""Beginning of a label that is a plan of the whole work."""

REFRESH = 0.1
"""Seconds between two updates."""


def method_names(text: str) -> list[str]:
    """Return the comma-separated names of methods; refuse a text without names."""
    if not (names := words(text)):
        raise BadInput("--methods names no method; give at least one, for example rattle.", "methods-option-empty")
    return names


def methods_if_given(text: str | None) -> list[str] | None:
    """Return the names of methods of an option that may be left out."""
    return None if text is None else method_names(text)


def print_json(value: Any) -> None:
    """Print exactly one JSON value on standard output."""
    encoding = (getattr(sys.stdout, "encoding", None) or "utf-8").lower()
    print(json.dumps(plain(value), allow_nan=False, ensure_ascii=not encoding.startswith("utf")))


def print_written(paths: Iterable[object], *, as_json: bool = False, **more: Any) -> None:
    """Print the names of the written files, if any; as JSON in one object with ``more``."""
    if as_json:
        print_json({**more, "written": list(map(str, paths))})
    elif names := ", ".join(map(str, paths)):
        print(f"written: {names}")


def printable(text: str) -> str:
    """Return a text with escaped control characters, because it may come from an untrusted file."""
    return "".join(c if c.isprintable() or c == "\n" else ascii(c)[1:-1] for c in text)


def print_table(columns: Sequence[str], rows: Sequence[Sequence[str]], title: str = "", *, width: int = 0) -> None:
    """Print a table, within a width in characters if one is given."""
    narrow = bool(width)
    heading = rich.text.Text(printable(title)) if title else None
    table = rich.table.Table(title=heading, title_justify="left", title_style="bold", pad_edge=False, collapse_padding=narrow)
    table.box = rich.box.SIMPLE_HEAD
    for column in columns:
        table.add_column(rich.text.Text(printable(column)), overflow="fold")
    for row in rows:
        table.add_row(*map(rich.text.Text, map(printable, row)))
    console = rich.console.Console()
    # Rich takes 80 columns where there is no terminal, and would fold cells in the middle of numbers.
    if not console.is_terminal:
        console.width = 200
    if width:
        console.width = min(width, console.width)
    console.print(table)


class Bar:
    """A progress bar with the remaining time on standard error, for work of more than two seconds; in a file, occasional lines."""

    def __init__(self, label: str) -> None:
        self._label, self._fraction = label, 0.0
        self._over = threading.Event()
        seen = sys.stderr is not None and sys.stderr.isatty()
        # A daemon, so that no bar keeps a process alive whose work has ended in an error.
        self._shows = threading.Thread(target=self._show if seen else self._tell, daemon=True)
        self._shows.start()

    def __call__(self, fraction: float, label: str | None = None) -> None:
        """Show the fraction done and the current work; a plan of the work is printed."""
        if label and label.startswith(PLAN):
            print(f"daebench: {label}", file=sys.stderr)
            label = ""
        self._label, self._fraction = label or self._label, fraction

    @property
    def _work(self) -> str:
        """The current work: what is compiled, if anything is."""
        return under_way() or self._label

    def _show(self) -> None:
        """Show the bar after its delay."""
        if self._over.wait(PATIENCE):
            return
        progress = rich.progress
        described, remaining = progress.TextColumn("{task.description}", markup=False), progress.TimeRemainingColumn(compact=True)
        columns = (described, progress.BarColumn(), progress.TaskProgressColumn(), remaining)
        with progress.Progress(*columns, console=rich.console.Console(stderr=True), transient=True) as shown:
            task = shown.add_task(self._work)
            while not self._over.wait(REFRESH):
                shown.update(task, description=self._work, completed=self._fraction, total=1.0 if self._fraction else None)

    def _tell(self) -> None:
        """Print the current work after a while, and again after twice the time."""
        seconds = waited = SILENCE
        while not self._over.wait(waited):
            print(f"daebench: {self._work}: {100 * self._fraction:.0f} % after {seconds:.0f} s", file=sys.stderr, flush=True)
            seconds, waited = 2 * seconds, seconds

    def close(self) -> None:
        """Remove the bar."""
        self._over.set()
        self._shows.join()


@contextmanager
def bar(label: str) -> Iterator[Bar]:
    """Show a progress bar during long work."""
    shown = Bar(label)
    try:
        yield shown
    finally:
        shown.close()
