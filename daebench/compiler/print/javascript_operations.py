"""Expressions of JavaScript as texts with their precedences, and the operations on them."""

from collections.abc import Callable, Mapping

Text = tuple[str, int]
"""An expression, and its precedence."""


INFIX = {"and": ("&&", 3), "or": ("||", 2), "eq": ("===", 4), "ne": ("!==", 4), "lt": ("<", 5), "le": ("<=", 5), "gt": (">", 5)}
INFIX |= {"ge": (">=", 5), "add": ("+", 6), "sub": ("-", 6), "mul": ("*", 7), "div": ("/", 7), "mod": ("%", 7)}
"""Operators with their precedences."""

SIGNS = {"neg": "-", "not": "!", "btoi": "+", "btod": "+"}
CHOICE, SIGN, ATOM = 1, 8, 9
"""Precedences of a choice, of a sign, and of what needs no parentheses."""

SAME = frozenset(("itod", "dtoi"))
"""Conversions that change nothing: whole numbers are numbers, and only whole numbers become such."""

_NAMES = "abs acos acosh asin asinh atan atan2 atanh cbrt cos cosh exp expm1 hypot log log10 log1p log2 pow sin sinh sqrt tan tanh"

CALLS = {name: f"Math.{name}({{}})" for name in _NAMES.split()} | {"exp2": "Math.pow(2,{})"}
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


def infix(op: str, first: Text, *others: Text) -> Text:
    """Return an operation on two or more operands; operations stay in the order in which they were recorded."""
    sign, level = INFIX[op]
    found = first
    for other in others:
        right = level if op in ("and", "or") else level + 1
        found = f"{bound(found, level, first=True)}{sign}{bound(other, right)}", level
    return found


def signed(sign: str, x: Text) -> Text:
    """Return an expression with a sign before it."""
    return sign + bound(x, ATOM), SIGN


def bound(x: Text, least: int, *, first: bool = False) -> str:
    """Return an expression, in parentheses if its precedence is below ``least`` or if two signs would meet."""
    written, level = x
    return f"({written})" if level < least or (written[0] in "-+" and not first) else written
