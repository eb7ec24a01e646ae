"""Values as functions hand them around, nested tuples of numbers and arrays: taken apart into numbers and pointers, and put together."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

from daebench.compiler.shapes import wider
from daebench.compiler.trace.arrays import Array
from daebench.compiler.trace.code import Code
from daebench.compiler.trace.complex import Complex, Pair, as_complex
from daebench.compiler.trace.dual import Dual
from daebench.compiler.trace.ir import INTEGER, Loop, Value, common, kind_of
from daebench.compiler.trace.pivots import Share
from daebench.compiler.values import Element, flat, mapped


def parts_of(x: Any) -> list[Any]:
    """Return the numbers and pointers of a structure, side by side; lengths of arrays that are known belong to its pattern."""
    return [part for number in flat(x) for part in _parts_of_number(number)]


def _parts_of_number(x: Any) -> Sequence[Any]:
    if isinstance(x, Pair):
        return x.parts
    if isinstance(x, Share):
        return [x.first, *x.above, *x.below]
    if isinstance(x, Array):
        return [x.pointer, *(length for length in (*x.shape, *x.strides) if isinstance(length, Value))]
    return [] if x is None else [x]


def rebuilt(x: Any, parts: Iterator[Any]) -> Any:
    """Return a structure like x of other numbers and pointers."""

    def number(x: Any) -> Any:
        if isinstance(x, Pair):
            return type(x)(x.code, next(parts), next(parts))  # type: ignore[call-arg]
        if isinstance(x, Share):
            return Share(x.code, next(parts), [next(parts) for _ in x.above], [next(parts) for _ in x.below])
        if isinstance(x, Array):
            pointer = next(parts)
            shape, strides = ([next(parts) if isinstance(n, Value) else n for n in row] for row in (x.shape, x.strides))
            return Array(pointer, x.kind, shape, strides, x.known)
        return None if x is None else next(parts)

    return mapped(number, x)


def pattern_of(x: Any) -> Any:
    """Return the pattern of a structure: equal for two structures whose parts can stand for each other."""
    if isinstance(x, tuple):
        return tuple([pattern_of(entry) for entry in x])
    if isinstance(x, Element):
        return x.kind, pattern_of(x.held)
    if isinstance(x, Complex):
        return "complex"
    if isinstance(x, Dual):
        return x.kind
    if isinstance(x, Share):
        return f"share of {len(x.above)}"
    if isinstance(x, Array):
        return x.kind, *(tuple(None if isinstance(length, Value) else length for length in row) for row in (x.shape, x.strides))
    return x if x is None or isinstance(x, str) else "number"


def sized(code: Code, x: Any) -> Any:
    """Return a structure whose arrays have lengths that may differ from those of others."""

    def number(x: Any) -> Any:
        if not isinstance(x, Array):
            return x
        return Array(x.pointer, x.kind, *([code.as_kind(length, INTEGER) for length in row] for row in (x.shape, x.strides)))

    return mapped(number, x)


def promoted(code: Code, x: Any, like: Any) -> Any:
    """Return a structure whose numbers are complex, have derivatives, or are divided, where those of another are."""
    if isinstance(like, Element):
        element = x if isinstance(x, Element) else Element(like.algebra, like.kind, x)
        same = element.kind == like.kind
        if not same and wider(element.kind) != wider(like.kind):
            return x
        return Element(like.algebra, like.kind if same else wider(like.kind), promoted(code, element.held, like.held))
    if isinstance(x, tuple) and isinstance(like, tuple) and len(x) == len(like):
        return tuple([promoted(code, *both) for both in zip(x, like, strict=True)])
    if isinstance(x, Share) and pattern_of(x) != pattern_of(like):
        return x.value
    if pattern_of(x) != "number" or not isinstance(like, Complex | Dual):
        return x
    return as_complex(code, x) if isinstance(like, Complex) else like.of(x)


def fill(array: Array, row: Any, x: Any) -> None:
    """Write the numbers of nested tuples into a row of an array."""
    for k, number in enumerate(parts_of(x)):
        array[row, k] = number


def arrays_of(x: Any) -> list[Array]:
    """Return the arrays of a structure."""
    return [array for array in flat(x) if isinstance(array, Array)]


def unset(code: Code, x: Any) -> Any:
    """Return a structure like x whose parts are zero, for a name that has no value yet."""
    return rebuilt(x, (code.constant(0, kind_of(part)) for part in parts_of(x)))


def same(x: Any, y: Any) -> bool:
    """Return whether two parts are one value, or one known number."""
    if x is y:
        return True
    if isinstance(x, Value) or isinstance(y, Value) or type(x) is not type(y):
        return False
    return repr(x) == repr(y)  # texts tell 0.0 from -0.0, and that of NaN equals itself


def unchanged(loop: Loop) -> Mapping[Value, Value]:
    """Return the parameters of a loop that no turn changes, with their values."""
    if loop.nexts is None:
        return dict(zip(loop.parameters, loop.initial, strict=True))
    return {p: first for p, first, then in zip(loop.parameters, loop.initial, loop.nexts, strict=True) if then is p or same(then, first)}


End = tuple[list[Any], bool]
"""The end of a block, and whether it ends with a departure."""


class Mismatch(TypeError):
    """Structures that meet are of different patterns."""


def united(code: Code, structures: Sequence[Any], ends: Sequence[End], results: list[Value], given: Sequence[list[Any]]) -> Any:
    """Return the structure of a value that comes from several blocks."""
    for like in structures if any(pattern_of(x) != pattern_of(structures[0]) for x in structures[1:]) else ():
        structures = [at_end(code, end, partial(promoted, code, x, like)) for x, end in zip(structures, ends, strict=True)]
    if any(pattern_of(x) != pattern_of(structures[0]) for x in structures[1:]):
        structures = [sized(code, x) for x in structures]
        if any(pattern_of(x) != pattern_of(structures[0]) for x in structures[1:]):
            raise Mismatch("a value is of one form where one branch was taken, and of another where another was")
    parts = []
    for column in zip(*map(parts_of, structures), strict=True):
        if all(same(column[0], x) for x in column[1:]):
            parts.append(column[0])
            continue
        kind = common(*map(kind_of, column))
        result = Value(code, "result", kind)
        results.append(result)
        parts.append(result)
        for x, end, values in zip(column, ends, given, strict=True):
            values.append(converted(code, x, kind, end))
    return rebuilt(structures[0], iter(parts))


def at_end(code: Code, end: End, make: Callable[[], Any]) -> Any:
    """Return the value of a function, whose operations are recorded at the end of a block."""
    block, left = end
    operations: list[Any] = []
    with code.inside(operations):
        result = make()
    block[len(block) - left : len(block) - left] = operations
    return result


def converted(code: Code, x: Any, kind: str, end: End) -> Value:
    """Return a part as a number of a kind; if it has to be converted, that is done at the end of a block."""
    return at_end(code, end, lambda: code.as_kind(x, kind))  # type: ignore[no-any-return]
