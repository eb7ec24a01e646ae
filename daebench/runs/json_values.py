"""Values in JSON: numbers that are not finite are written as null, and refused when they are read."""

import json
import math
from collections.abc import Mapping
from typing import Any

MOST = 2**23
"""Most values of a JSON text that is read: a value takes up to a hundred times its place in the text."""


def plain(value: Any) -> Any:
    """Return a value in a form that JSON supports: arrays as lists, and null for numbers that are not finite."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def strict(content: bytes | str) -> Any:
    """Return the content of a JSON text."""
    # Before parsing: commas bound the number of values, and counting them needs no memory.
    if (content.count(",") if isinstance(content, str) else content.count(b",")) > MOST:
        raise ValueError(f"it has more than {MOST} values")
    try:
        return json.loads(content, parse_constant=_no_number, parse_float=_finite, parse_int=_whole)
    except RecursionError as error:
        raise ValueError("it is nested too deeply") from error


def _no_number(word: str) -> float:
    raise ValueError(f"it has {word} in place of a number")


def _finite(digits: str) -> float:
    """Return a number; refuse one that overflows double precision."""
    if not math.isfinite(value := float(digits)):
        _no_number(digits[:40])
    return value


def _whole(digits: str) -> int:
    """Return a whole number; refuse one that overflows double precision."""
    # As a float first: a text of a million digits overflows there, and need not become an integer.
    _finite(digits)
    return int(digits)
