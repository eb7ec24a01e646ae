"""How kernels hold the vectors of a constrained problem, by their length; nothing here needs SymPy."""

import types

WRITTEN_OUT = 24
"""Positions up to which vectors are tuples and kernels straight-line code: it takes minutes to compile as many, and beyond far longer."""

PLAIN = ("float64", "float32", "complex128")
"""Number types that arrays are made of."""


def in_loops(facts: types.ModuleType, precision: str = "float64") -> bool:
    """Return whether compiled functions of a problem, given its facts, take arrays and have loops; those of a long chain are its own."""
    if facts.KIND != "constrained" or getattr(facts, "NODES", 0):
        return False
    return int(facts.D) > WRITTEN_OUT and precision in PLAIN
