"""The pictures of small oscillations: where each formulation has its eigenvalues, and the shapes of the slowest modes."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from daebench.draw.figures import QUIET, VERMILION, curve, drawing, grid_of_axes, save
from daebench.draw.orthographic import projected
from daebench.draw.scene import layout_of
from daebench.draw.springs import draw_springs
from daebench.studies.modes.run import Modes
from daebench.studies.modes.spectrum import ZERO, zeros

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

SHOWN = ("index3", "index2", "index1", "baumgarte")
"""Formulations that have a panel; GGL has the spectrum of index 3, and the reduced ODE that of index 1."""

SHAPES = 4
"""Modes whose shapes are drawn, the slowest."""

SWING = 0.25
"""Amplitude of a shape, in parts of the extent of the system."""

LIGHTER = {0.0: 0.6, 1.0: 1.0, -1.0: 0.4}
"""Opacity of the system at rest, and moved to either side: what is moved together has the same."""


def draw(out: Path, found: Modes) -> Path:
    """Write ``modes.svg``, PNG and CSV of the eigenvalues into a folder; return the path of the SVG."""
    return save(figure(found), out, "modes", eigenvalues(found))


def figure(found: Modes) -> "Figure":
    """Return the picture of the modes."""
    layout = layout_of(found.ivp)
    rows = 1 if layout is None else 2
    with drawing():
        drawn, axes = grid_of_axes(rows, len(SHOWN), 0.9 + 2.6 * rows)
        for axis, name in zip(axes[0], SHOWN, strict=True):
            _spectrum(axis, found, name)
        axes[0, 0].set_ylabel("imaginary part [1/s]")
        if layout is not None:
            _shapes(list(axes[1]), found, layout)
        drawn.suptitle(title(found), fontsize="medium", x=0.02, ha="left")
    return drawn


def title(found: Modes) -> str:
    """Return the answer in two lines."""
    m = len(found.rest.lam)
    one = f"{found.ivp.problem} at rest: index 2 has {zeros(found.spectra['index2'])} zeros, index 1 {zeros(found.spectra['index1'])}"
    return f"{one} (m = {m}): in these directions a run drifts.\nIndex 3 and GGL have the natural frequencies alone."


def eigenvalues(found: Modes) -> "pd.DataFrame":
    """Return all eigenvalues, a row each: formulation, real, imaginary."""
    import pandas as pd

    rows = [{"formulation": name, "real": x.real, "imaginary": x.imag} for name, some in found.spectra.items() for x in some]
    return pd.DataFrame(rows)


def _spectrum(axis: Any, found: Modes, name: str) -> None:
    some = found.spectra[name]
    still = np.abs(some) <= ZERO * float(np.max(np.abs(some), initial=1e-300))
    axis.plot(some.real[~still], some.imag[~still], **curve(0) | {"linestyle": "none", "markersize": 5})
    if still.any():
        axis.plot([0], [0], marker="o", color=VERMILION, markersize=9, linestyle="none")
        axis.annotate(f"{int(still.sum())} zeros", (0, 0), xytext=(8, 4), textcoords="offset points", color=VERMILION)
    axis.axvline(0, color=QUIET, linewidth=0.6)
    reach = 1.15 * max(float(np.max(np.abs(some.real), initial=0.0)), 0.3 * float(np.max(np.abs(some.imag), initial=0.0)), 1e-12)
    axis.set(title=name if name != "baumgarte" else f"baumgarte {found.alpha:g}, {found.beta:g} /s", xlabel="real part [1/s]")
    axis.set_xlim(-reach, reach)


def _shapes(axes: list[Any], found: Modes, layout: Any) -> None:
    """Draw the slowest modes, each as the system at rest, in grey, and moved to either side; one in space as seen from outside."""
    at_rest = layout.at(found.rest.q[None])[0]
    extent = float(np.max(np.ptp(at_rest, axis=0))) or 1.0
    for k, axis in enumerate(axes):
        if k >= min(SHAPES, len(found.squares)):
            axis.set_visible(False)
            continue
        for side, style in ((0.0, {"color": QUIET, "linewidth": 2.0}), (1.0, curve(0)), (-1.0, curve(0))):
            moved = projected(layout.at((found.rest.q + side * SWING * extent * found.shapes[k])[None])[0])
            draw_springs(axis, layout, moved, extent, color=style["color"], linewidth=0.8, alpha=LIGHTER[side])
            for rod in layout.rods:
                axis.plot(*moved[rod].T, color=style["color"], linewidth=1.6 if side else 2.4, alpha=LIGHTER[side])
            axis.plot(*moved[layout.masses].T, "o", color=style["color"], markersize=4, alpha=LIGHTER[side])
        axis.set_aspect("equal", adjustable="datalim")
        axis.set_axis_off()
        square = found.squares[k]
        axis.set_title(f"{np.sqrt(square):.4g} rad/s" if square > 0 else "free or growing", fontsize="medium")
