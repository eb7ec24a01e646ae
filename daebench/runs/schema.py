"""Fields of a file from elsewhere: type, range and length of each, declared once; the first that is wrong is named."""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol

SHOWN = 40
"""Most characters of a wrong value that a sentence quotes."""

LARGEST = 1e300
"""Largest modulus of a number: sums and products of a few stay finite."""


class WrongField(ValueError):
    """A field with a wrong value; the text names the field."""


class Kind(Protocol):
    """Kind of a field."""

    def read(self, value: Any, place: str) -> Any:
        """Return the value of a field; raise :class:`WrongField` with its place if it is something else."""


def shown(value: Any) -> str:
    """Return a value in a few words, whatever it is."""
    if isinstance(value, str):
        return repr(value) if len(value) <= SHOWN else f"{value[:SHOWN]!r}... ({len(value)} characters)"
    if isinstance(value, Mapping):
        return f"a mapping of {len(value)} entries"
    if isinstance(value, list | tuple):
        return f"a list of {len(value)} entries"
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) >= 10**SHOWN:
        return f"a whole number of {value.bit_length()} bits"
    return "nothing" if value is None else repr(value)[:SHOWN]


def wrong(place: str, value: Any, words: str) -> WrongField:
    """Return the error for a value in the place of something else."""
    return WrongField(f"{place} is {shown(value)}, and must be {words}")


@dataclass(frozen=True)
class Text:
    """A text of limited length, without characters that no name has; of some forms or words only, if these are given."""

    longest: int = 200
    least: int = 0
    words: tuple[str, ...] = ()
    form: str = ""
    told: str = ""

    def read(self, value: Any, place: str) -> str:
        """Return the text."""
        fits = isinstance(value, str) and self.least <= len(value) <= self.longest and "\0" not in value
        # ASCII, because \d and \w would take digits and letters of other scripts.
        if not fits or (self.words and value not in self.words) or (self.form and not re.fullmatch(self.form, value, re.ASCII)):
            raise wrong(place, value, self.told or self._told)
        return str(value)

    @property
    def _told(self) -> str:
        if self.words:
            return f"one of {', '.join(map(repr, self.words))}"
        return f"a text of {self.least} to {self.longest} characters"


@dataclass(frozen=True)
class Such:
    """A value that passes a test, which ``words`` has in words."""

    fits: Callable[[Any], bool]
    words: str

    def read(self, value: Any, place: str) -> Any:
        """Return the value."""
        if not self.fits(value):
            raise wrong(place, value, self.words)
        return value


@dataclass(frozen=True)
class Flag:
    """True or false."""

    def read(self, value: Any, place: str) -> bool:
        """Return the flag."""
        if not isinstance(value, bool):
            raise wrong(place, value, "true or false")
        return value


@dataclass(frozen=True)
class Whole:
    """A whole number in a range."""

    least: int = 0
    most: int = 2**53

    def read(self, value: Any, place: str) -> int:
        """Return the number."""
        # True is an int in Python, but no number of a file.
        if not isinstance(value, int) or isinstance(value, bool) or not self.least <= value <= self.most:
            raise wrong(place, value, f"a whole number from {self.least} to {self.most}")
        return value


@dataclass(frozen=True)
class Number:
    """A finite number in a range; if ``above`` is true, the least itself is none."""

    least: float = -LARGEST
    most: float = LARGEST
    above: bool = False

    def read(self, value: Any, place: str) -> float:
        """Return the number as it is: a whole one stays whole."""
        fits = isinstance(value, int | float) and not isinstance(value, bool) and self.least <= value <= self.most
        if not fits or (self.above and value == self.least):
            raise wrong(place, value, f"a finite number {'above' if self.above else 'of at least'} {self.least:g}")
        number: float = value
        return number

    def holds_all(self, values: Sequence[Any]) -> bool:
        """Return whether all of many values are surely such numbers."""
        # Exactly floats, whose minimum and maximum are fast: all others, true and 1 among them, are read one by one.
        if not all(type(value) is float for value in values):
            return False
        least, most = min(values, default=self.most), max(values, default=self.most)
        return self.least <= least <= most <= self.most and not (self.above and least == self.least) and not any(map(math.isnan, values))


