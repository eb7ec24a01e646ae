"""Numbers of bodies that are far from those of others, as after a slip of a unit.

A slip of a unit is a factor of 1000, as of 5200 for 5.2, or more. Masses and sizes are held against those of all other bodies of a kind,
or of all kinds where there are fewer than two of its kind: one is doubted that is more than FAR times the largest of these, or less than
the least by that factor. Where none is, the mass for the length is. A moment of inertia is doubted where I / (mass size^2) is that far from
1/12, which it is of a rod, and a point where it is FAR times farther from all others than they are from each other.
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import sympy as sp

from daebench.joints.exact import Values, numbers
from daebench.joints.frames import Column
from daebench.joints.parts import BodyRow

FAR = 100.0
"""Factor between a number and those of all others beyond which it is doubted."""

ROD = 1 / 12
"""I / (mass size^2) of a thin rod about its centre."""


def doubts_of(rows: Sequence[BodyRow], points: Mapping[str, Column], values: Values) -> list[str]:
    """Return sentences on numbers that are far from those of others."""
    long = [row for row in rows if row.size > 0]
    doubts = _far(rows, "mass", "kg", lambda row: row.mass) + _far(long, "size", "m", lambda row: row.size)
    # A slip in a mass or a size is in the mass for the length, too, and is named once.
    doubts = doubts or _far(long, "mass for its length", "kg/m", lambda row: row.mass / row.size)
    for row in (row for row in long if row.kind.endswith("Body") and max(row.inertia) > 0):
        largest, of_rod = float(np.max(row.inertia)), ROD * row.mass * row.size**2
        if not 1 / FAR < largest / of_rod < FAR:
            doubts.append(
                f"the inertia of {row.name}, {largest:.4g} kg m^2, is {_times(largest / of_rod)} that of a rod of its mass and size, "
                f"{of_rod:.4g}; check its unit, and those of its mass and its points"
            )
    return doubts + _far_points(points, values)


def _far(rows: Sequence[BodyRow], what: str, unit: str, number: Callable[[BodyRow], float]) -> list[str]:
    doubts = []
    for row in rows:
        alike = [other for other in rows if other is not row and other.kind == row.kind]
        kind = row.kind if len(alike) > 1 else "body"
        others, size = [number(x) for x in (alike if len(alike) > 1 else rows) if x is not row], number(row)
        if others and not min(others) / FAR <= size <= FAR * max(others):
            nearest = max(others) if size > max(others) else min(others)
            doubts.append(
                f"the {what} of {row.name}, {size:.4g} {unit}, is {_times(size / nearest)} that of any other {kind}; check its unit"
            )
    return doubts


def _far_points(points: Mapping[str, Column], values: Values) -> list[str]:
    names = [name for name, column in points.items() if column.weight]
    if len(names) < 3:
        return []
    x = numbers(sp.Matrix.hstack(*(points[name].reference for name in names)), values)
    apart = np.linalg.norm(x[:, :, None] - x[:, None, :], axis=0)
    doubts = []
    for k, name in enumerate(names):
        rest = [j for j in range(len(names)) if j != k]
        others, least = float(apart[np.ix_(rest, rest)].max()), float(apart[k, rest].min())
        if others > 0 and least > FAR * others:
            doubts.append(f"the point {name} is {least:.4g} m from all others, which are at most {others:.4g} m apart; check its unit")
    return doubts


def _times(factor: float) -> str:
    return f"{factor:.3g} times" if factor > 1 else f"1/{1 / factor:.3g} of"
