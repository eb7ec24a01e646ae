"""Positions of the parts of an initial value problem along any run, as declared by the problem's picture."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from daebench.errors import InvalidProblem
from daebench.runs.ivp import Array, InitialValueProblem
from daebench.systems.lazily import sympy as sp

if TYPE_CHECKING:
    from daebench.systems.picture import Picture

LINES, ALONG = 13, 61
"""Number of lines of constant coordinates on a surface, and of points on each."""

ZIGZAG, END = 10, 0.15
"""Number of corners of a spring, and length of the straight part at either end."""

AMPLITUDE = 0.035
"""Half the width of a spring, as a fraction of the extent of the drawing."""


@dataclass(frozen=True)
class Layout:
    """Drawing of an initial value problem: its parts, given by numbers of points, and the positions of the points."""

    dimension: int
    """2 or 3."""
    rods: list[list[int]]
    """For each rod, the points through which it passes."""
    masses: list[int]
    fixed: list[int]
    """Points that are masses, and points that do not move."""
    springs: list[list[int]]
    dampers: list[list[int]]
    """For each spring and each damper, the two points that it connects."""
    surface: Array
    """Lines on the surface; none if there is no surface; shape (lines, ALONG, 3)."""
    axes: tuple[str, ...]
    """Names of the coordinates; empty if they are lengths."""
    at: Callable[[Array], Array]
    """``at(states)`` maps rows of positions q, or of states y, shape(n, ...), to the points, shape(n, k, dimension): those of the rods,
    then the masses, the fixed points, and the ends of springs and of dampers.
    """


def layout_of(ivp: InitialValueProblem) -> Layout | None:
    """Return the drawing of a problem of any kind with the numbers of a case; None if it declares no picture."""
    declared = ivp.source.define()
    picture = declared.picture
    if picture is None:
        return None
    parts, flat = numbered(picture)
    dimension = _dimension(ivp.problem, picture, flat)
    symbols = _coordinates(declared)
    parameters = list(declared.parameters)
    _require_declared(ivp.problem, flat, {*symbols, *parameters})
    _require_declared(ivp.problem, [picture.surface or ()], {*parameters, *(symbol for symbol, *_ in picture.over)})
    par = [ivp.parameters[str(name)] for name in parameters]
    at = _points(flat, symbols, parameters, par)
    return Layout(dimension, *parts, surface_lines(picture, parameters, par), tuple(picture.axes), at)


def _coordinates(declared: Any) -> list[Any]:
    """Return the symbols of the entries of a row of states: positions, and the time if it is one of them, or y."""
    if getattr(declared, "in_time", False):
        from daebench.systems.extended import time_symbols  # SymPy, which most runs do without

        return [*declared.q, time_symbols(declared)[0]]
    return list(getattr(declared, "q", ()) or getattr(declared, "y", ()))


def named_points(ivp: InitialValueProblem, state: Array) -> dict[str, Array]:
    """Return the named points of a problem's picture at positions q, which include the time if it is one; empty if no points are named."""
    names = getattr(ivp.facts, "POINTS", ())
    if not names:
        return {}
    declared: Any = ivp.source.define()
    points, symbols, parameters = declared.picture.points, _coordinates(declared), list(declared.parameters)
    _require_declared(ivp.problem, list(points.values()), {*symbols, *parameters})
    at = _points([points[name] for name in names], symbols, parameters, [ivp.parameters[str(x)] for x in parameters])
    return dict(zip(names, at(state[None])[0], strict=True))


def numbered(picture: "Picture") -> tuple[tuple[list[list[int]], list[int], list[int], list[list[int]], list[list[int]]], list[Any]]:
    """Return rods, masses, fixed points, springs and dampers by numbers of points, and all points in order."""
    flat: list[Any] = []

    def added(points: Any) -> list[int]:
        flat.extend(points)
        return list(range(len(flat) - len(points), len(flat)))

    rods, masses, fixed = [added(rod) for rod in picture.rods], added(picture.masses), added(picture.fixed)
    springs, dampers = ([added(ends) for ends in pairs] for pairs in (picture.springs, picture.dampers))
    return (rods, masses, fixed, springs, dampers), flat


