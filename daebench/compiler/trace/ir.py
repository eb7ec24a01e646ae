"""Operations on numbers in blocks with structured control flow: what tracing records, and what transformations and printers read.

A block is a list. Its entries are values, each one operation, and nodes:

- :class:`If` has a test, two blocks, and results, which are pairs of values at the ends of the blocks;
- :class:`Region` is a block that is left by a :class:`Leave`, which ends a block and gives the results of the region;
- :class:`Loop` is an endless block with parameters that pass from one turn to the next; it is left by leaving a region around it;
- :class:`Call` calls another :class:`Function`.

There is no other control flow: ``return`` in a loop, ``break`` and the end of ``for`` are all departures from a region.
"""

from collections.abc import Sequence
from typing import Any

FLOAT64, FLOAT32, INTEGER, TRUTH, POINTER = "d", "s", "i", "b", "p"
"""Kinds of values. Vectors have the kind of their entries, and their number: d4 is a vector of four doubles."""

ORDER = (TRUTH, INTEGER, FLOAT32, FLOAT64)
"""Kinds of numbers from the narrowest to the widest."""

FLOATS = (FLOAT64, FLOAT32)


class NeedsKnown(TypeError):
    """A number that is only known at run time stands where a known one is needed."""


def _operators(method: str, *op: str) -> tuple[Any, Any]:
    """Return an operator of values, which a method of the program records, and the same with its operands exchanged."""
    return (
        lambda self, other: getattr(self.code, method)(*op, self, other),
        lambda self, other: getattr(self.code, method)(*op, other, self),
    )


class Number:
    """A number that is recorded, of any type."""

    __slots__ = ()

    def __bool__(self) -> bool:
        raise TypeError("a number that is only known at run time stands where none can be tested")

    def __pos__(self) -> Any:
        return self


class Value(Number):
    """One operation, and its result. Python's operators on it record further operations in its program."""

    __slots__ = ("args", "code", "kind", "op")

    def __init__(self, code: Any, op: str, kind: str, args: tuple[Any, ...] = ()) -> None:
        self.code, self.op, self.kind, self.args = code, op, kind, args

    __add__, __radd__ = _operators("arithmetic", "add")
    __sub__, __rsub__ = _operators("arithmetic", "sub")
    __mul__, __rmul__ = _operators("arithmetic", "mul")
    __truediv__, __rtruediv__ = _operators("quotient")
    __floordiv__ = _operators("whole", "floordiv")[0]
    __mod__ = _operators("whole", "mod")[0]
    __lt__ = _operators("compare", "lt")[0]
    __le__ = _operators("compare", "le")[0]
    __gt__ = _operators("compare", "gt")[0]
    __ge__ = _operators("compare", "ge")[0]
    __eq__ = _operators("compare", "eq")[0]
    __ne__ = _operators("compare", "ne")[0]
    __pow__, __rpow__ = _operators("power")
    __and__, __rand__ = _operators("both")
    __or__, __ror__ = _operators("either")
    __hash__ = object.__hash__  # which a class with an __eq__ of its own does not inherit

    def __neg__(self) -> Any:
        return self.code.emit("neg", self.kind, (self,))

    def __index__(self) -> int:
        raise NeedsKnown("a number that is only known at run time stands where a known one is needed")

    def __abs__(self) -> Any:
        return self.code.emit("abs", self.kind, (self,)) if self.kind[0] in FLOATS else self.code.select(self < 0, -self, self)

    @property
    def real(self) -> "Value":
        """The number itself."""
        return self


Values = Sequence[Value]


class If:
    """A branch; ``falls`` tells which of the blocks go on behind it, and ``yields`` are the values of the results at their ends."""

    __slots__ = ("blocks", "falls", "results", "test", "yields")

    def __init__(self, test: Value) -> None:
        self.test, self.falls = test, [True, True]
        self.blocks: tuple[list[Any], list[Any]] = ([], [])
        self.results: list[Value] = []
        self.yields: tuple[list[Value], list[Value]] = ([], [])


