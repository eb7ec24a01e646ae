"""Whole numbers in any notation: 1000000, 1_000_000 and 1e6 are the same."""

import typer


def whole(text: str) -> int:
    """Return the whole number of a text, which may have an exponent; refuse any other text."""
    try:
        return int(text)
    except ValueError:
        pass
    try:
        number = float(text)
        if number == int(number):
            return int(number)
    except (ValueError, OverflowError):
        pass
    raise typer.BadParameter(f"{text!r} is not a valid integer.")