def zigzag(ends: Array, amplitude: float) -> Array:
    """Return the corners of a spring between two points of the plane, shape(ZIGZAG + 4, 2). Its width does not depend on its length."""
    leg = ends[1] - ends[0]
    length = float(np.hypot(*leg)) or 1.0
    # A short spring is drawn narrower: its corners would otherwise be longer than itself.
    side = min(amplitude, length / 8) * np.array([-leg[1], leg[0]]) / length
    along = np.concatenate([[0.0], np.linspace(END, 1 - END, ZIGZAG + 2), [1.0]])
    aside = np.concatenate([[0.0, 0.0], (-1.0) ** np.arange(ZIGZAG), [0.0, 0.0]])
    return np.asarray(ends[0] + along[:, None] * leg + aside[:, None] * side)


def surface_lines(picture: "Picture", parameters: Sequence[Any], par: Sequence[float]) -> Array:
    """Return lines of constant coordinates on the surface, shape(lines, ALONG, 3)."""
    if picture.surface is None:
        return np.empty((0, ALONG, 3))
    (u, *of_u), (v, *of_v) = picture.over
    call = sp.lambdify([u, v, parameters], list(picture.surface), "numpy")
    known = dict(zip(parameters, par, strict=True))
    ends = [[float(sp.sympify(x).subs(known)) for x in bounds] for bounds in (of_u, of_v)]
    few, many = ([np.linspace(low, high, n) for low, high in ends] for n in (LINES, ALONG))
    pairs = [(np.full(ALONG, a), many[1]) for a in few[0]] + [(many[0], np.full(ALONG, b)) for b in few[1]]
    return np.array([np.stack([np.broadcast_to(x, ALONG) for x in call(a, b, par)], axis=1) for a, b in pairs], dtype=float)


def moving(points: Array, candidates: Sequence[int]) -> list[int]:
    """Return the points that move, without repeating points that always coincide; points has shape(n, k, dimension)."""
    indices: list[int] = []
    # Less is rounding: points that coincide are computed from different expressions.
    least = 1e-9 * float(np.max(np.abs(points), initial=0.0))
    for k in candidates:
        moves = np.ptp(points[:, k], axis=0).max() > least
        if moves and all(np.max(np.abs(points[:, k] - points[:, j])) > least for j in indices):
            indices.append(k)
    return indices


def _points(flat: list[Any], symbols: list[Any], parameters: list[Any], par: list[float]) -> Callable[[Array], Array]:
    call = sp.lambdify([symbols, parameters], [[sp.sympify(x) for x in point] for point in flat], "numpy")

    def at(states: Array) -> Array:
        with np.errstate(all="ignore"):
            points = call(list(states.T), par)
        # A coordinate that is constant is one number, whatever the number of states.
        return np.moveaxis(np.array([[np.broadcast_to(x, len(states)) for x in point] for point in points], dtype=float), 2, 0)

    return at


def _dimension(problem: str, picture: "Picture", flat: Sequence[Any]) -> int:
    sizes = {len(point) for point in flat}
    if not flat or len(sizes) > 1 or not sizes <= {2, 3} or (picture.surface is not None and sizes != {3}):
        raise InvalidProblem(
            f"the picture of {problem} needs points, all in the plane or all in space; with a surface they must be in space.",
            "picture-points-mixed",
        )
    (dimension,) = sizes
    if picture.axes and len(picture.axes) != dimension:
        raise InvalidProblem(
            f"the picture of {problem} names {len(picture.axes)} axes for points with {dimension} coordinates.", "picture-axes-count"
        )
    return dimension


def _require_declared(problem: str, points: Sequence[Any], known: set[Any]) -> None:
    symbols = {symbol for point in points for x in point for symbol in sp.sympify(x).free_symbols}
    if extra := sorted(map(str, symbols - known)):
        raise InvalidProblem(
            f"the picture of {problem} contains {', '.join(extra)}, which is not a coordinate or parameter; declare it.",
            "picture-symbol-undeclared",
        )
