"""The parts of a mechanism in words: bodies, forces, and joints that add nothing."""

from collections.abc import Iterator
from typing import Any

from daebench.runs.result import Table
from daebench.systems.parts import Parts

COLUMNS = ("body", "kind", "mass", "inertia", "centre", "size")
"""Numbers of a body, in SI units."""


def parts_as_json(parts: Parts | None) -> dict[str, Any]:
    """Return the parts of a mechanism by name; nothing of a problem that is no mechanism."""
    if parts is None:
        return {}
    bodies = [dict(zip(COLUMNS, row, strict=True)) for row in parts.bodies]
    lists = {name: list(getattr(parts, name)) for name in ("coordinates", "constraints", "forces", "dropped", "doubts")}
    return {"mechanism": {"bodies": bodies, **lists}}


def parts_printed(parts: Parts | None) -> Iterator[str | Table]:
    """Yield the bodies, the forces and drivers, joints that add no equation, and numbers that are far from those of others."""
    if parts is None:
        return
    yield Table(COLUMNS, parts.bodies, "bodies, in kg, kg m^2 and m")
    yield f"positions: {', '.join(parts.coordinates)}"
    if parts.forces:
        yield Table(["forces and drivers"], [[text] for text in parts.forces])
    yield from (f"{text}." for text in (*parts.dropped, *parts.doubts))
