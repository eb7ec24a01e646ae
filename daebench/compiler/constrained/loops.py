"""The functions of a constrained problem with many unknowns: vectors are arrays, and terms of equal form are summed in loops."""

from typing import TYPE_CHECKING

from daebench.compiler.equal_terms import added
from daebench.compiler.python_text import function

if TYPE_CHECKING:
    from daebench.compiler.constrained.derivation import Derivation

PAIRS = ("damping",)
"""Functions that return a few numbers, as a tuple."""


def source(derivation: "Derivation", name: str, dtype: str) -> tuple[str, dict[str, str]] | None:
    """Return the source of a function of the problem and of the tables that it reads; None if it is not an expression of this problem."""
    rule = derivation.rule(name)
    if rule is None or name in PAIRS:
        written = derivation.source(name)
        return None if written is None else (written, {})
    arguments, values, shape = rule
    columns = shape[1] if len(shape) == 2 else 1
    places: list[tuple[int, ...]] = [divmod(k, columns) if len(shape) == 2 else (k,) for k in range(len(values))]
    entries = {place: value for place, value in zip(places, values, strict=True) if value != 0}
    text = added(name, arguments, entries, derivation.parameters)
    result = {0: "out[0]", 1: "out"}.get(len(shape), "out[0], out[1]" if name == "kinetic_increment" else "out")
    head = f"out = numpy.zeros({shape or 1}, dtype=numpy.{dtype})"
    return function(f"{name}({', '.join([*arguments, 'par'])})", head, *text.lines, f"return {result}"), text.tables
