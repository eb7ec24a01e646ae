"""Numbers as people hand them over: each is what it should be, or there is a sentence."""

import math
from typing import Any

from daebench.errors import BadInput


def real(name: str, value: Any) -> float:
    """Return a value as a finite float.

    Raises
    ------
    BadInput
        If it is none.
    """
    try:
        number = float(value) if not isinstance(value, bool | str | bytes) else math.nan
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not math.isfinite(number):
        raise BadInput(f"{name} = {value!r} must be a finite number.")
    return float(number)


def positive(name: str, value: Any) -> float:
    """Return a value as a finite float greater than 0.

    Raises
    ------
    BadInput
        If it is none.
    """
    number = real(name, value)
    if number <= 0:
        raise BadInput(f"{name} = {number:g} must be greater than 0.")
    return number


def whole(name: str, value: Any) -> int:
    """Return a value as a whole number.

    Raises
    ------
    BadInput
        If it is none.
    """
    if isinstance(value, bool) or not hasattr(value, "__index__"):
        raise BadInput(f"{name} = {value!r} must be a whole number.")
    return int(value)
