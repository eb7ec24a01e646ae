"""The parts of a mechanism as ``daebench show`` and ``daebench check`` print them: bodies, forces, and joints that add nothing."""

from typing import TYPE_CHECKING, Any

from daebench.cli.console import print_table, printable

if TYPE_CHECKING:
    from daebench.systems.parts import Parts

COLUMNS = ("body", "kind", "mass", "inertia", "centre", "size")
"""Numbers of a body, in SI units."""


def as_json(parts: "Parts | None") -> dict[str, Any]:
    """Return the parts by name for JSON; nothing of a problem that is no mechanism."""
    if parts is None:
        return {}
    bodies = [dict(zip(COLUMNS, row, strict=True)) for row in parts.bodies]
    lists = {name: list(getattr(parts, name)) for name in ("constraints", "forces", "dropped", "doubts")}
    return {"mechanism": {"bodies": bodies, **lists}}


def print_parts(parts: "Parts | None") -> None:
    """Print the bodies, the forces and drivers, joints that add no equation, and numbers that are far from those of others."""
    if parts is None:
        return
    print_table(COLUMNS, parts.bodies, "bodies, in kg, kg m^2 and m")
    if parts.forces:
        print_table(["forces and drivers"], [[text] for text in parts.forces])
    for text in (*parts.dropped, *parts.doubts):
        print(printable(f"{text}."))
