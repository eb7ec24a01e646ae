"""Statements of a script over numbers, and their text. An expression is a name, a number, or an operation with its operands."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any

Expression = Any
"""str: a name; float, int or bool: itself; tuple: an operation, then its operands."""


@dataclass
class Let:
    """A name that is assigned once."""

    name: str
    value: Expression


@dataclass
class Variables:
    """Names that are assigned repeatedly."""

    names: list[str] = field(default_factory=list)


@dataclass
class Set:
    """An assignment to a variable."""

    name: str
    value: Expression


@dataclass
class Put:
    """An assignment to an entry of an array."""

    array: str
    index: Expression
    value: Expression


@dataclass
class If:
    """A choice between two blocks."""

    test: Expression
    then: list[Any]
    other: list[Any]


@dataclass
class For:
    """A loop of a block over the integers from ``start`` up to, but not including, ``stop``."""

    name: str
    start: Expression
    stop: Expression
    body: list[Any]


@dataclass
class Label:
    """A block that can be left early."""

    name: str
    body: list[Any]


@dataclass
class Break:
    """The end of a labelled block."""

    name: str


PRECEDENCE = {"?": 1, "||": 2, "&&": 3} | dict.fromkeys(("===", "!=="), 4) | dict.fromkeys(("<", "<=", ">", ">="), 5)
PRECEDENCE |= {"+": 6, "-": 6, "*": 7, "/": 7, "neg": 8, "!": 8}
ATOM = 9


def heads(statement: Any) -> list[Expression]:
    """Return the expressions of a statement itself, without those of its blocks."""
    match statement:
        case Let() | Set():
            return [statement.value]
        case Put():
            return [statement.index, statement.value]
        case If():
            return [statement.test]
        case For():
            return [statement.start, statement.stop]
    return []


def blocks(statement: Any) -> list[list[Any]]:
    """Return the blocks of a statement."""
    match statement:
        case If():
            return [statement.then, statement.other]
        case For() | Label():
            return [statement.body]
    return []


def every(block: Iterable[Any]) -> Iterator[Any]:
    """Yield all statements of a block and of the blocks within it."""
    for statement in block:
        yield statement
        for inner in blocks(statement):
            yield from every(inner)


def names_of(expression: Expression) -> Iterator[str]:
    """Yield the names in an expression, as often as they occur."""
    if isinstance(expression, str):
        yield expression
    elif isinstance(expression, tuple):
        for operand in expression[1:]:
            yield from names_of(operand)


def number(x: float) -> str:
    """Return the text of a number, with as many digits as are needed to restore it."""
    if isinstance(x, bool):
        return str(x).lower()
    if x != x:
        return "NaN"
    if x in (float("inf"), -float("inf")):
        return "Infinity" if x > 0 else "-Infinity"
    text = repr(int(x)) if float(x).is_integer() and abs(x) < 1e6 and str(float(x))[0] != "-" else repr(x)
    return text.removeprefix("0") if text.startswith("0.") else text


def text(expression: Expression) -> tuple[str, int]:
    """Return the text of an expression, and its precedence; operations stay in the order in which Python does them."""
    if isinstance(expression, str):
        return expression, ATOM
    if not isinstance(expression, tuple):
        written = number(expression)
        return written, PRECEDENCE["neg"] if written.startswith("-") else ATOM
    operation, *operands = expression
    if operation == "?":
        test, then, other = (bound(operand, 2) for operand in operands)
        return f"{test}?{then}:{other}", 1
    if operation == "index":
        return f"{operands[0]}[{text(operands[1])[0]}]", ATOM
    if operation == "length":
        return f"{operands[0]}.length", ATOM
    if operation.startswith("Math."):
        return f"{operation}({','.join(text(operand)[0] for operand in operands)})", ATOM
    level = PRECEDENCE[operation]
    if len(operands) == 1:
        return ("-" if operation == "neg" else str(operation)) + bound(operands[0], ATOM), level
    right = level if operation in ("&&", "||") else level + 1
    return bound(operands[0], level, first=True) + operation + bound(operands[1], right), level


def bound(expression: Expression, least: int, *, first: bool = False) -> str:
    """Return an expression, in parentheses if its precedence is below ``least`` or if two signs would meet."""
    written, level = text(expression)
    return f"({written})" if level < least or (written.startswith("-") and not first) else written


def written(block: Iterable[Any]) -> str:
    """Return the text of a block."""
    return "".join(map(_written, block))


def _written(statement: Any) -> str:  # noqa: C901 - a case a kind of statement
    match statement:
        case Let(name, value):
            return f"const {name}={text(value)[0]};"
        case Variables(names):
            return f"let {','.join(names)};" if names else ""
        case Set(name, value):
            return f"{name}={text(value)[0]};"
        case Put(array, index, value):
            return f"{array}[{text(index)[0]}]={text(value)[0]};"
        case If(test, then, other):
            return f"if({text(test)[0]}){{{written(then)}}}" + (f"else{{{written(other)}}}" if other else "")
        case For(name, start, stop, body):
            return f"for(let {name}={text(start)[0]};{name}<{text(stop)[0]};{name}++){{{written(body)}}}"
        case Label(name, body):
            return f"{name}:{{{written(body)}}}"
        case Break(name):
            return f"break {name};"
    raise TypeError(statement)
