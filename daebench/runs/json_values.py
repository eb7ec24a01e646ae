"""Values as JSON has them, written without and read with care: what is not finite is not a number there."""

import json
import math
from collections.abc import Mapping
from typing import Any


def plain(value: Any) -> Any:
    """Return a value as JSON knows it: arrays as lists, what is not finite as null."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def strict(content: bytes | str) -> Any:
    """Return what a JSON text has.

    Raises
    ------
    ValueError
        If it is no JSON, is nested too deep, or has a number that is not finite.
    """
    try:
        return json.loads(content, parse_constant=_no_number, parse_float=_finite, parse_int=_whole)
    except RecursionError as error:
        raise ValueError("it is nested too deep") from error


def _no_number(word: str) -> float:
    raise ValueError(f"it has {word} in the place of a number")


def _finite(digits: str) -> float:
    """Return a number; one beyond double precision is none that was written."""
    if not math.isfinite(value := float(digits)):
        _no_number(digits[:40])
    return value


def _whole(digits: str) -> int:
    """Return a whole number; one beyond double precision is none that was written."""
    _finite(digits)
    return int(digits)
