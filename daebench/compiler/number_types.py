"""Types of numbers that a module is linked for: types of NumPy, and types of this compiler.

Modules of such a type call functions of its numbers, and have entry points of their own: since Python itself has no such numbers,
``integrate_dual`` replaces ``integrate``, and passes their parts separately.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from importlib import import_module

import numpy as np

from daebench.compiler.syntax import text_of

DOUBLE = "2.220446049250313e-16"

POINTS = "daebench.compiler.entry_points"
"""The file with the entry points of modules of numbers that Python does not have."""


@dataclass(frozen=True, kw_only=True)
class NumberType:
    """Properties of a type of numbers that the linker needs."""

    kind: str
    """Its name, without the number for its width."""
    dtype: str
    """NumPy's name of the type, or of its components."""
    eps: str = DOUBLE
    """Source of the distance from 1 to the next larger number."""
    again: int = 1
    """Number of times that Newton's iterations are repeated: 2 if derivatives are carried in the imaginary part."""
    single_forces: bool = False
    """Whether forces are computed in float32, in functions of ``dtype``."""
    width: int = 0
    """Number of derivatives, or of runs, in a number of such a type; 0 for other types."""

    @property
    def spacing(self) -> float:
        """Distance from 1 to the next larger number."""
        return _spacing(self.dtype)

    @property
    def coarsest_spacing(self) -> float:
        """The same of the coarsest numbers in which something is computed."""
        return _spacing("float32" if self.single_forces else self.dtype)

    @property
    def directions(self) -> int:
        """Number of directions in which numbers carry derivatives besides their values."""
        return self.width - self.lanes

    @property
    def lanes(self) -> int:
        """Number of runs computed at once; 0 if there is one run."""
        return self.width if self.kind == "lanes" else 0

    @cached_property
    def functions(self) -> Sequence[str]:
        """Functions of these numbers that modules call."""
        if not self.width:
            return ()
        from daebench.compiler.trace import dual, lanes  # only where source is generated

        return ["select", "negated", *(function.__name__ for function in (lanes if self.lanes else dual).FUNCTIONS)]

    def entries(self, roots: Sequence[str]) -> tuple[list[str], list[str]]:
        """Return the sources of functions that replace some of the roots of a module, and the names of its roots after this replacement.

        Named numbers from that file, and functions called by these functions, come before them.
        """
        if not self.width:
            return [], list(roots)
        entries = vars(import_module(POINTS))
        points = {name: x for name, x in entries.items() if getattr(x, "__module__", "") == POINTS}
        names = [stand_in if (stand_in := f"{name}_{self.kind}") in points else name for name in roots]
        texts = [text_of(points[name]) for name in names if name in points]
        read = sorted({*re.findall(r"\w+", " ".join(texts))} - {*names, *entries["__annotations__"]})
        numbers = [f"{name} = {entries[name]}" for name in read if isinstance(entries.get(name), int)]
        helpers = [text_of(points[name]) for name in read if name in points]
        return [f"REMEMBERS = {'initialise' in roots}", *numbers, *helpers, *texts], names


NUMBER_TYPES = {
    number.kind: number
    for number in (
        NumberType(kind="float64", dtype="float64"),
        NumberType(kind="float32", dtype="float32", eps="numpy.float32(1.1920929e-07)"),
        NumberType(kind="mixed", dtype="float64", single_forces=True),
        NumberType(kind="complex128", dtype="complex128", again=2),
        NumberType(kind="dual", dtype="float64"),
        NumberType(kind="tangent", dtype="float64"),
        NumberType(kind="lanes", dtype="float64"),
    )
}


def number_type(name: str) -> NumberType:
    """Return a type by name: "float64", "dual4" for dual numbers with derivatives in 4 directions, "lanes8" for 8 runs at once.

    The name "mixed" means forces in float32 and everything else in float64; "tangent1" means dual numbers of one direction, with an entry
    point that rescales the derivatives to length 1 repeatedly.
    """
    if name in NUMBER_TYPES:
        return NUMBER_TYPES[name]
    kind = name.rstrip("0123456789")
    return replace(NUMBER_TYPES[kind], width=int(name.removeprefix(kind)))


def _spacing(dtype: str) -> float:
    return float(np.finfo(dtype).eps)
