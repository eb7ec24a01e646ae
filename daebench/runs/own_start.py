"""A start of one's own beside a case, and the text that names it wherever a case is named, ``horizontal[q0=0.6,-0.8;p0=0,0]``."""

import hashlib
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, TypedDict, cast

from daebench.errors import BadInput
from daebench.runs.texts import numbers

Values = Sequence[float] | Mapping[str, float | Sequence[float]]
"""All numbers of a vector in order, or those of some points, directions and spins of a mechanism by name."""

PROJECT = "project"

MOST = 64
"""Largest number of numbers in a text: more are named by their digest, from which no start can be made again."""

PART = r"(?:[qpvy]0=[^;]*|project|[0-9a-f]{8})"
BRACKETS = re.compile(rf"(?P<case>.*?)\[(?P<start>{PART}(?:;{PART})*)\]", re.DOTALL)
TOP = re.compile(r",(?![^(]*\))")
"""A comma outside of parentheses."""


class OwnStart(TypedDict, total=False):
    """Initial values in place of those of a case, by keyword; every study takes them as ``**start``.

    Numbers are in the order of the positions, or by name: in a mechanism ``q0={"B": (0.3, 0.4)}`` places points and directions that have
    unknowns of their own, and ``v0={"B": (0, 1), "spin(arm)": 2}`` gives velocities of points and spins of bodies. What is not named stays
    as in the case, velocities as far as the joints allow.
    """

    q0: Values | None
    """Positions of a constrained problem, shape(d,)."""
    p0: Sequence[float] | None
    """Momenta, shape(d,)."""
    v0: Values | None
    """Velocities q', shape(d,), in place of momenta."""
    y0: Sequence[float] | None
    """State of a Poisson system, shape(n,)."""
    project: bool
    """Whether the start is moved to the nearest one on the manifold, positions first."""


NAMES = tuple(name for name in OwnStart.__annotations__ if name != PROJECT)
"""Vectors of a start."""

BY_NAME = ("q0", "v0")
"""Those that may be given by the names of points."""


def given(start: OwnStart) -> dict[str, Any]:
    """Return the vectors of a start that are given."""
    return {name: values for name in NAMES if (values := start.get(name)) is not None}


def joined(start: OwnStart, over: OwnStart) -> OwnStart:
    """Return a start with what another one gives in place of its own."""
    return cast(OwnStart, start | given(over) | ({PROJECT: True} if over.get(PROJECT) else {}))


def parted(settings: Mapping[str, Any]) -> tuple[OwnStart, dict[str, Any]]:
    """Return the start among keywords, and the other keywords."""
    start = {name: value for name, value in settings.items() if name in OwnStart.__annotations__}
    return cast(OwnStart, start), {name: value for name, value in settings.items() if name not in start}


def values_in(option: str, text: str) -> Values:
    """Return the numbers of a text, 0.6,-0.8, or those by name, B=(0.3, 0.4), spin(arm)=2."""
    if "=" not in text:
        return numbers(option, text) or []
    values: dict[str, float | list[float]] = {}
    for part in TOP.split(text):
        name, equals, value = (x.strip() for x in part.partition("="))
        if not equals or not name or name in values:
            raise BadInput(
                f"{option} {text!r} must be numbers, or each name once with its numbers, for example B=(0.3, 0.4), C=(1, 0).",
                "start-text-malformed",
            )
        entries = numbers(f"{option} {name}", value.strip("()")) or []
        values[name] = entries if value.startswith("(") else entries[0]
    return values


def written(case: str, vectors: Mapping[str, Any], *, project: bool) -> str:
    """Return the name of a start: that of the case, with what replaces its initial values."""
    parts = [f"{name}={_text(values)}" for name, values in vectors.items()]
    if sum(text.count(",") + 1 for text in parts) > MOST:
        parts = [hashlib.sha256(";".join(parts).encode()).hexdigest()[:8]]
    return f"{case}[{';'.join([*parts, *[PROJECT] * project])}]"


def base(case: str) -> str:
    """Return the name of the case that a start stands beside."""
    match = BRACKETS.fullmatch(case)
    return match["case"] if match else case


def read(case: str) -> tuple[str, OwnStart]:
    """Return the case and the start of a name; the start is empty in the name of a case."""
    match = BRACKETS.fullmatch(case)
    if not match:
        return case, OwnStart()
    start: dict[str, Any] = {}
    for part in match["start"].split(";"):
        name, equals, text = part.partition("=")
        if not equals and name != PROJECT:
            raise BadInput(
                f"the start {name} of {case} is of more than {MOST} numbers; give them again, or declare a case.", "start-too-long-to-read"
            )
        start[name] = values_in(name, text) if equals else True
    return match["case"], cast(OwnStart, start)


def _text(values: Any) -> str:
    if isinstance(values, Mapping):
        return ",".join(f"{name}={f'({_text(x)})' if isinstance(x, Iterable) else _text([x])}" for name, x in values.items())
    return ",".join(repr(float(x)).removesuffix(".0") for x in values)
