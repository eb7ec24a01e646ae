"""Values at the nodes of a chain that are computed only inside a loop over nodes, and scalars as source text."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partialmethod
from itertools import count
from typing import Any

from daebench.compiler.syntax import Lines
from daebench.compiler.values import Element
from daebench.errors import InvalidProblem

_NUMBERS = count()

At = Callable[["Field", int], str]
"""Source of the tuple of a field's entries at the node that is this many places from the present one."""


Write = Callable[[At, str], Sequence[str] | str]


class Scalar:
    """A number in the generated source."""

    of_any_form = True
    """It may stand for a tuple too."""

    def __init__(self, text: str, late: bool = False) -> None:
        self.text, self.late = text, late

    def _with(self, pattern: str, other: Any) -> "Scalar":
        if isinstance(other, Element):
            return NotImplemented  # type: ignore[no-any-return]
        return Scalar(pattern.format(self.text, say(other)), self.late or is_late(other))

    __lt__ = partialmethod(_with, "({0} < {1})")
    __gt__ = partialmethod(_with, "({0} > {1})")
    __add__ = partialmethod(_with, "({0} + {1})")
    __sub__ = partialmethod(_with, "({0} - {1})")
    __rsub__ = partialmethod(_with, "({1} - {0})")
    __mul__ = partialmethod(_with, "({0} * {1})")
    __rmul__ = partialmethod(_with, "({1} * {0})")
    __truediv__ = partialmethod(_with, "({0} / {1})")
    __rtruediv__ = partialmethod(_with, "({1} / {0})")

    def __radd__(self, other: Any) -> "Scalar":
        return self if isinstance(other, int) and other == 0 else self._with("({1} + {0})", other)

    def __pow__(self, n: int) -> "Scalar":
        return self * self if n == 2 else self._with("({0} ** {1})", n)

    def __neg__(self) -> "Scalar":
        return Scalar(f"(-{self.text})", self.late)

    def __iter__(self) -> Iterator["Scalar"]:
        raise InvalidProblem(
            "a scheme takes a number apart as a tuple, whose length is not known for long chains.", "chain-tuple-of-number"
        )

    def __getitem__(self, index: int) -> "Scalar":
        return Scalar(f"{self.text}[{index}]", self.late)


def say(x: Any) -> str:
    """Return the source of a number, a scalar, or a tuple of them."""
    if isinstance(x, Scalar):
        return x.text
    if isinstance(x, tuple):
        return "(" + "".join(f"{say(part)}, " for part in x) + ")"
    return repr(x)


def is_late(x: Any) -> bool:
    """Whether any part of a number or a tuple of them is known only after a loop."""
    return any(map(is_late, x)) if isinstance(x, tuple) else isinstance(x, Scalar) and x.late


def applied(name: str, *arguments: Any) -> Scalar:
    """Return the call of a function of scalars."""
    return Scalar(f"{name}({', '.join(map(say, arguments))})", is_late(arguments))


def weight(w: Any) -> str:
    """Return the source of the factor of a field."""
    if is_late(w):
        raise InvalidProblem(
            "a scheme scales a vector by a number computed from a whole vector, which is not possible for long chains.",
            "chain-scale-by-vector-value",
        )
    return say(w)


@dataclass(frozen=True, eq=False, kw_only=True)
class Field:
    """A tuple of numbers at each node."""

    kind: str
    """"d" for positions and momenta, "m" for multipliers, "G" for entries of Jacobians."""
    width: int
    """Number of entries at a node."""
    stage: int
    """Number of the last linear solve or iteration that it depends on; 0 if none."""
    needs: Sequence[tuple["Field", int]]
    """Fields that it is computed from, each with the place of the node, counted from the present one."""
    write: Write
    """``write(at, k)`` returns the sources of the entries at node k, where k is source text too, or one source of them all."""
    ghost: Sequence[str]
    """Entries at the position of node -1."""
    zero: bool = False
    """Whether all entries are zero."""
    number: int = field(default_factory=lambda: next(_NUMBERS))
    """Number in order of creation; fields that others are computed from have smaller numbers."""


