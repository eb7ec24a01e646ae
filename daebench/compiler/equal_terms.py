"""Sums with many terms of equal form as loops over index tables, for functions that would be too long as straight-line code.

The terms of all values that contain the same symbols are a *cluster*: for example, the forces between two bodies. Clusters that differ
only in their symbols, and in the values to which they contribute, become one loop, whose body is that of one cluster::

    for row in range(190):
        s_0 = q[TABLE[row, 0]]
        ...
        out[TABLE[row, 6]] += ...
"""

import hashlib
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import sympy as sp

from daebench.compiler import codegen
from daebench.compiler.expressions import Expressions, Symbols, in_form
from daebench.compiler.syntax import Lines, function

if TYPE_CHECKING:
    from daebench.compiler.constrained.derivation import Derivation


FEWEST = 3
"""Smallest number of clusters of equal form that becomes a loop; fewer are written out."""


class Text(NamedTuple):
    """Source that reads tables."""

    lines: Lines
    """Lines of a function's body."""
    tables: dict[str, str]
    """Sources of the tables, by their names."""


class Cluster(NamedTuple):
    """Terms with the same symbols."""

    symbols: tuple[sp.Symbol, ...]
    """Their symbols."""
    terms: dict[int, list[sp.Expr]]
    """Terms, by the number of the value to which they contribute."""


def added(
    name: str,
    arguments: codegen.Arguments,
    values: Mapping[tuple[int, ...], sp.Expr],
    parameters: Symbols,
    target: str = "out",
) -> Text:
    """Return lines that add each value to its entry of an array."""
    whole = [sp.sympify(value) for value in values.values()]
    codegen.require_smooth(name, whole)
    entries = {symbol: (array, i) for array, symbols in arguments.items() for i, symbol in enumerate(symbols)}
    sources = {symbol: f"par[{i}]" for i, symbol in enumerate(parameters)}
    places, text, rest = list(values), Text([], {}), Cluster((), {})
    for alike in _alike(_clusters(whole, list(entries))).values():
        if len(alike) < FEWEST:
            for cluster in alike:
                for k, terms in cluster.terms.items():
                    rest.terms.setdefault(k, []).extend(terms)
        else:
            _loop(text, alike, places, entries, sources, target)
    names = {symbol: f"{array}[{i}]" for symbol, (array, i) in entries.items()} | sources
    order = sorted(rest.terms)
    sums = [sp.Add(*rest.terms[k]) for k in order]
    text.lines.extend(_adding([f"{target}[{', '.join(map(str, places[k]))}]" for k in order], sums, names))
    return text


def _clusters(values: Expressions, symbols: Symbols) -> list[Cluster]:
    """Return the terms of sums, grouped by the symbols that they contain."""
    rank = {symbol: i for i, symbol in enumerate(symbols)}
    clusters: dict[frozenset[sp.Symbol | int], Cluster] = {}
    for k, value in enumerate(values):
        for term in sp.Add.make_args(value):
            inside = term.free_symbols & rank.keys()
            # Constants form a cluster of their own for each value.
            cluster = clusters.setdefault(frozenset(inside or {k}), Cluster(tuple(sorted(inside, key=rank.__getitem__)), {}))
            cluster.terms.setdefault(k, []).append(term)
    return list(clusters.values())


def _alike(clusters: Sequence[Cluster]) -> dict[tuple[sp.Expr, ...], list[Cluster]]:
    """Return clusters grouped by their form."""
    forms: dict[tuple[sp.Expr, ...], list[Cluster]] = {}
    for cluster in clusters:
        sums = sp.Tuple(*(sp.Add(*terms) for terms in cluster.terms.values()))
        forms.setdefault(tuple(in_form(sums, cluster.symbols)[0]), []).append(cluster)
    return forms


def _loop(
    text: Text,
    alike: Sequence[Cluster],
    places: Sequence[tuple[int, ...]],
    entries: Mapping[sp.Symbol, tuple[str, int]],
    sources: Mapping[sp.Symbol, str],
    target: str,
) -> None:
    """Add a loop over clusters of equal form to a text. Indices that are equal in all rows are not in the table."""
    columns: dict[tuple[int, ...], str] = {}

    def index(numbers: Sequence[int]) -> str:
        if len(set(numbers)) == 1:
            return str(numbers[0])
        return columns.setdefault(tuple(numbers), f"TABLE[row, {len(columns)}]")

    groups: dict[tuple[str, ...], list[Cluster]] = {}
    for cluster in alike:
        groups.setdefault(tuple(entries[symbol][0] for symbol in cluster.symbols), []).append(cluster)
    for arrays, group in groups.items():
        columns.clear()
        first = group[0]
        names = {
            symbol: f"{arrays[i]}[{index([entries[cluster.symbols[i]][1] for cluster in group])}]" for i, symbol in enumerate(first.symbols)
        }
        keys = [list(cluster.terms) for cluster in group]
        targets = [
            f"{target}[{', '.join(index([places[key[k]][axis] for key in keys]) for axis in range(len(places[0])))}]"
            for k in range(len(first.terms))
        ]
        body = _adding(targets, [sp.Add(*terms) for terms in first.terms.values()], {**names, **sources})
        rows = ", ".join(f"[{', '.join(map(str, row))}]" for row in zip(*columns, strict=True))
        # The name of a table is its content, which is known when all lines are written: it is put into them last.
        table = f"TABLE_{hashlib.sha256(rows.encode()).hexdigest()[:16]}"
        if columns:
            text.tables[table] = f"numpy.array([{rows}])"
        text.lines.append(f"for row in range({len(group)}):")
        text.lines.extend(f"    {line.replace('TABLE[row', f'{table}[row')}" for line in body)


def _adding(targets: Sequence[str], values: Expressions, names: Mapping[sp.Symbol, str]) -> Lines:
    """Return lines that add a value to each target."""
    lines = codegen.assignments(targets, values, names)
    starts = len(lines) - len(targets)
    return [line if i < starts else line.replace(" = ", " += ", 1) for i, line in enumerate(lines)]


PAIRS = ("damping",)
"""Functions that return a few numbers, as a tuple."""


def source(derivation: "Derivation", name: str, dtype: str) -> tuple[str, dict[str, str]] | None:
    """Return the source of a function of the problem and of the tables that it reads; None if it is not an expression of this problem."""
    rule = derivation.rule(name)
    if rule is None or name in PAIRS:
        written = derivation.source(name)
        return None if written is None else (written, {})
    arguments, values, shape = rule
    columns = shape[1] if len(shape) == 2 else 1
    places: list[tuple[int, ...]] = [divmod(k, columns) if len(shape) == 2 else (k,) for k in range(len(values))]
    entries = {place: value for place, value in zip(places, values, strict=True) if value != 0}
    text = added(name, arguments, entries, derivation.parameters)
    result = {0: "out[0]", 1: "out"}.get(len(shape), "out[0], out[1]" if name == "kinetic_increment" else "out")
    head = f"out = numpy.zeros({shape or 1}, dtype=numpy.{dtype})"
    return function(f"{name}({', '.join([*arguments, 'par'])})", head, *text.lines, f"return {result}"), text.tables
