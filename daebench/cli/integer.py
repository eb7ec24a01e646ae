"""Whole numbers in any notation: 1000000, 1_000_000 and 1e6 are the same."""

import typer

from daebench.errors import LARGEST, bounded


def whole(text: str) -> int:
    """Return the whole number of a text, which may have an exponent; refuse any other text."""
    number = _number(text)
    if number is None:
        raise typer.BadParameter(f"{bounded(repr(text))} is not a valid integer.")
    if abs(number) >= LARGEST:
        raise typer.BadParameter(f"{bounded(repr(text))} is too large; give a number below 2^63.")
    return number


def _number(text: str) -> int | None:
    try:
        return int(text)
    except ValueError:
        pass
    try:
        number = float(text)
        return int(number) if number == int(number) else None
    except (ValueError, OverflowError):
        return None