Term = tuple[str, Sequence[tuple[Field, int, int]]]
"""A form, and the entries in it: each of a field, at a place counted from the present node, with an index."""


def written(at: At, term: Term) -> str:
    """Return the source of a term."""
    form, entries = term
    return form.format(*(f"{at(part, place)}[{i}]" for part, place, i in entries))


def selected(test: Any, one: Callable[[], Any], other: Callable[[], Any]) -> Any:
    """Return ``one()`` or ``other()``; if the test is a number in the generated source, a field of the entries of either."""
    if not isinstance(test, Scalar):
        return one() if test else other()
    x, y, condition = one(), other(), weight(test)
    if not isinstance(x, Field) or not isinstance(y, Field):
        raise InvalidProblem("a scheme chooses between values that are not vectors of the chain.", "chain-choice-of-non-vectors")

    def write(at: At, k: str) -> Lines:
        return [f"({at(x, 0)}[{i}] if {condition} else {at(y, 0)}[{i}])" for i in range(x.width)]

    return computed(x.kind, x.width, [(x, 0), (y, 0)], write)


def zeros(width: int) -> Lines:
    """Return sources of this many zeros."""
    return ["ZERO"] * width


def computed(kind: str, width: int, needs: Sequence[tuple[Field, int]], write: Write, ghost: Sequence[str] = ()) -> Field:
    """Return a field computed from others."""
    stage = max((part.stage for part, _ in needs), default=0)
    return Field(kind=kind, width=width, stage=stage, needs=needs, write=write, ghost=ghost or zeros(width))


def stored(kind: str, width: int, entry: str, stage: int, ghost: Sequence[str] = (), missing: int = 0) -> Field:
    """Return the field of numbers in an array."""

    def write(at: At, k: str) -> Lines:
        texts = [entry.format(k=f"({k})", i=i) for i in range(width)]
        return [f"({text} if {k} > 0 else ZERO)" if i < missing else text for i, text in enumerate(texts)]

    return Field(kind=kind, width=width, stage=stage, needs=(), write=write, ghost=ghost or zeros(width))


def nothing(kind: str, width: int) -> Field:
    """Return the field of zeros."""
    still = zeros(width)
    return Field(kind=kind, width=width, stage=0, needs=(), write=lambda at, k: still, ghost=still, zero=True)


def combined(w: Any, x: Field, y: Field | None) -> Field:
    """Return w x + y, or w x."""
    if not isinstance(x, Field) or not isinstance(y, Field | None):
        raise InvalidProblem("a scheme adds a value that is not a vector of the chain.", "chain-sum-with-non-vector")
    if x.zero or (isinstance(w, float) and w == 0.0):
        return y or nothing(x.kind, x.width)
    y = None if y is None or y.zero else y
    factor = weight(w)
    term = {"1.0": "{0}", "-1.0": "-{0}"}.get(factor, f"{factor} * {{0}}")
    needs = [(x, 0)] if y is None else [(x, 0), (y, 0)]

    def entries(of_x: Sequence[str], of_y: Sequence[str]) -> Lines:
        terms = [term.format(entry) for entry in of_x]
        return terms if y is None else [f"{left} + {right}" for left, right in zip(terms, of_y, strict=True)]

    def write(at: At, k: str) -> Lines:
        names = [[f"{at(part, 0)}[{i}]" for i in range(x.width)] for part, _ in needs]
        return entries(names[0], names[-1])

    still = zeros(x.width)
    quiet = list(x.ghost) == still and (y is None or list(y.ghost) == still)
    ghost = still if quiet else entries([f"({entry})" for entry in x.ghost], list(y.ghost) if y else still)
    return computed(x.kind, x.width, needs, write, ghost)
