"""Derivatives of long sums: each term is differentiated only by its own symbols, and terms of equal form only once."""

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
