"""The exact text of definitions, by which they are told apart: the same for equal expressions, to the last digit of their numbers."""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from itertools import combinations
from typing import Any

import sympy as sp
from sympy.printing.repr import ReprPrinter

ASSUMPTIONS = ("integer", "real", "positive", "nonnegative", "negative", "nonpositive", "nonzero")
"""Words with which files declare symbols; others follow from them."""


def exact(part: Any) -> str:
    """Return the exact text of an expression, or of a list of them."""
    return str(_Printer().doprint(sp.sympify(part)))


class _Printer(ReprPrinter):  # type: ignore[misc]
    """Prints symbols that are equal in the same way: SymPy prints how the first of them was declared in this process."""

    def _print_Symbol(self, symbol: sp.Symbol) -> str:
        dummy = f", dummy_index={symbol.dummy_index}" if symbol.is_Dummy else ""
        return f"{type(symbol).__name__}({symbol.name!r}{_declared(frozenset(symbol.assumptions0.items()))}{dummy})"

    _print_Dummy = _print_Symbol


@lru_cache(1000)
def _declared(known: frozenset[tuple[str, bool]]) -> str:
    """Return all that is known of a symbol in the fewest words from which it follows: real=True for real=True, finite=True."""
    words = [word for word in ASSUMPTIONS if (word, True) in known]
    choices = (dict.fromkeys(choice, True) for size in range(len(words) + 1) for choice in combinations(words, size))
    # From few to many words, so that the first set from which all follows is the one that a file would write.
    declared = next((choice for choice in choices if sp.Symbol("x", **choice).assumptions0.items() == known), dict(sorted(known)))
    return "".join(f", {name}={value}" for name, value in declared.items())


def mathematics(parts: Sequence[Any], names: Any, cases: Mapping[str, Sequence[Any]], parameters: Mapping[sp.Symbol, float]) -> str:
    """Return the exact text of a definition, which does not depend on how its file is written."""
    numbers = [(exact(symbol), float(value)) for symbol, value in parameters.items()]
    return repr(([*map(_texts, parts)], names, [(name, [*map(_texts, case)]) for name, case in cases.items()], numbers))


def case_texts(cases: Mapping[str, Any]) -> list[tuple[Any, ...]]:
    """Return the cases of a constrained definition as tuples for a fingerprint: name, exact q and p, parameters, about, on_singular."""
    starts = {name: (to_the_last_digit(case.q), to_the_last_digit(case.p)) for name, case in cases.items()}
    return [(name, *starts[name], dict(case.parameters), case.about, case.on_singular) for name, case in cases.items()]


def to_the_last_digit(values: Sequence[Any]) -> Sequence[Any]:
    """Return the values of a case, with the exact text of those whose numbers SymPy would print with 15 digits."""
    # Only these: other texts stay as they always were, so that what was stored under them is found again.
    rounded = [isinstance(value, sp.Basic) and value.has(sp.Float) for value in values]
    return [exact(value) if has_float else value for value, has_float in zip(values, rounded, strict=True)] if any(rounded) else values


def _texts(part: Any) -> Any:
    """Return an expression as text, and a sequence as a list of texts, whatever its type."""
    if isinstance(part, str):
        return part
    if isinstance(part, Mapping):
        return sorted((str(name), float(value)) for name, value in part.items())
    return [*map(_texts, part)] if isinstance(part, Sequence | sp.Tuple) else exact(part)
