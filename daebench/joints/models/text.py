"""A mechanism as the text of a Python file that a person can edit."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import MISSING, fields, is_dataclass
from typing import Any

import sympy as sp

from daebench.joints.mechanism import Mechanism
from daebench.joints.placing import Guided

WIDTH = 120
"""Longest line that is not broken."""

PLACED = {"first", "second", "at", "angle", "place", "point"}
"""Fields of parts that are written without their names."""

Parts = list[tuple[str, Any]]
"""Values with what is before each, such as "mass="."""

FILE = '''"""{summary}{about}"""

{imports}


def problem({arguments}) -> ConstrainedHamiltonian:
    """Return the mechanism in natural coordinates: points and directions of its bodies."""
{symbols}    return {mechanism}.problem()
'''


def text_of(mechanism: Mechanism, summary: str, about: Sequence[str]) -> str:
    """Return the text of a problem file: the first line of its docstring, sentences below it, and the mechanism."""
    # The arguments of the function have the names of the parameters, so that their symbols need others.
    symbols = {symbol: sp.Symbol(f"u{k + 1}") for k, symbol in enumerate(mechanism.parameters)}
    values = {letter: sp.Symbol(str(symbol)) for symbol, letter in symbols.items()}
    given = [(before, values if before == "parameters=" else value) for before, value in _parts(mechanism)]
    imports = ["import sympy as sp\n"] * bool(symbols)
    imports += [
        f"from daebench import ConstrainedHamiltonian\nfrom daebench.joints import {', '.join(sorted({'Mechanism', *_kinds(given)}))}"
    ]
    arguments = ["*", *(f"{name}: float = {value}" for name, value in mechanism.parameters.items())]
    names = ", ".join(map(str, symbols.values())), " ".join(map(str, symbols))
    function = "symbols" if len(symbols) > 1 else "Symbol"
    return FILE.format(
        summary=_plain(summary),
        about="".join(f"\n\n{_plain(sentence)}" for sentence in about) + "\n" * bool(about),
        imports="\n".join(imports),
        arguments="".join(f"\n    {argument}," for argument in arguments) + "\n" if symbols else "",
        symbols=f'    {names[0]} = sp.{function}("{names[1]}", real=True)\n' if symbols else "",
        mechanism=_broken("Mechanism(", given, ")", 4, symbols),
    )


def _plain(text: str) -> str:
    """Return a text as a docstring may have it."""
    return text.replace("\\", "\\\\").replace('"', "'")


def _text(value: Any, indent: int, symbols: Mapping[sp.Symbol, sp.Symbol]) -> str:
    """Return a value as Python writes it, in lines where one would be too long."""
    one = _line(value, symbols)
    if len(one) + indent <= WIDTH and not (isinstance(value, Mapping) and len(value) > 1 and indent < 16):
        return one
    start, parts, end = _opened(value)
    return _broken(start, parts, end, indent, symbols) if parts else one


def _broken(start: str, parts: Parts, end: str, indent: int, symbols: Mapping[sp.Symbol, sp.Symbol]) -> str:
    inside = " " * (indent + 4)
    lines = [f"{inside}{before}{_text(value, indent + 4, symbols)},\n" for before, value in parts]
    return f"{start}\n{''.join(lines)}{' ' * indent}{end}"


def _line(value: Any, symbols: Mapping[sp.Symbol, sp.Symbol]) -> str:
    start, parts, end = _opened(value)
    if start:
        return f"{start}{', '.join(before + _line(part, symbols) for before, part in parts)}{',' * (start == '(' and len(parts) == 1)}{end}"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    return str(value.xreplace(symbols)) if isinstance(value, sp.Basic) else str(value)


def _opened(value: Any) -> tuple[str, Parts, str]:
    """Return how a value begins, its parts, and how it ends; an empty beginning of one without parts."""
    if isinstance(value, Mapping):
        return "{", [(f"{_line(name, {})}: ", part) for name, part in value.items()], "}"
    if isinstance(value, list | tuple):
        brackets = "[]" if isinstance(value, list) else "()"
        return brackets[0], [("", part) for part in value], brackets[1]
    if is_dataclass(value):
        return f"{type(value).__name__}(", _parts(value), ")"
    return "", [], ""


def _parts(value: Any) -> Parts:
    """Return the fields of a part of a mechanism, without those that have their default."""
    if isinstance(value, Guided):
        return [("", value.place), *(("", way) for way in value.along)]
    parts: Parts = []
    for field in fields(value):
        part = getattr(value, field.name)
        default = field.default if field.default_factory is MISSING else field.default_factory()
        if field.name == "names":
            parts += [("", name) for name in part]
        elif default is MISSING or part != default:
            parts.append(("" if field.name in PLACED and not field.kw_only else f"{field.name}=", part))
    return parts


def _kinds(parts: Parts) -> Iterator[str]:
    """Yield the names of the classes of parts."""
    for _, value in parts:
        if is_dataclass(value):
            yield type(value).__name__
        yield from _kinds(_opened(value)[1])
