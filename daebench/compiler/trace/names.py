"""The names that generated modules take from Python and NumPy, as functions of values that are recorded."""

import types
from collections.abc import Callable, Mapping, Sequence
from functools import partial, reduce
from math import log, pi
from typing import Any

import numpy as np

from daebench.compiler.trace import dual, lanes
from daebench.compiler.trace.arrays import Array, arange, contiguous, empty, zeros
from daebench.compiler.trace.code import Code
from daebench.compiler.trace.complex import COMPLEX, Complex, as_complex
from daebench.compiler.trace.complex import FUNCTIONS as OF_COMPLEX
from daebench.compiler.trace.dual import Dual
from daebench.compiler.trace.ir import FLOAT32, FLOAT64, INTEGER, POINTER, TRUTH, Value, kind_of
from daebench.compiler.trace.pivots import value_of
from daebench.compiler.trace.statements import BOTH, CHOSEN, EITHER, NEGATED
from daebench.compiler.trace.structure import fill

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


def called(code: Code, address: Any, letters: str, args: Sequence[Any]) -> Value:
    """Return the result of a function of C at an address."""
    given = tuple(code.as_kind(x, KINDS[letter]) for letter, x in zip(letters[1:], args, strict=True))
    return code.effect("ccall", KINDS[letters[0]], (code.as_kind(address, INTEGER), *given, letters))


def of_addresses(code: Code) -> dict[str, Callable[..., Any]]:
    """Return the functions of addresses by the names that they have in generated modules."""

    def numbers(kind: str) -> Callable[[Any], Array]:
        # How many numbers are at an address is said where they become an array.
        return lambda address: Array(code.emit("itop", POINTER, (code.as_kind(address, INTEGER),)), kind, (), ())

    def array(numbers: Array, shape: Any, *, columns: bool = False) -> Array:
        shape = shape if isinstance(shape, tuple) else (shape,)
        strides = contiguous(shape[::-1])[::-1] if columns else contiguous(shape)
        return Array(numbers.pointer, numbers.kind, shape, strides)

    def content(place: int) -> Callable[[Any, Any], Array]:
        def numbers_of(user: Any, container: Any) -> Array:
            return Array(called(code, array(numbers(INTEGER)(user), place + 1)[place], "ap", [container]), FLOAT64, (), ())

        return numbers_of

    def function(letters: str) -> Callable[..., Value]:
        return lambda address, *args: called(code, address, letters, args)

    functions: dict[str, Callable[..., Any]] = {"real_pointer": numbers(FLOAT64), "word_pointer": numbers(INTEGER)}
    functions |= {"carray": array, "farray": lambda numbers, shape: array(numbers, shape, columns=True)}
    functions |= {name: content(place) for name, place in CONTENT.items()}
    return functions | {name: function(letters) for name, letters in CALLED.items()}


_SAME = "sqrt sin cos tan asin acos atan atan2 sinh cosh tanh asinh acosh atanh exp exp2 expm1 log log1p log2 log10 cbrt hypot"
MATHEMATICS = {name: name for name in _SAME.split()}
MATHEMATICS |= {f"arc{name}": f"a{name}" for name in ("sin", "cos", "tan", "tan2", "sinh", "cosh", "tanh")}
"""Functions of numbers by their names in modules, with the names of the platform."""

FUNCTIONS = frozenset((*MATHEMATICS.values(), "pow"))
"""Functions of numbers, by the names of the platform."""


class Kind:
    """A type of numbers as NumPy names it: converts numbers, and says what an array holds."""

    def __init__(self, code: Code, kind: str) -> None:
        self.code, self.kind = code, kind

    def __call__(self, x: Any) -> Any:
        """Return a number of this type."""
        return as_complex(self.code, x) if self.kind == COMPLEX else self.code.as_kind(x, self.kind + kind_of(x)[1:])