class Region:
    """A block that is left by its ``leaves``."""

    __slots__ = ("block", "leaves", "results")

    def __init__(self) -> None:
        self.block: list[Any] = []
        self.leaves: list[Leave] = []
        self.results: list[Value] = []


class Loop:
    """An endless block; ``nexts`` are the values of its parameters in the next turn, None if no turn ever ends."""

    __slots__ = ("block", "initial", "nexts", "parameters")

    def __init__(self) -> None:
        self.block: list[Any] = []
        self.parameters: list[Value] = []
        self.initial: list[Value] = []
        self.nexts: list[Value] | None = []


class Leave:
    """The end of a block that leaves a region with these ``values``; ``structure`` is what they were before they were put side by side."""

    __slots__ = ("block", "region", "structure", "values")

    def __init__(self, region: Region, structure: Any, block: list[Any]) -> None:
        self.region, self.structure, self.block = region, structure, block
        self.values: list[Value] = []


class Call:
    """A call of a function."""

    __slots__ = ("args", "function", "results")

    def __init__(self, code: Any, function: "Function", args: tuple[Value, ...]) -> None:
        self.function, self.args = function, args
        self.results = [Value(code, "get", value.kind, (self, k)) for k, value in enumerate(function.results)]


class Function:
    """A function with parameters, a block, and results, which are values at its end."""

    __slots__ = ("block", "name", "parameters", "results")

    def __init__(self, name: str) -> None:
        self.name = name
        self.block: list[Any] = []
        self.parameters: list[Value] = []
        self.results: list[Value] = []


def kind_of(x: Any) -> str:
    """Return the kind of a value or of a number that is known while code is made."""
    if isinstance(x, Value):
        return x.kind
    return TRUTH if isinstance(x, bool) else INTEGER if isinstance(x, int) else FLOAT64


def differs(*numbers: Any) -> bool:
    """Return whether one of several numbers is a vector."""
    return any(len(kind_of(x)) > 1 for x in numbers)


def entries_of(x: Value) -> list[Value]:
    """Return the numbers of a vector, or a number alone."""
    return [x.code.emit("vget", x.kind[0], (x, k)) for k in range(int(x.kind[1:]))] if len(x.kind) > 1 else [x]


def common(*kinds: str) -> str:
    """Return the kind of the sum of numbers of these kinds: whole numbers with those of single precision give double precision."""
    if POINTER in kinds:
        return POINTER
    lengths = {kind[1:] for kind in kinds} - {""}
    if len(lengths) > 1:
        raise TypeError("vectors of different lengths meet")
    entries = [kind[0] for kind in kinds]
    widest = FLOAT64 if FLOAT32 in entries and INTEGER in entries else max(entries, key=ORDER.index)
    return widest + "".join(lengths)


def met(*numbers: Any) -> str:
    """Return the kind of an operation on numbers; known ones are of single precision where the others are."""
    kinds = [kind_of(x) for x in numbers]
    unknown = [kind for kind, x in zip(kinds, numbers, strict=True) if isinstance(x, Value)]
    return common(*(unknown if unknown and all(kind[0] == FLOAT32 for kind in unknown) else kinds))


def real(kind: str) -> str:
    """Return a kind, or that of double precision in place of that of whole numbers and truths."""
    return kind if kind[0] in FLOATS else FLOAT64 + kind[1:]


def counting(kind: str) -> str:
    """Return a kind, or that of whole numbers in place of that of truths."""
    return INTEGER + kind[1:] if kind[0] == TRUTH else kind


def inner(node: Any) -> Sequence[list[Any]]:
    """Return the blocks in a node."""
    return node.blocks if type(node) is If else (node.block,) if type(node) in (Region, Loop) else ()


def flows(node: Any) -> tuple[Values, Sequence[Values]]:
    """Return the results of a branch or region, or the parameters of a loop, and the rows of values that they may get."""
    if type(node) is Loop:
        return node.parameters, [node.initial] if node.nexts is None else [node.initial, node.nexts]
    return node.results, node.yields if type(node) is If else [leave.values for leave in node.leaves]
