"""The picture of a plane of starts: the fast indicator, and the largest Lyapunov exponent of those that are chaotic."""

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from daebench.diagnostics.lyapunov import CHAOTIC, EXPONENTIAL, QUASI_PERIODIC, REGULAR, UNDETERMINED
from daebench.draw.figures import QUIET, drawing, grid_of_axes
from daebench.draw.tiles import fill
from daebench.studies.chaos.result import EMPTY, STOPPED, Chaos

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INDICATORS = (1.0, 1.75, QUASI_PERIODIC, EXPONENTIAL, 10.0, 30.0, 100.0)
"""Values of <Y> between which colours change."""

INDICATOR_COLOURS = ("#08519c", "#3182bd", "#9ecae1", "#b3b3b3", "#fee391", "#fe9929", "#cc4c02", "#662506")
"""Colours of <Y>: blue where it is that of a regular motion, grey where it says nothing, and from yellow to brown where it grows."""

EXPONENT_COLOURS = ("#fff7bc", "#fee391", "#fec44f", "#fe9929", "#d95f0e", "#993404")
"""Colours of exponents of chaotic starts, from the least to the largest."""

DOTS = {CHAOTIC: "#d95f0e", REGULAR: "#08519c", UNDETERMINED: "#767676", "": "#000000"}
"""Colours of crossings; the last is that of motions that stopped."""

OTHERS = {REGULAR: "#9ecae1", UNDETERMINED: "#8c8c8c", STOPPED: "#000000", EMPTY: "#ffffff"}
"""Colours of cells that have no such number."""


def figure(chaos: Chaos) -> "Figure":
    """Return the picture of a plane of starts."""
    with drawing():
        drawn, axes = grid_of_axes(1, 3 if chaos.section else 2, 3.6 if chaos.section else 4.6)
        across, up = (_edges(centres) for centres in (chaos.plane.across, chaos.plane.up))
        _indicator(axes[0, 0], across, up, chaos)
        _exponent(axes[0, 1], across, up, chaos)
        if chaos.section:
            _crossings(axes[0, 2], across, up, chaos)
        for axis in axes[0]:
            axis.set(xlabel=_labelled(chaos.plane.names[0]), ylabel=_labelled(chaos.plane.names[1]))
            axis.grid(visible=False)
            axis.locator_params(nbins=5)
        drawn.suptitle(_title(chaos), fontsize="medium")
    return drawn


def _title(chaos: Chaos) -> str:
    """Return the title, the answer first."""
    words = chaos.verdict
    counts = [f"{np.count_nonzero(words == word)} {word}" for word in (CHAOTIC, REGULAR, UNDETERMINED, STOPPED) if np.any(words == word)]
    of = len(chaos.plane.cells)
    return f"{chaos.method} on {chaos.ivp.problem}, case {chaos.ivp.case}, to t = {chaos.t:g} s:\nof {of} starts {', '.join(counts)}"


def _labelled(name: str) -> str:
    return f"${name[0]}_{{{name[1:]}}}$"


def _edges(centres: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the edges of cells of one width."""
    half = (centres[1] - centres[0]) / 2
    return np.append(centres - half, centres[-1] + half)


def _indicator(axis: Any, across: NDArray[np.float64], up: NDArray[np.float64], chaos: Chaos) -> None:
    """Colour cells by <Y>."""
    words, values = chaos.verdict, chaos.megno
    none = np.isin(words, (STOPPED, EMPTY))
    bands = np.searchsorted(INDICATORS, np.where(none, 0.0, values), side="right")
    _cells(axis, across, up, np.where(none, "", "band"), bands, words, INDICATOR_COLOURS, (STOPPED, EMPTY))
    axis.set_title(r"growth factor $\langle Y \rangle$")
    names = [f"below {INDICATORS[0]:g}", *(f"{a:g} to {b:g}" for a, b in pairwise(INDICATORS)), f"above {INDICATORS[-1]:g}"]
    seen = np.unique(bands[~none]).tolist()
    _legend(axis, [(INDICATOR_COLOURS[k], names[k]) for k in seen] + _words(words, (STOPPED,)))


def _exponent(axis: Any, across: NDArray[np.float64], up: NDArray[np.float64], chaos: Chaos) -> None:
    """Colour chaotic cells by their exponent, and others by their verdict."""
    words, values = chaos.verdict, chaos.exponent
    is_chaotic = words == CHAOTIC
    most = float(np.max(values[is_chaotic])) if np.any(is_chaotic) else 1.0
    limits = most * np.arange(1, len(EXPONENT_COLOURS)) / len(EXPONENT_COLOURS)
    bands = np.searchsorted(limits, np.where(is_chaotic, values, 0.0), side="right")
    _cells(axis, across, up, np.where(is_chaotic, "band", ""), bands, words, EXPONENT_COLOURS, tuple(OTHERS))
    axis.set_title(r"exponent $\lambda$ [1/s]")
    ends = [0.0, *limits, most]
    named = [(colour, f"{a:.2g} to {b:.2g}") for colour, (a, b) in zip(EXPONENT_COLOURS, pairwise(ends), strict=True)]
    seen = np.unique(bands[is_chaotic]).tolist()
    _legend(axis, [named[k] for k in seen] + _words(words, (REGULAR, UNDETERMINED, STOPPED)))


def _crossings(axis: Any, across: NDArray[np.float64], up: NDArray[np.float64], chaos: Chaos) -> None:
    """Draw the section, each crossing in the colour of the verdict on its start."""
    section, verdicts = chaos.section, chaos.exponents.verdict
    assert section is not None
    named = []
    for word, colour in DOTS.items():
        some = verdicts[section.start] == word
        if np.any(some):
            axis.plot(section.across[some], section.up[some], ".", color=colour, markersize=1.2, markeredgewidth=0, rasterized=True)
            named.append((colour, word or STOPPED))
    axis.set(xlim=(across[0], across[-1]), ylim=(up[0], up[-1]))
    axis.set_title(f"section {_labelled(section.name)} $= {section.value:g}$, upwards")
    _legend(axis, named)


def _cells(
    axis: Any,
    across: NDArray[np.float64],
    up: NDArray[np.float64],
    kind: NDArray[np.str_],
    bands: NDArray[np.intp],
    words: NDArray[np.str_],
    colours: Sequence[str],
    others: Sequence[str],
) -> None:
    """Fill cells with the colour of their band, and those without one with that of their verdict."""
    classes = np.select([kind == "band", *(words == word for word in others)], [bands, *range(len(colours), len(colours) + len(others))])
    fill(axis, across, up, classes.astype(np.int64), [*colours, *(OTHERS[word] for word in others)])


def _words(words: NDArray[np.str_], some: Sequence[str]) -> list[tuple[str, str]]:
    """Return colours and names of verdicts that are there."""
    return [(OTHERS[word], word) for word in some if np.any(words == word)]


def _legend(axis: Any, named: Sequence[tuple[str, str]]) -> None:
    from matplotlib.patches import Patch

    handles = [Patch(facecolor=colour, edgecolor=QUIET, linewidth=0.5, label=label) for colour, label in named]
    place: dict[str, Any] = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.2), "ncols": 2, "frameon": False}
    axis.legend(handles=handles, handlelength=1.2, columnspacing=1.2, **place)