def _table(code: Code, rows: Any) -> Array:
    """Return an array of constants."""
    array = np.array(rows)
    kind = INTEGER if array.dtype.kind in "iu" else FLOAT64
    entries = tuple(array.ravel().tolist())
    pointer = Value(code, "table", POINTER, (entries, kind))
    strides = [stride // array.itemsize for stride in array.strides]
    return Array(pointer, kind, array.shape, strides, entries if array.ndim == 1 else None)


def _function(code: Code, name: str) -> Callable[..., Any]:
    """Return a function of numbers of any type."""
    of_numbers, of_pairs = getattr(code.functions, name), OF_COMPLEX.get(name)

    def called(*args: Any) -> Any:
        if any(isinstance(x, Dual) for x in args):
            return dual.function_of(code, name, args)
        if not any(isinstance(x, Complex) for x in args):
            return of_numbers(*args)
        if of_pairs is None:
            raise TypeError(f"{name} is no function of complex numbers")
        return of_pairs(*args)

    return called


def _extreme(code: Code, op: str, args: Sequence[Any]) -> Any:
    return reduce(partial(dual.extreme, code, op), map(value_of, args[0] if len(args) == 1 else args))


def _composed(code: Code) -> dict[str, Callable[..., Any]]:
    """Return the functions of NumPy that the platform does not have, made of those that it has."""
    sin, exp, exp2, log1p = (_function(code, name) for name in ("sin", "exp", "exp2", "log1p"))

    def sinc(x: Any) -> Any:
        angle = code.as_kind(pi, kind_of(x)) * code.select(x == 0.0, code.as_kind(1e-20, kind_of(x)), x)
        return sin(angle) / angle

    def below(x: Any, y: Any) -> Any:
        return -abs(x - y)

    return {
        "sinc": sinc,
        "logaddexp": lambda x, y: _extreme(code, "gt", (x, y)) + log1p(exp(below(x, y))),
        "logaddexp2": lambda x, y: _extreme(code, "gt", (x, y)) + log1p(exp2(below(x, y))) / code.as_kind(log(2.0), kind_of(x)),
    }


def names(code: Code) -> dict[str, Any]:
    """Return the names that generated modules take from Python and NumPy, as functions of values."""

    def holding(make: Callable[..., Array]) -> Callable[..., Array]:
        return lambda shape, dtype=FLOAT64: make(code, shape, getattr(dtype, "kind", dtype))

    def converted(kind: str, known: Callable[[Any], Any]) -> Callable[[Any], Any]:
        return lambda x: code.as_kind(x, kind + x.kind[1:]) if isinstance(x, Value) else known(x)

    kinds = {"float64": FLOAT64, "float32": FLOAT32, "int64": INTEGER, "bool_": TRUTH, "complex128": COMPLEX}
    numpy: dict[str, Any] = {name: Kind(code, kind) for name, kind in kinds.items()}
    numpy |= {name: _function(code, function) for name, function in MATHEMATICS.items()}
    numpy |= {"empty": holding(empty), "zeros": holding(zeros), "arange": partial(arange, code)}
    numpy |= {"array": lambda rows, dtype=None: _table(code, rows), "inf": float("inf"), "nan": float("nan"), "absolute": abs}
    numpy |= {"isfinite": lambda x: (x - x) == 0.0, **_composed(code)}
    functions = {function.__name__: function for function in (*dual.FUNCTIONS, *lanes.FUNCTIONS, fill)}
    python = {
        "len": lambda x: x.shape[0] if isinstance(x, Array) else len(x),
        "abs": abs,
        "max": lambda *args: _extreme(code, "gt", args),
        "min": lambda *args: _extreme(code, "lt", args),
        "bool": converted(TRUTH, bool),
        "float": converted(FLOAT64, float),
        "int": converted(INTEGER, int),
        "complex": partial(Complex, code),
    }
    chosen = {
        "select": code.select,
        CHOSEN: code.select,
        "negated": code.negated,
        NEGATED: code.negated,
        BOTH: code.both,
        EITHER: code.either,
    }
    return {**numpy, **of_addresses(code), **functions, **python, **chosen, "numpy": types.SimpleNamespace(**numpy)}
