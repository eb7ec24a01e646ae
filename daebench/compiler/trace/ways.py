"""Where ``return``, ``break`` and ``continue`` lead: regions that are left, each with a value."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from daebench.compiler.trace.code import Code
from daebench.compiler.trace.ir import Leave, Region
from daebench.compiler.trace.structure import united

Names = dict[str, Any]


@dataclass(frozen=True)
class Ways:
    """Where ``return``, ``break`` and ``continue`` lead."""

    returned: list[Any]
    """What a function without early returns returns."""
    function: Region | None = None
    """What an early return leaves."""
    left: Mapping[str, tuple[Region, Sequence[str]]] = field(default_factory=dict)
    """What "break" and "continue" leave, with names whose values they hand on."""
    missing: frozenset[str] = frozenset()
    """Names that the loops around carry without a value yet."""


def leave(code: Code, region: Region, structure: Any) -> None:
    """Record that a region is left with a value."""
    departure = Leave(region, structure, code.block)
    region.leaves.append(departure)
    code.block.append(departure)


def behind(code: Code, region: Region) -> Any:
    """Return the value of a region, put together of those with which it is left."""
    leaves = region.leaves
    return united(
        code,
        [leave.structure for leave in leaves],
        [(leave.block, True) for leave in leaves],
        region.results,
        [leave.values for leave in leaves],
    )
