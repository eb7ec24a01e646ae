"""Derivatives of long sums and of nested functions.

In a long sum, each term is differentiated only by its own symbols, and terms of equal form only once. In a function of functions, each
different part is differentiated once, however often it is written.
"""

from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from typing import Any

import sympy as sp


def jacobian(values: Sequence[sp.Expr] | sp.Matrix, symbols: Sequence[sp.Symbol] | sp.Matrix) -> sp.Matrix:
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


def in_form(expression: Any, symbols: Sequence[sp.Symbol]) -> tuple[Any, list[sp.Symbol]]:
    """Return an expression with its symbols replaced by stand-ins, and the stand-ins; expressions of equal form become equal."""
    stand_ins = [stand_in(rank, tuple(sorted(symbol.assumptions0.items()))) for rank, symbol in enumerate(symbols)]
    return expression.xreplace(dict(zip(symbols, stand_ins, strict=True))), stand_ins


@cache
def stand_in(rank: int, assumptions: tuple[tuple[str, bool], ...]) -> sp.Symbol:
    """Return the stand-in for the symbol of this rank in an expression; the names sort like the ranks."""
    return sp.Dummy(f"x{rank:04}", **dict(assumptions))


def nested_jacobian(values: Sequence[sp.Expr], symbols: Sequence[sp.Symbol]) -> sp.Matrix:
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
