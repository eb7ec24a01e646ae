"""Each different part of expressions once: nested square roots have few of them, but written out they are a hundred thousand operations."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

import sympy as sp


def parts(expressions: Iterable[sp.Basic]) -> Iterator[sp.Basic]:
    """Yield each different part of expressions once, the expressions among them."""
    met, waiting = set[sp.Basic](), list(expressions)
    while waiting:
        part = waiting.pop()
        if part not in met:
            met.add(part)
            waiting += part.args
            yield part


def rebuilt(expressions: Sequence[sp.Expr], change: Callable[[sp.Basic], sp.Basic]) -> list[sp.Expr]:
    """Return expressions with each part replaced by what ``change`` makes of it, after the parts of that part."""
    known: dict[sp.Basic, sp.Basic] = {}

    def changed(part: sp.Basic) -> sp.Basic:
        if part not in known:
            arguments = [changed(argument) for argument in part.args]
            known[part] = change(part if arguments == list(part.args) else part.func(*arguments))
        return known[part]

    return [changed(expression) for expression in expressions]


def replaced(expressions: Sequence[sp.Expr], values: Mapping[sp.Symbol, sp.Expr]) -> list[sp.Expr]:
    """Return expressions with values in the place of symbols."""
    return rebuilt(expressions, lambda part: values.get(part, part))
