"""Numbers and operations of JavaScript."""

from collections.abc import Callable, Mapping

from daebench.compiler.print import texts
from daebench.compiler.print.texts import ATOM, Text, signed
from daebench.compiler.trace.names import FUNCTIONS

INFIX = texts.INFIX | {"eq": ("===", 4), "ne": ("!==", 4)}
"""Operators with their precedences."""

SIGNS = {"neg": "-", "not": "!", "btoi": "+", "btod": "+"}
SAME = frozenset(("itod", "dtoi"))
"""Conversions that change nothing: whole numbers are numbers, and only whole numbers become such."""

CALLS = {name: f"Math.{name}({{}})" for name in (*FUNCTIONS, "abs")} | {"exp2": "Math.pow(2,{})"}
"""Functions of numbers."""

NOTHING: Text = ("0", ATOM)
"""A derivative that is known to be zero."""

WITHOUT: Mapping[str, Callable[..., Text]] = {
    "mul": lambda x, y: NOTHING,
    "add": lambda x, y: y if x == NOTHING else x,
    "sub": lambda x, y: x if y == NOTHING else signed("-", y),
    "neg": lambda x: x,
    "abs": lambda x: x,
}
"""Operations on derivatives of which one is zero."""


def number(x: float) -> str:
    """Return the text of a number, with as many digits as are needed to restore it."""
    if isinstance(x, bool):
        return str(x).lower()
    if x != x:
        return "NaN"
    if x in (float("inf"), -float("inf")):
        return "Infinity" if x > 0 else "-Infinity"
    text = repr(int(x)) if float(x).is_integer() and abs(x) < 1e6 and str(float(x)) != "-0.0" else repr(x)
    return text.removeprefix("0") if text.startswith("0.") else text
