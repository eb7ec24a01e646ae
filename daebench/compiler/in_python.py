"""Recorded functions that Python executes: where machine code cannot be made, and where it need not be."""

import math
import time
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from daebench.compiler.entry import Entry, Head, Other, packed

TYPES: dict[str, Any] = {"d": np.float64, "s": np.float32, "i": np.int64, "b": np.bool_}
"""Types of numbers, by their kinds."""


def whole(x: Any) -> int:
    """Return a number without its fraction."""
    return int(x) if math.isfinite(x) else 0


def of_numpy(name: str, kind: str = "") -> Callable[..., Any]:
    """Return NumPy's function of the name that the platform has."""
    known = {"pow": "power", "atan2": "arctan2"}.get(name, name.replace("a", "arc", 1) if name.startswith("a") else name)
    return getattr(np, known)  # type: ignore[no-any-return]


def platform(name: str, kind: str) -> Callable[..., Any]:
    """Return a function of numbers of a kind as machine code calls it: Python's in double precision, NumPy's where that raises an error."""
    of_python, number = getattr(math, name), TYPES[kind]

    def called(*args: Any) -> Any:
        try:
            return number(of_python(*args))
        except (ValueError, OverflowError):
            return of_numpy(name)(*args)

    return called


NAMES: dict[str, Any] = {"TYPES": TYPES, "float64": np.float64, "float32": np.float32, "whole": whole, "empty": np.empty, "array": np.array}
NAMES |= {"nan": np.nan, "inf": np.inf}
"""The names of texts: types of numbers by their kinds, functions of the platform, conversions, and arrays."""

TAKEN: dict[str, Callable[[Any], Any]] = {"d": np.float64, "f4x": np.float32, "q": lambda x: x}
"""What numbers become, by the letters of words: quotients by zero of NumPy's are infinite."""

FOUND: dict[str, Callable[[Any], Any]] = {"d": float, "s": float, "i": int, "b": bool, "p": lambda x: x}
"""What results become, by their kinds."""


class OfPython(Entry):
    """A function of words, the last in a text; other parameters as :class:`daebench.compiler.entry.Entry`."""

    def __init__(self, form: Any, head: Head, text: str) -> None:
        types = [TAKEN[letter] for letter in packed(form)]
        self._head, self._text = head, text
        self._function = self._executed(platform)
        super().__init__(form, head, _View, lambda *words: [of(x) for of, x in zip(types, words, strict=True)], _array)

    def _executed(self, platform: Callable[..., Any]) -> Callable[..., tuple[Any, ...]]:
        space = NAMES | {"platform": platform}
        exec(self._text, space)
        return space[self._head["name"]]  # type: ignore[no-any-return]

    @cached_property
    def _of_columns(self) -> Callable[..., tuple[Any, ...]]:
        return self._executed(of_numpy)

    def columns(self, args: tuple[Any, ...]) -> Any:
        """Return the result where arguments have columns in place of numbers, of a function that does the same with each row."""
        return _built(self._head["results"], iter(self._of_columns(*_parts(args))))

    def timed(self, words: Any, given: int) -> tuple[Any, float]:
        """Return the result for what :meth:`words` gives, and the CPU time."""
        began = time.thread_time()
        with np.errstate(all="ignore"):
            results = self._function(*words)
        seconds = time.thread_time() - began
        return self._together([FOUND[kind](x) for kind, x in zip(self.kinds, results, strict=True)]), seconds


def _parts(x: Any) -> list[Any]:
    """Return the columns of nested tuples; those of complex numbers as two."""
    if isinstance(x, tuple):
        return [part for entry in x for part in _parts(entry)]
    return [np.real(x), np.imag(x)] if np.iscomplexobj(x) else [x]


def _built(description: Any, columns: Iterator[Any]) -> Any:
    """Return a result of columns."""
    if isinstance(description, list):
        return tuple([_built(part, columns) for part in description])
    if description is None:
        return next(columns)
    if "parts" in description:
        real, imag = (_built(part, columns) for part in description["parts"])
        return real + 1j * imag
    return description["is"]


class _View:
    """The numbers of an array on one axis, with its lengths, and its strides in entries unless they follow from the lengths."""

    def __init__(self, form: tuple[Any, ...]) -> None:
        self.dtype, self.axes, self.ordered = np.dtype(form[0]), form[1], form[2]

    def __call__(self, x: Any) -> tuple[Any, ...]:
        """Return the words of an array."""
        if type(x) is not np.ndarray or (x.dtype, x.ndim, x.flags.c_contiguous) != (self.dtype, self.axes, self.ordered):
            raise Other
        strides = () if self.ordered else tuple(stride // x.itemsize for stride in x.strides)
        extent = x.size if self.ordered or 0 in x.shape else 1 + sum((n - 1) * k for n, k in zip(x.shape, strides, strict=True))
        flat = np.lib.stride_tricks.as_strided(x, (extent,), (x.itemsize,), writeable=x.flags.writeable)
        return flat.view(np.float64) if self.dtype == complex else flat, *x.shape, *strides


def _array(pointer: Any, dtype: Any, shape: Sequence[int], strides: Sequence[int]) -> Any:
    """Return a copy of an array where a pointer points to."""
    return np.ndarray(shape, dtype, pointer, 0, [dtype.itemsize * stride for stride in strides]).copy()
