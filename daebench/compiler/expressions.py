"""Expressions: their parts replaced, long sums and nested functions differentiated, and short forms.

In a long sum, each term is differentiated only by its own symbols, and terms of equal form only once. In a function of functions, each
different part is differentiated once, however often it is written.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cache
from typing import Any

import sympy as sp
from sympy.core.random import rng

from daebench.systems.definition_parts import extent

Expressions = Sequence[sp.Expr]
Symbols = Sequence[sp.Symbol]


def parts(expressions: Iterable[sp.Basic]) -> Iterator[sp.Basic]:
    """Yield each different part of expressions once, the expressions among them."""
    met, waiting = set[sp.Basic](), list(expressions)
    while waiting:
        part = waiting.pop()
        if part not in met:
            met.add(part)
            waiting += part.args
            yield part


def rebuilt(expressions: Expressions, change: Callable[[sp.Basic], sp.Basic]) -> list[sp.Expr]:
    """Return expressions with each part replaced by what ``change`` makes of it, after the parts of that part."""
    known: dict[sp.Basic, sp.Basic] = {}

    def changed(part: sp.Basic) -> sp.Basic:
        if part not in known:
            arguments = [changed(argument) for argument in part.args]
            known[part] = change(part if arguments == list(part.args) else part.func(*arguments))
        return known[part]

    return [changed(expression) for expression in expressions]


def replaced(expressions: Expressions, values: Mapping[sp.Symbol, sp.Expr]) -> list[sp.Expr]:
    """Return expressions with values in the place of symbols."""
    return rebuilt(expressions, lambda part: values.get(part, part))


def jacobian(values: Expressions | sp.Matrix, symbols: Symbols | sp.Matrix) -> sp.Matrix:
    """Return the derivatives of values, shape(rows,), with respect to symbols, shape(columns,), as a matrix, shape(rows, columns).

    The result equals that of ``Matrix.jacobian``, which takes every derivative of every term. Here a hundred pairs of bodies with the same
    force cost little more than one pair: the derivative is taken once, and the symbols of the other pairs are put into it.
    """
    places = {symbol: column for column, symbol in enumerate(symbols)}
    known: dict[tuple[sp.Expr, sp.Symbol], sp.Expr] = {}
    entries: dict[tuple[int, int], sp.Expr] = {}
    for row, value in enumerate(values):
        parts: dict[int, list[sp.Expr]] = {}
        for term in sp.Add.make_args(sp.sympify(value)):
            for column, derivative in _of_term(term, places, known):
                parts.setdefault(column, []).append(derivative)
        entries |= {(row, column): sp.Add(*terms) for column, terms in parts.items()}
    return sp.Matrix(sp.SparseMatrix(len(values), len(places), entries))


def _of_term(
    term: sp.Expr, places: Mapping[sp.Symbol, int], known: dict[tuple[sp.Expr, sp.Symbol], sp.Expr]
) -> Iterator[tuple[int, sp.Expr]]:
    """Yield the columns of the symbols of a term, with its derivatives with respect to them."""
    inside = sorted(term.free_symbols & places.keys(), key=places.__getitem__)
    if not inside:
        return
    form, stand_ins = in_form(term, inside)
    back = dict(zip(stand_ins, inside, strict=True))
    for symbol, stand_in in zip(inside, stand_ins, strict=True):
        if (form, stand_in) not in known:
            known[form, stand_in] = form.diff(stand_in)
        yield places[symbol], known[form, stand_in].xreplace(back)


def in_form(expression: Any, symbols: Symbols) -> tuple[Any, list[sp.Symbol]]:
    """Return an expression with its symbols replaced by stand-ins, and the stand-ins; expressions of equal form become equal."""
    stand_ins = [stand_in(rank, tuple(sorted(symbol.assumptions0.items()))) for rank, symbol in enumerate(symbols)]
    return expression.xreplace(dict(zip(symbols, stand_ins, strict=True))), stand_ins


@cache
def stand_in(rank: int, assumptions: tuple[tuple[str, bool], ...]) -> sp.Symbol:
    """Return the stand-in for the symbol of this rank in an expression; the names sort like the ranks."""
    return sp.Dummy(f"x{rank:04}", **dict(assumptions))


def nested_jacobian(values: Expressions, symbols: Symbols) -> sp.Matrix:
    """Return the derivatives of values, shape(rows,), with respect to symbols, shape(columns,), as a matrix, shape(rows, columns).

    The result is that of ``Matrix.jacobian``, which applies the chain rule to a part wherever it is written. Here it is applied once: two
    nested dyads, which are 300 different parts and written out are 100 000, take a second.
    """
    columns = [_Slopes(symbol) for symbol in symbols]
    return sp.Matrix(len(values), len(symbols), lambda i, j: columns[j].of(sp.sympify(values[i])))


class _Slopes:
    """The derivatives of parts with respect to a symbol."""

    def __init__(self, symbol: sp.Symbol) -> None:
        self.known: dict[sp.Basic, sp.Expr] = {symbol: sp.S.One}

    def of(self, part: sp.Expr) -> sp.Expr:
        """Return the derivative of an expression."""
        if part not in self.known:
            slopes = [(i, slope) for i, argument in enumerate(part.args) if (slope := self.of(argument)) != 0]
            self.known[part] = sp.Add(*(_partial(part, i, slope) for i, slope in slopes))
        return self.known[part]


def _partial(part: sp.Expr, i: int, slope: sp.Expr) -> sp.Expr:
    """Return the derivative of a function with respect to its argument with number ``i``, times the slope of that argument."""
    if part.is_Add:
        return slope
    if part.is_Mul:
        return sp.Mul(*part.args[:i], slope, *part.args[i + 1 :])
    if part.is_Pow and part.exp.is_number:
        return part * (slope * part.exp / part.base)
    stand_ins = [argument if argument.is_Number else sp.Dummy(real=True) for argument in part.args]
    partial = part.func(*stand_ins).diff(stand_ins[i])
    return slope * partial.xreplace(dict(zip(stand_ins, part.args, strict=True)))


LONG, SHORT = 1000, 60
"""Number of operations above which nothing is shortened, and number up to which SymPy's own simplification is tried last."""

