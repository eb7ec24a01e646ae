"""The scenes in motion: for each problem the positions of its points over time, as numbers that ``cards.js`` draws."""

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from markupsafe import Markup

from daebench.draw.figures import VERMILION
from daebench.draw.orthographic import projected
from daebench.reports.problems.figures import PATHS
from daebench.reports.problems.path import Drawing
from daebench.runs.ivp import Array

FRAMES = 150
"""Positions over the drawn time, besides the start."""

WIDTH, HEIGHT, MARGIN = 1000, 720, 60
"""Size of a card, and its margin, in its units: all positions are whole numbers."""

SECONDS = 9
"""Time in which a card shows the drawn time of its problem, s."""

SPARSE = 4
"""Stride of the points of the lines on a surface."""


def motions(drawings: Mapping[str, Drawing]) -> Markup:
    """Return the motions of all problems as JSON, by name, with what they have in common."""
    common = {"width": WIDTH, "height": HEIGHT, "frames": FRAMES, "seconds": SECONDS, "colors": PATHS, "mass": VERMILION}
    return Markup(json.dumps(common | {"scenes": {name: motion(each) for name, each in drawings.items()}}, separators=(",", ":")))


def motion(drawing: Drawing) -> dict[str, Any]:
    """Return one motion: the places of each point, [x, y] if it stays there and else x and y at each time, and what the points are of."""
    times = np.linspace(0, len(drawing.t) - 1, FRAMES + 1).round().astype(int)
    flat, surface = projected(drawing.points[times]), projected(drawing.surface[:, ::SPARSE])
    corner, scale = _fitted(np.concatenate([flat.reshape(-1, 2), surface.reshape(-1, 2)]))

    def placed(points: Array) -> list[int]:
        x, y = np.moveaxis((points - corner) * scale, -1, 0)
        whole = np.stack([x, HEIGHT - y], axis=-1).round().astype(int).reshape(-1, 2)
        return [int(value) for value in (whole[:1] if np.ptp(whole, axis=0).max() == 0 else whole).ravel()]

    return {
        "points": [placed(flat[:, k]) for k in range(flat.shape[1])],
        "rods": drawing.rods,
        "springs": drawing.springs,
        "dampers": drawing.dampers,
        "masses": drawing.masses,
        "fixed": drawing.fixed,
        "paths": drawing.moving,
        "surface": [placed(line) for line in surface],
    }


def _fitted(points: Array) -> tuple[Array, float]:
    """Return the corner of the card in the plane of the picture, and the units of the card per unit of length."""
    low, high = points.min(axis=0), points.max(axis=0)
    size = np.array([WIDTH, HEIGHT])
    scale = float(np.min((size - 2 * MARGIN) / np.maximum(high - low, 1e-300)))
    return (low + high - size / scale) / 2, scale