POSITIVE = Number(0.0, above=True)
NOT_NEGATIVE = Number(0.0)

SECONDS = Number(0.0, 1e9)
"""A time that something took, s: thirty years at most."""

DIGEST = Text(form="[0-9a-f]{64}", told="a SHA-256")


@dataclass(frozen=True)
class Nothing:
    """Nothing: null."""

    def read(self, value: Any, place: str) -> None:
        """Return nothing."""
        if value is not None:
            raise wrong(place, value, "nothing")


@dataclass(frozen=True)
class Either:
    """One of several kinds; the sentence for a value that is none of them is in ``told``."""

    kinds: tuple[Kind, ...]
    told: str

    def read(self, value: Any, place: str) -> Any:
        """Return the value as read by the first kind that fits."""
        for kind in self.kinds:
            try:
                return kind.read(value, place)
            except WrongField:
                continue
        raise wrong(place, value, self.told)


def maybe(kind: Kind, told: str) -> Either:
    """Return a kind, or nothing."""
    return Either((Nothing(), kind), f"nothing, or {told}")


@dataclass(frozen=True)
class Items:
    """A list of entries of one kind, of a length in a range."""

    of: Kind
    least: int = 0
    most: int = 1000

    def read(self, value: Any, place: str) -> list[Any]:
        """Return the entries."""
        if not isinstance(value, list | tuple) or not self.least <= len(value) <= self.most:
            length = f"{self.least}" if self.least == self.most else f"{self.least} to {self.most}"
            raise wrong(place, value, f"a list of {length} entries")
        if isinstance(self.of, Number) and self.of.holds_all(value):
            return list(value)
        return [self.of.read(entry, f"{place}[{k}]") for k, entry in enumerate(value)]


@dataclass(frozen=True)
class Pair:
    """A list of two entries, each of its kind."""

    first: Kind
    second: Kind

    def read(self, value: Any, place: str) -> tuple[Any, Any]:
        """Return the entries."""
        if not isinstance(value, list | tuple) or len(value) != 2:
            raise wrong(place, value, "a list of 2 entries")
        return self.first.read(value[0], f"{place}[0]"), self.second.read(value[1], f"{place}[1]")


@dataclass(frozen=True)
class Named:
    """A mapping of names to values of one kind; some names have to be there."""

    of: Kind
    names: Kind = field(default_factory=Text)
    most: int = 1000
    required: tuple[str, ...] = ()

    def read(self, value: Any, place: str) -> dict[str, Any]:
        """Return the mapping."""
        if not isinstance(value, Mapping) or len(value) > self.most:
            raise wrong(place, value, f"a mapping of at most {self.most} entries")
        if lacking := [name for name in self.required if name not in value]:
            raise WrongField(f"{place} has no {lacking[0]}")
        return {
            self.names.read(name, f"a name in {place}"): self.of.read(entry, f"{place}.{name[:SHOWN]}") for name, entry in value.items()
        }


@dataclass(frozen=True)
class Fields:
    """A mapping with the given fields, each of its kind; those of ``optional`` may be left out, and others only if ``open`` is true."""

    required: Mapping[str, Kind]
    optional: Mapping[str, Kind] = field(default_factory=dict)
    open: bool = False

    def read(self, value: Any, place: str = "") -> dict[str, Any]:
        """Return the fields that are there."""
        if not isinstance(value, Mapping):
            raise wrong(place or "the whole", value, f"a mapping with {', '.join(self.required)}")
        if lacking := [name for name in self.required if name not in value]:
            raise WrongField(f"{place or 'it'} has no {lacking[0]}")
        if not self.open and (others := [name for name in value if name not in self._known]):
            raise WrongField(f"{place or 'it'} has {shown(others[0])}, which is no field of it")
        before = f"{place}." if place else ""
        return {name: self._known[name].read(entry, f"{before}{name}") if name in self._known else entry for name, entry in value.items()}

    @cached_property
    def _known(self) -> dict[str, Kind]:
        return {**self.required, **self.optional}


def numbers(rows: int, columns: int | None = None, of: Kind | None = None) -> Items:
    """Return the kind of a list of ``rows`` numbers, or of rows of ``columns`` numbers."""
    number = Number() if of is None else of
    return Items(number if columns is None else Items(number, columns, columns), rows, rows)