VERY_LONG = 10 * LONG
"""Number of nodes, written out, above which operations are not even counted."""


def shortened(expression: sp.Expr) -> sp.Expr:
    """Return an expression simplified, after powers of sines or of cosines were replaced if that makes it shorter.

    A chart by angles gives polynomials in sines and cosines. After the replacement, little is left for SymPy's own, much slower
    simplification. Its result is used unless it is longer than its input.
    """
    if extent(expression)[0] > VERY_LONG or expression.count_ops() > LONG:
        return expression
    # SymPy chooses points at random. The same each time, because one run had not found factors after ten minutes that are found within a
    # second otherwise.
    state = rng.getstate()
    rng.seed(0)
    try:
        return _shortened(expression)
    finally:
        rng.setstate(state)


def _shortened(expression: sp.Expr) -> sp.Expr:
    """Return the shorter one of an expression and what it is simplified to."""
    if expression.is_rational_function():
        return min((expression, sp.factor(expression)), key=sp.count_ops)
    expanded = sp.expand(expression)
    forms = [expression, *(sp.factor(_without(expanded, function, other)) for function, other in ((sp.sin, sp.cos), (sp.cos, sp.sin)))]
    short = min(forms, key=sp.count_ops)
    return sp.simplify(short) if short.count_ops() <= SHORT else short


def _without(expression: sp.Expr, function: type[sp.Function], other: type[sp.Function]) -> sp.Expr:
    """Return an expanded expression without squares of one of the functions, sine or cosine."""

    def squares(power: sp.Pow) -> sp.Expr:
        base, exponent = power.as_base_exp()
        return base ** (exponent % 2) * (1 - other(base.args[0]) ** 2) ** (exponent // 2)

    def is_power(part: sp.Basic) -> bool:
        return isinstance(part, sp.Pow) and isinstance(part.base, function) and bool(part.exp.is_Integer) and part.exp >= 2

    return sp.expand(expression.replace(is_power, squares))
