"""Findings on an ensemble of long runs, as it is now, and their picture."""

import math
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from daebench.diagnostics.drift import Drift
from daebench.diagnostics.random_walk import Walk
from daebench.draw.bands import fill
from daebench.draw.figures import BLUE, QUIET, VERMILION, drawing, grid_of_axes, save, save_table
from daebench.runs.trajectory import Array
from daebench.studies.long.checkpoint import Checkpoint
from daebench.studies.long.ensemble import Ensemble
from daebench.studies.long.table import Share, growth, headline, members_table, sentence, share, windows_table

if TYPE_CHECKING:
    import pandas as pd


MANY = 16
"""Members from which on quantiles are drawn in place of each member."""

BELOW = 30.0
"""Factor below the least value over all members that is drawn: where a member's error changes sign it is as small as can be."""


def draw(out: Path, stem: str, title: str, member_windows: "pd.DataFrame", table: "pd.DataFrame") -> Path:
    """Write ``STEM.svg``, PNG and CSV of the windows over all members, and ``STEM-members.csv``; return the path of the SVG.

    Left is the rms error of each member and of all; right, where there are several, how far each member's mean is from the mean of all,
    and the spread. Of sixteen members or more there are bands that hold the middle 50 and 90 %. Thin lines have the slopes 1/2 of a
    random walk and 1 of a linear drift. The tables are those of :mod:`daebench.studies.long.table`, the title is written above.
    """
    several = int(table["members"].max()) > 1
    with drawing():
        figure, axes = grid_of_axes(1, 1 + several, 3.6, sharex=True)
        _panel(axes[0, 0], member_windows, member_windows["rms"], table["t"], table["rms"], VERMILION, "rms of all" if several else "rms")
        figure.suptitle(title, fontsize="medium")
        axes[0, 0].set(title="error from the start", ylabel="energy error H - H$_0$ [unit of H]")
        if several:
            distances = (member_windows["mean"] - member_windows["window"].map(table["mean"])).abs()
            _panel(axes[0, 1], member_windows, distances, table["t"], table["spread"], BLUE, "spread of members")
            axes[0, 1].set(title="distance from the mean of all", ylabel="means over windows [unit of H]")
        save_table(out / f"{stem}-members.csv", member_windows)
        return save(figure, out, stem, table)


def _panel(
    axis: Any, member_windows: "pd.DataFrame", values: "pd.Series[float]", t: "pd.Series[float]", all_: Any, color: str, label: str
) -> None:
    if member_windows["member"].nunique() >= MANY:
        _bands(axis, member_windows, values, color)
    else:
        for _, rows in values.where(values > 0).groupby(member_windows["member"]):
            axis.plot(member_windows["t"][rows.index], rows, color=QUIET, linewidth=0.5, alpha=0.6)
    axis.plot(t, all_.where(all_ > 0), color=color, marker="o", markersize=2.5, linewidth=1.6, label=label)
    _guides(axis, np.asarray(t, dtype=float), np.asarray(all_, dtype=float))
    axis.set(xscale="log", yscale="log", xlabel="time t [s]")
    positive = all_[all_ > 0]
    if len(positive):
        axis.set_ylim(bottom=positive.min() / BELOW)
    axis.legend(loc="best")


def _bands(axis: Any, member_windows: "pd.DataFrame", values: "pd.Series[float]", color: str) -> None:
    """Fill the area between quantiles over members in each window that has as many samples of one as of any."""
    full = member_windows["samples"] == member_windows.groupby("window")["samples"].transform("max")
    groups = values[full].groupby(member_windows["window"][full])
    t = member_windows[full].groupby("window")["t"].first()
    fill(axis, t, groups.quantile, color, of="members")


def _guides(axis: Any, t: Array, all_: Array) -> None:
    """Draw lines of slope 1/2 and 1 that end where the curve does."""
    ends = np.array([t[len(t) // 2], t[-1]])
    for slope, dashes in ((0.5, "--"), (1.0, ":")):
        name = "t$^{1/2}$" if slope == 0.5 else "t"
        axis.plot(ends, 1.6 * all_[-1] * (ends / ends[-1]) ** slope, color="black", linewidth=0.7, linestyle=dashes, label=name)


@dataclass(frozen=True)
class Findings:
    """Windows and verdict of what is kept of an ensemble."""

    ensemble: Ensemble
    """The ensemble, of which at least one member has begun."""
    members: dict[int, Checkpoint]
    """What is kept of its members."""

    @property
    def name(self) -> str:
        """The runs, in words."""
        spec = self.ensemble.spec
        return f"{spec.method}{', compensated' * spec.compensated} on {spec.problem}, case {spec.case}, h = {spec.h:g}"

    @cached_property
    def each(self) -> "pd.DataFrame":
        """Windows of each member."""
        return members_table(self.ensemble.spec, self.members)

    @cached_property
    def table(self) -> "pd.DataFrame":
        """Windows over all members."""
        return windows_table(self.each)

    @cached_property
    def growth(self) -> Walk | Drift | None:
        """How the energy error grows."""
        return growth(self.ensemble.spec, self.members)

    @property
    def verdict(self) -> str:
        """That in a sentence."""
        return sentence(self.growth, self.share)

    @property
    def share(self) -> Share:
        """Of which members, and up to when, that is."""
        return share(self.ensemble.spec, self.members, self.ensemble.members, self.ensemble.steps)

    @property
    def failures(self) -> dict[int, str]:
        """Why members stopped early."""
        return {number: checkpoint.failure for number, checkpoint in self.members.items() if checkpoint.failure}

    def write(self, out: Path) -> Path | None:
        """Write picture and tables to a folder, and return the path of the SVG; None where no member came to its first sample."""
        title = f"{headline(self.growth)}\n{self.name}"
        return draw(out, self.ensemble.stem, title, self.each, self.table) if len(self.each) else None

    def plain(self) -> dict[str, Any]:
        """Return everything as JSON has it."""
        spec = self.ensemble.spec
        return {
            **{name: value for name, value in spec.plain().items() if name != "member"},
            "steps": [checkpoint.done for checkpoint in self.members.values()],
            "seconds": [checkpoint.seconds for checkpoint in self.members.values()],
            "passages": [checkpoint.passages for checkpoint in self.members.values()],
            "failures": self.failures,
            "growth": None if self.growth is None else asdict(self.growth),
            "told_from": asdict(self.share) | {"until": None if math.isnan(self.share.until) else self.share.until},
            "exponent": getattr(self.growth, "exponent", None),
            "standard_error": getattr(self.growth, "exponent_error", None),
            "exponent_low": getattr(self.growth, "exponent_low", None),
            "exponent_high": getattr(self.growth, "exponent_high", None),
            "verdict": self.verdict,
            "windows": self.table.to_dict("records"),
        }
