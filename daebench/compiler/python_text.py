"""Python source as text: functions and tuples."""

from collections.abc import Iterable


def function(signature: str, *lines: str) -> str:
    """Return the source of a function with these lines as its body."""
    return f"def {signature}:\n    " + "\n    ".join(lines) + "\n"


def pack(items: Iterable[str]) -> str:
    """Return the source of a tuple of these items."""
    inner = ", ".join(items)
    return f"({inner},)" if inner else "()"
