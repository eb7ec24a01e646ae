"""Representation of the vectors of a constrained problem in kernels, by their length. This module needs no SymPy."""

import types

WRITTEN_OUT = 24
"""Number of positions up to which vectors are tuples. At this size straight-line code takes minutes to compile, and beyond far longer."""

PLAIN = ("float64", "float32", "complex128")
"""Number types of which there are arrays."""


def in_loops(facts: types.ModuleType, precision: str = "float64") -> bool:
    """Return whether compiled functions of a problem with these facts use arrays and loops. Long chains have their own representation."""
    if facts.KIND != "constrained" or getattr(facts, "NODES", 0):
        return False
    return int(facts.D) > WRITTEN_OUT and precision in PLAIN
