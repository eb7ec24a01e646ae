"""Numbers in words, as HTML: 0.0123, 1.2 x 10^-5, a value with its error, counts, shares and lists."""

import math
from collections.abc import Sequence
from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal
from typing import Any

from markupsafe import Markup, escape

PLAIN = (1e-3, 1e5)
"""Moduli that are written without a power of ten."""

THIN, MINUS, TIMES, NONE = "\N{NARROW NO-BREAK SPACE}", "\N{MINUS SIGN}", "\N{MULTIPLICATION SIGN}", "\N{EN DASH}"


def number(value: float, digits: int = 2) -> Markup:
    """Return a number with so many significant digits as HTML: 0.0123, 1.2 x 10^-5; an en dash if it is not finite.

    Examples
    --------
    >>> str(number(0.012345, 3))
    '0.0123'
    """
    value = float(value)
    if not math.isfinite(value):
        return Markup(NONE)
    mantissa, _, exponent = f"{value:.{digits - 1}e}".partition("e")
    if value == 0:
        return Markup("0")
    if PLAIN[0] <= abs(value) < PLAIN[1]:
        return Markup(f"{value:.{max(0, digits - 1 - int(exponent))}f}".replace("-", MINUS))
    return Markup(f"{mantissa}{THIN}{TIMES}{THIN}10<sup>{exponent_text(int(exponent))}</sup>".replace("-", MINUS))


EXACT = 12
"""Digits to which a float is the decimal number that it was meant to be: 0.1 is 0.1, and no upper bound of it is 0.11."""


def at_most(value: float, digits: int = 2) -> Markup:
    """Return an upper bound of a number as HTML, for sentences that say "at most" or "to": so many digits, the last one rounded up.

    Examples
    --------
    >>> str(at_most(0.01231))
    '0.013'
    """
    return number(_bound(value, digits, ROUND_CEILING), digits)


def at_least(value: float, digits: int = 2) -> Markup:
    """Return a lower bound of a number as HTML, for sentences that say "at least": so many digits, the last one rounded down.

    Examples
    --------
    >>> str(at_least(0.01239))
    '0.012'
    """
    return number(_bound(value, digits, ROUND_FLOOR), digits)


def _bound(value: float, digits: int, rounding: str) -> float:
    """Return the nearest decimal number of so many digits above or below a value; of all digits before the point where it has more."""
    if not math.isfinite(value) or value == 0:
        return value
    if abs(value) < PLAIN[1]:
        digits = max(digits, math.floor(math.log10(abs(value))) + 1)
    return float(Context(prec=digits, rounding=rounding).plus(Context(prec=EXACT).create_decimal_from_float(value)))


def exponent_text(exponent: int) -> str:
    """Return an exponent with a proper minus sign."""
    return str(exponent).replace("-", MINUS)


def power_of_ten(value: float) -> Markup:
    """Return 10^k for the k nearest to a positive number on a logarithmic scale.

    Examples
    --------
    >>> str(power_of_ten(1200.0))
    '10<sup>3</sup>'
    """
    return Markup(f"10<sup>{exponent_text(round(math.log10(value)))}</sup>")


def with_error(value: float, error: float) -> Markup:
    """Return value +- error as HTML, both to the first digit of the error, or to its second where the first is 1 or 2.

    A value that is not finite gives an en dash, and an error that is not finite leaves the value alone.

    Examples
    --------
    >>> " ".join(with_error(2.0123, 0.042).split())
    '2.01 ± 0.04'
    """
    if not math.isfinite(value) or not math.isfinite(error) or error <= 0:
        return number(value, 3)
    last = math.floor(math.log10(error)) - (error < 3 * 10 ** math.floor(math.log10(error)))
    plain = PLAIN[0] <= abs(value) < PLAIN[1]
    power = 0 if plain else math.floor(math.log10(max(abs(value), error)))
    places = max(0, power - last)
    both = "\N{NO-BREAK SPACE}±\N{NO-BREAK SPACE}".join(f"{term / 10.0**power:.{places}f}" for term in (value, error)).replace("-", MINUS)
    return Markup(both if plain else f"({both}){THIN}{TIMES}{THIN}10<sup>{exponent_text(power)}</sup>")


def count(value: float) -> Markup:
    """Return a whole number with its digits in threes; an en dash if it is not known.

    Examples
    --------
    >>> str(count(1234).replace(THIN, " "))
    '1 234'
    """
    return Markup(NONE) if value != value else Markup(f"{round(value):,}".replace(",", THIN))


def percent(value: float, *, up: bool = False) -> Markup:
    """Return a share as a percentage with a digit after the point, or more where it is close to 0 or 100; an upper bound on request.

    Examples
    --------
    >>> str(percent(0.125).replace(THIN, " "))
    '12.5 %'
    """
    value = float(value)
    near = min(abs(value), abs(1 - value))
    places = 1 if near >= 1e-3 or near == 0 else min(6, 1 - math.floor(math.log10(near)) - 2)
    if not up:
        return Markup(f"{100 * value:.{places}f}{THIN}%")
    places += int(0 < near < 1e-2)
    share = Context(prec=EXACT).create_decimal_from_float(100 * value).quantize(Decimal(1).scaleb(-places), ROUND_CEILING)
    return Markup(f"{share:f}{THIN}%")


def listing(items: Sequence[Any]) -> Markup:
    """Return "a, b and c".

    Examples
    --------
    >>> str(listing(["RATTLE", "SHAKE", "IDA"]))
    'RATTLE, SHAKE and IDA'
    """
    parts = [escape(item) for item in items]
    return Markup(", ").join(parts[:-1]) + Markup(" and ") + parts[-1] if len(parts) > 1 else Markup("").join(parts)
