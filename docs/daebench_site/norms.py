"""Vertical bars in docstrings are norms, ``|g|``, and not the substitutions of reStructuredText, of which there are none."""

from typing import Any

from docutils.parsers.rst.states import Inliner


def as_written(self: Any, match: Any, lineno: int) -> tuple[str, list[Any], str, list[Any]]:
    """Return the text up to a bar and the bar itself as text."""
    end = match.end("start")
    return match.string[:end], [], match.string[end:], []


def setup(app: Any) -> None:
    """Have bars stand as they are written."""
    Inliner.dispatch["|"] = as_written
