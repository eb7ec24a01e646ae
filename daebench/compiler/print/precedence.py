"""Expressions of languages with braces, in as few parentheses as their precedences allow."""

Text = tuple[str, int]
"""An expression, and its precedence."""

CHOICE, SIGN, ATOM = 1, 8, 9
"""Precedences of a choice, of a sign, and of what needs no parentheses."""

INFIX = {"and": ("&&", 3), "or": ("||", 2), "eq": ("==", 4), "ne": ("!=", 4), "lt": ("<", 5), "le": ("<=", 5), "gt": (">", 5)}
INFIX |= {"ge": (">=", 5), "add": ("+", 6), "sub": ("-", 6), "mul": ("*", 7), "div": ("/", 7), "mod": ("%", 7)}
"""Operators of languages with braces, with their precedences."""


def infix(operator: tuple[str, int], first: Text, *others: Text) -> Text:
    """Return an operation on two or more operands; operations stay in the order in which they were recorded."""
    sign, level = operator
    text = first
    for other in others:
        right = level if sign in ("&&", "||") else level + 1
        text = f"{bound(text, level, first=True)}{sign}{bound(other, right)}", level
    return text


def signed(sign: str, x: Text) -> Text:
    """Return an expression with a sign before it."""
    return sign + bound(x, ATOM), SIGN


def bound(x: Text, least: int, *, first: bool = False) -> str:
    """Return an expression, in parentheses if its precedence is below ``least`` or if two signs would meet."""
    written, level = x
    return f"({written})" if level < least or (written[0] in "-+" and not first) else written
