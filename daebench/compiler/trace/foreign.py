"""Addresses and functions of C in a program: arrays at an address, and calls of functions at an address."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from daebench.compiler.trace.arrays import Array, contiguous
from daebench.compiler.trace.ir import FLOAT64, INTEGER, POINTER, Code, Value

KINDS = {"d": FLOAT64, "i": INTEGER, "p": INTEGER, "a": POINTER}
"""Kinds of values, by the letter of a type of C: a double, an int, an address, and an address of numbers that the program reads."""

CALLED: Mapping[str, str] = {
    "ida_solve": "ipdpppi",
    "cvode_solve": "ipdppi",
    "interpolate": "ipdip",
    "ask": "ipp",
    "look": "idpp",
}
"""Functions that are called by an address, which is their first argument, by the name that generated modules give them.

They are IDASolve, CVode, the interpolation of either, what answers a question about a solver, and the look at a step. Letters are those of
:data:`KINDS`, that of the result first.
"""

CONTENT = {"numbers_of_vector": 0, "numbers_of_matrix": 1}
"""Functions that give the numbers of a container of SUNDIALS, by the place of their address in the memory of callbacks."""


class Numbers:
    """The numbers at an address: of which kind, and how many is said where they become an array."""

    def __init__(self, pointer: Value, kind: str) -> None:
        self.pointer, self.kind = pointer, kind


def called(code: Code, address: Any, letters: str, args: Sequence[Any]) -> Value:
    """Return the result of a function of C at an address."""
    given = tuple(code.as_kind(x, KINDS[letter]) for letter, x in zip(letters[1:], args, strict=True))
    return code.effect("ccall", KINDS[letters[0]], (code.as_kind(address, INTEGER), *given, letters))


def names(code: Code) -> dict[str, Callable[..., Any]]:
    """Return the functions of addresses by the names that they have in generated modules."""

    def numbers(kind: str) -> Callable[[Any], Numbers]:
        return lambda address: Numbers(code.emit("itop", POINTER, (code.as_kind(address, INTEGER),)), kind)

    def array(numbers: Numbers, shape: Any, *, columns: bool = False) -> Array:
        shape = shape if isinstance(shape, tuple) else (shape,)
        strides = contiguous(shape[::-1])[::-1] if columns else contiguous(shape)
        return Array(numbers.pointer, numbers.kind, shape, strides)

    def content(place: int) -> Callable[[Any, Any], Numbers]:
        def numbers_of(user: Any, container: Any) -> Numbers:
            return Numbers(called(code, array(numbers(INTEGER)(user), place + 1)[place], "ap", [container]), FLOAT64)

        return numbers_of

    def function(letters: str) -> Callable[..., Value]:
        return lambda address, *args: called(code, address, letters, args)

    functions: dict[str, Callable[..., Any]] = {"real_pointer": numbers(FLOAT64), "word_pointer": numbers(INTEGER)}
    functions |= {"carray": array, "farray": lambda numbers, shape: array(numbers, shape, columns=True)}
    functions |= {name: content(place) for name, place in CONTENT.items()}
    return functions | {name: function(letters) for name, letters in CALLED.items()}
