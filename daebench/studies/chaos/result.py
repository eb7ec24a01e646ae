"""Results of a plane of starts, exponents, indicators and verdicts cell by cell, and their picture."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from daebench.diagnostics.lyapunov import (
    CHAOTIC,
    CONFIDENCE,
    EXPONENTIAL,
    QUASI_PERIODIC,
    REGULAR,
    TOLD,
    UNDETERMINED,
    Exponents,
    exponents,
)
from daebench.draw.figures import QUIET, drawing, grid_of_axes
from daebench.draw.tiles import fill
from daebench.methods.ensemble.tangents import TangentGrowth
from daebench.runs.result import Result
from daebench.starts.box import coordinates
from daebench.studies.chaos.plane import Plane, Section
from daebench.systems.lazily import matplotlib
from daebench.systems.lazily import pandas as pd

if TYPE_CHECKING:
    from matplotlib.figure import Figure


EMPTY, STOPPED = "empty", "stopped"
"""What a cell is that has no start, or whose run did not come to its end."""


@dataclass(frozen=True)
class Chaos(Result):
    """Lyapunov exponents over a plane of starts.

    Parameters
    ----------
    plane : Plane
        The starts.
    method : str
        Name in the grammar of methods.
    growth : TangentGrowth
        Growth of a tangent vector along each.
    steps : int
        Steps of each run.
    seed : int
        Seed of the directions of the vectors.
    section : Section, optional
        Crossings of a surface, by some of the motions.
    """

    stem: ClassVar[str] = "chaos"
    fails_if: ClassVar[str] = "a run stops early"

    plane: Plane
    method: str
    growth: TangentGrowth
    steps: int
    seed: int
    section: Section | None = None

    @property
    def ivp(self) -> Any:
        """The problem, with its parameters."""
        return self.plane.members.ivp

    @property
    def t(self) -> float:
        """Time of each run, s."""
        return float(self.steps * self.plane.members.h)

    @cached_property
    def exponents(self) -> Exponents:
        """Exponents, indicators and verdicts of the starts, see :func:`daebench.diagnostics.lyapunov.exponents`."""
        return exponents(self.growth.growth, self.growth.interval)

    @property
    def exponent(self) -> NDArray[np.float64]:
        """Largest Lyapunov exponents, 1/s, shape(r, c), rows going up; NaN where there is none."""
        return np.asarray(self.plane.spread(self.exponents.exponent))

    @property
    def megno(self) -> NDArray[np.float64]:
        """Mean exponential growth factors <Y>, shape(r, c)."""
        return np.asarray(self.plane.spread(self.exponents.megno))

    @property
    def verdict(self) -> NDArray[np.str_]:
        """Verdicts, shape(r, c): chaotic, regular, undetermined, stopped or empty.

        Regular means that no exponential growth was observed in this time: an exponent below about 10/t cannot be distinguished from zero.
        """
        words = self.exponents.verdict
        return np.asarray(self.plane.spread(np.where(words == "", STOPPED, words), EMPTY))

    @property
    def table(self) -> "pd.DataFrame":
        """One row per cell: coordinates of the plane, start, exponent with its interval, <Y>, verdict, and the reason for an empty cell."""
        plane, exponents = self.plane, self.exponents
        first, second = plane.names
        table: dict[str, Any] = {"across": np.tile(plane.across, len(plane.up)), "up": np.repeat(plane.up, len(plane.across))}
        start = np.concatenate(plane.members.start, axis=1)
        for name, column in zip(coordinates(self.ivp), start.T, strict=True):
            table[name] = plane.spread(column).ravel()
        for name in ("exponent", "low", "high", "megno"):
            table[name] = plane.spread(getattr(exponents, name)).ravel()
        reasons = plane.reasons.astype("U60")
        reasons[plane.cells] = [self.growth.reason(i) for i in range(len(plane.cells))]
        frame = pd.DataFrame(table | {"verdict": self.verdict.ravel(), "why": reasons})
        return frame.drop(columns=[first, second]).rename(columns={"across": first, "up": second})

    def summary(self) -> dict[str, Any]:
        """Return a summary of the plane, for text and JSON."""
        plane, exponents = self.plane, self.exponents
        counts = Counter(self.verdict.ravel().tolist())
        chaotic = exponents.verdict == CHAOTIC
        stopped = [self.growth.reason(int(i)) for i in np.flatnonzero(self.growth.status)]
        reasons = Counter([*plane.reasons[plane.reasons != ""].tolist(), *stopped])
        return {
            **self.posed,
            "method": self.method,
            "h": float(plane.members.h),
            "steps": self.steps,
            "t": self.t,
            "starts": plane.about,
            "seed": self.seed,
            "plane": {name: [float(x[0]), float(x[-1])] for name, x in zip(plane.names, (plane.across, plane.up), strict=True)},
            "section": None if self.section is None else {self.section.name: self.section.value},
            "crossings": None if self.section is None else len(self.section.start),
            "cells": plane.reasons.size,
            **{word: counts.get(word, 0) for word in (CHAOTIC, REGULAR, UNDETERMINED, STOPPED, EMPTY)},
            "reasons": dict(reasons.most_common()),
            "exponent": self._largest(),
            "median": float(np.median(exponents.exponent[chaotic])) if np.any(chaotic) else None,
            "confidence": CONFIDENCE,
        }

    def plot(self) -> "Figure":
        """Return the picture of the plane."""
        return figure(self)

    @property
    def origin(self) -> dict[str, str]:
        """How the cells were made."""
        return {"Method": self.method, "Starts": self.plane.about, "Seed": str(self.seed)}

    @property
    def status(self) -> int:
        """1 if a run stopped early."""
        return int(STOPPED in self.verdict)

    def printed(self) -> Iterator[str | Mapping[str, Any]]:
        """Yield the summary, the largest exponent with its interval, and what a regular start does not show."""
        summary = self.summary()
        left_out = ("exponent", "plane", "reasons", "median", "confidence")
        yield {name: value for name, value in summary.items() if name not in left_out} | {"reasons": summary["reasons"] or None}
        if largest := summary["exponent"]:
            place = ", ".join(f"{name} = {value:.4g}" for name, value in largest["start"].items())
            ends = f"{100 * CONFIDENCE:.0f} % interval {largest['low']:.3g} to {largest['high']:.3g}"
            yield f"largest exponent {largest['value']:.4g} 1/s ({ends}), {largest['verdict']}, at {place}"
        if summary["median"] is not None:
            yield f"median exponent of chaotic starts {summary['median']:.4g} 1/s"
        if summary[REGULAR]:
            least = f"an exponent below about {TOLD / self.t:.2g} 1/s cannot be distinguished from zero"
            yield f"regular: no exponential growth in {self.t:g} s; {least}"
        for i in self.growth.status.nonzero()[0][:1]:
            yield f"first that stopped: {self.growth.sentence(int(i))}"

    def _largest(self) -> dict[str, Any] | None:
        """Return the largest exponent of the chaotic starts with its interval and its start; of all where none is chaotic."""
        plane, exponents = self.plane, self.exponents
        chosen = np.where(exponents.verdict == CHAOTIC, exponents.exponent, -np.inf)
        if not np.any(np.isfinite(chosen)):
            chosen = np.where(np.isfinite(exponents.exponent), exponents.exponent, -np.inf)
        i = int(np.argmax(chosen))
        if not np.isfinite(chosen[i]):
            return None
        row, column = divmod(int(plane.cells[i]), len(plane.across))
        place = dict(zip(plane.names, (float(plane.across[column]), float(plane.up[row])), strict=True))
        numbers = {"value": exponents.exponent[i], "low": exponents.low[i], "high": exponents.high[i], "megno": exponents.megno[i]}
        return {name: float(x) for name, x in numbers.items()} | {"verdict": str(exponents.verdict[i]), "start": place}


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
    handles = [matplotlib.patches.Patch(facecolor=colour, edgecolor=QUIET, linewidth=0.5, label=label) for colour, label in named]
    place: dict[str, Any] = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.2), "ncols": 2, "frameon": False}
    axis.legend(handles=handles, handlelength=1.2, columnspacing=1.2, **place)
