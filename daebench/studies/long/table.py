"""Tables of long runs, statistics of windows over the members of an ensemble, the verdict in a sentence, and their picture."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from daebench.compiler.number_types import number_type
from daebench.diagnostics.drift import Drift, between
from daebench.diagnostics.energy import energy_drift
from daebench.diagnostics.integrals import energy_rounding
from daebench.diagnostics.random_walk import CONFIDENCE, MEMBERS, Walk, random_walk
from daebench.draw.bands import fill
from daebench.draw.figures import BLUE, QUIET, VERMILION, drawing, grid_of_axes
from daebench.runs.trajectory import Array
from daebench.studies.long.run import ROUNDINGS, Checkpoint, LongRun
from daebench.studies.long.windows import COUNT, EDGES, LEAST, MEAN, MOST, centres, mean_square, middles
from daebench.systems.lazily import pandas as pd

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FAR_BEHIND = 0.5
"""A member that has less than this part of the samples of the longest one is left out of the verdict until it has caught up."""


@dataclass(frozen=True)
class Share:
    """Of which members, and up to when, a verdict is told."""

    asked: int
    """Members of the ensemble."""
    begun: int
    """Those that have begun."""
    failed: int
    """Those that stopped early, which are left out."""
    told: int
    """Those that the verdict is of."""
    until: float
    """Time in seconds up to which all of these are; NaN where there is none."""
    whole: bool
    """Whether these are all members, and each at its end."""


def counted_members(members: Mapping[int, Checkpoint]) -> dict[int, Checkpoint]:
    """Return the members that a verdict is told from: those that have a sample, did not fail, and are not far behind the longest."""
    sound = {number: checkpoint for number, checkpoint in members.items() if not checkpoint.failure and samples(checkpoint)}
    most = max(map(samples, sound.values()), default=0)
    return {number: checkpoint for number, checkpoint in sound.items() if samples(checkpoint) >= FAR_BEHIND * most}


def samples(checkpoint: Checkpoint) -> int:
    """Return how many samples a member has."""
    return checkpoint.windows.samples + len(checkpoint.waiting)


def share(spec: LongRun, members: Mapping[int, Checkpoint], asked: int, steps: int) -> Share:
    """Return of which members, of so many that are asked for with so many steps each, the verdict is told."""
    verdict_members = counted_members(members)
    until = min((samples(checkpoint) * spec.stride * spec.h for checkpoint in verdict_members.values()), default=float("nan"))
    whole = len(verdict_members) == asked and all(checkpoint.done >= steps for checkpoint in verdict_members.values())
    return Share(asked, len(members), sum(bool(checkpoint.failure) for checkpoint in members.values()), len(verdict_members), until, whole)


def members_table(spec: LongRun, members: Mapping[int, Checkpoint]) -> "pd.DataFrame":
    """Return the windows of each member, a row each: t in seconds, samples, mean, rms, least and most of H(x) - H(x0)."""
    frames = []
    for number, checkpoint in members.items():
        table = checkpoint.windows.with_(checkpoint.errors).table
        frames.append(
            pd.DataFrame(
                {
                    "member": number,
                    "window": np.arange(len(table)),
                    "t": centres(table) * spec.stride * spec.h,
                    "samples": table[:, COUNT].astype(int),
                    "mean": table[:, MEAN],
                    "rms": np.sqrt(mean_square(table)),
                    "least": table[:, LEAST],
                    "most": table[:, MOST],
                }
            )
        )
    return pd.concat(frames, ignore_index=True)


def windows_table(member_windows: "pd.DataFrame") -> "pd.DataFrame":
    """Return the windows over all members that have as many samples of one as any.

    Columns t, members, mean over all samples, rms over all samples, spread, which is the standard deviation over members of their
    means and NaN for one member, and the largest modulus.
    """
    full = member_windows[member_windows["samples"] == member_windows.groupby("window")["samples"].transform("max")]
    groups = full.assign(square=full["rms"] ** 2, largest=full[["least", "most"]].abs().max(axis=1)).groupby("window")
    table = groups.agg(t=("t", "first"), members=("member", "size"), mean=("mean", "mean"), square=("square", "mean"))
    table["rms"] = np.sqrt(table.pop("square"))
    return table.assign(spread=groups["mean"].std(ddof=1), largest=groups["largest"].max()).reset_index(drop=True)


def common_windows(spec: LongRun, members: Iterable[Checkpoint]) -> tuple[Array, Array]:
    """Return the centres t in seconds of the windows that all members have filled alike, shape(w,), and their means, shape(N, w)."""
    tables = [checkpoint.windows.with_(checkpoint.errors).table for checkpoint in members]
    fewest = min(map(len, tables))
    counts = np.array([table[:fewest, COUNT] for table in tables])
    alike = np.all(counts == np.diff(EDGES)[:fewest], axis=0)
    alike[-1] |= np.all(counts[:, -1] == counts[0, -1])
    means = np.array([table[:fewest, MEAN] for table in tables])[:, alike]
    return centres(tables[0][:fewest])[alike] * spec.stride * spec.h, means


def growth(spec: LongRun, members: Mapping[int, Checkpoint]) -> Walk | Drift | None:
    """Return how the energy error grows: of an ensemble of 16 or more a :class:`Walk`, of fewer the :class:`Drift` of their mean.

    It is that of the members of :func:`counted_members`, up to where the shortest of them is; None if there is none.
    """
    blocks = [checkpoint.blocks.with_(checkpoint.errors) for checkpoint in counted_members(members).values()]
    length = max((member_blocks.length for member_blocks in blocks), default=1)
    means = [member_blocks.at(length) for member_blocks in blocks]
    common = min(map(len, means), default=0)
    if not common:
        return None
    error = np.array([member_means[:common] for member_means in means])
    t = middles(error.shape[1], length) * spec.stride * spec.h
    first, eps = abs(next(iter(members.values())).first), number_type(spec.precision).spacing
    resolution = eps * max(first, ROUNDINGS * float(np.max(np.abs(error))))
    if len(error) >= MEMBERS:
        windows = common_windows(spec, counted_members(members).values())
        return random_walk(t, error, resolution=resolution, rounding=energy_rounding(spec.ivp, eps), windows=windows)
    return energy_drift(t, np.mean(error, axis=0), resolution=resolution)


LITTLE = "undetermined: there are too few samples; take more steps."


def sentence(growth: Walk | Drift | None, share: Share) -> str:
    """Return the sentence on a verdict, and of which members it is where it is not of all at their ends.

    There are two standard errors on either side of each number; slopes are in units of H a second.
    """
    if share.begun and share.failed == share.begun:
        begun = f"{share.begun} of {share.asked} members have begun, and every one of them"
        return f"undetermined: {'every member' if share.begun == share.asked else begun} stopped early."
    parts = [_verdict(growth, share), *([] if share.whole else [_told(share)])]
    return " ".join(part for part in parts if part)


def _verdict(growth: Walk | Drift | None, share: Share) -> str:
    if growth is None or math.isnan(growth.slope):
        return LITTLE
    return _of_ensemble(growth) if isinstance(growth, Walk) else _of_few(growth, share)


def _told(share: Share) -> str:
    """Return up to when and from how many members the verdict is told, and what becomes of the others."""
    behind = share.begun - share.failed - share.told
    numbers = {
        "stopped early": share.failed,
        "far behind" if share.told else "before the first sample": behind,
        "not begun": share.asked - share.begun,
    }
    left = ", ".join(f"{number} of {share.asked} {what}" for what, number in numbers.items() if number)
    coverage = f"Told to t = {share.until:.4g} from {share.told} of {share.asked} members" if share.told else "Told from no member"
    return f"{coverage}{f'; left out: {left}' if left else ''}."


def _of_ensemble(walk: Walk) -> str:
    bound = f"their mean changes by at most {walk.change_bound:.2g} over the time"
    if walk.verdict == "drifts":
        apart = f"{_spread(walk)}, so each member has its own drift; {bound}." if walk.law == "apart" else f"{_law(walk)}; {_spread(walk)}."
        return f"drifts: {apart}"
    sentences = {
        "kept": "kept: no member has an error above rounding.",
        "bounded": f"bounded: {_spread(walk)}, and {bound}.",
        "random walk": f"random walk: {_spread(walk)}; {bound}.",
        "undetermined": f"undetermined: {walk.reason}; {_spread(walk)}; take more steps or more members.",
    }
    return sentences[walk.verdict]


def headline(growth: Walk | Drift | None) -> str:
    """Return the answer in a few words, with the exponent of the spread and its interval where there is one."""
    if growth is None:
        return "undetermined"
    brief = growth.verdict if growth.verdict != "drifts" else f"drifts, {growth.law}"
    if isinstance(growth, Walk) and not math.isnan(growth.exponent):
        spread = _around(growth.exponent, growth.exponent_error).replace("+-", "$\\pm$")
        return f"{brief}: spread ~ t^({spread}), 95 %, over {growth.decades:.1f} decades, {growth.members} members"
    return brief


def _law(growth: Walk | Drift) -> str:
    """Return the law of a drift of the mean, and how much it is."""
    of = f"the mean of {growth.members} members" if isinstance(growth, Walk) else "the energy"
    if growth.law == "saturated":
        within = "" if math.isnan(growth.level_low) else f" ({between(growth.level_low, growth.level_high)}, 95 %)"
        return f"{of} saturated at {growth.level:.3g}{within}"
    if growth.law == "linear":
        return f"linear: {of} drifts by {_around(growth.slope, growth.slope_error)} a second"
    return f"{growth.law}: {of} changes by {growth.change:.3g} over the time"


def _spread(walk: Walk) -> str:
    """Return how the members part."""
    if not math.isnan(walk.exponent):
        return f"the spread of {walk.members} members grows as t^({_around(walk.exponent, walk.exponent_error)}), 95 %"
    if walk.spreads:
        return f"the {walk.members} members spread beyond round-off too late to measure its growth"
    return f"the {walk.members} members do not spread beyond round-off"


def _of_few(drift: Drift, share: Share) -> str:
    interval = between(drift.exponent_low, drift.exponent_high)
    power = "" if math.isnan(drift.exponent) else f", as t^({drift.exponent:.3g}), 95 %: {interval}"
    sentences = {
        "kept": "kept: the error is no more than rounding",
        "bounded": f"bounded: the mean changes by at most {drift.change_bound:.2g} over the time",
        "drifts": f"drifts: {_law(drift)}{power if drift.law in ('linear', 'power') else ''}",
        "undetermined": f"undetermined: {drift.reason}",
        "failed": f"failed: {drift.reason}",
    }
    few = f", of which there are {share.told} so far" if share.asked >= MEMBERS else ""
    return f"{sentences[drift.verdict]}; a random walk can be identified from {MEMBERS} members or more{few}."


def _around(value: float, error: float) -> str:
    """Return a number and its interval of 95 %, the error with two digits and the number with as many places."""
    wide = CONFIDENCE * error
    if not (math.isfinite(wide) and wide > 0):
        return f"{value:.3g}"
    places = 1 - math.floor(math.log10(wide))
    if 0 <= places <= 4:
        return f"{value:.{places}f} +- {wide:.{places}f}"
    power = math.floor(math.log10(max(abs(value), wide)))
    digits = max(0, places + power)
    return f"({value / 10.0**power:.{digits}f} +- {wide / 10.0**power:.{digits}f})e{power:+03d}"


MANY = 16
"""Members from which on quantiles are drawn in place of each member."""

BELOW = 30.0
"""Factor below the least value over all members that is drawn: where a member's error changes sign it is as small as can be."""


def figure(title: str, member_windows: "pd.DataFrame", table: "pd.DataFrame") -> "Figure":
    """Return the picture of an ensemble of long runs.

    Left is the rms error of each member and of all; right, where there are several, how far each member's mean is from the mean of all,
    and the spread. Of sixteen members or more there are bands that hold the middle 50 and 90 %. Thin lines have the slopes 1/2 of a
    random walk and 1 of a linear drift. The tables are those of :mod:`daebench.studies.long.table`, the title is written above.
    """
    several = int(table["members"].max()) > 1
    with drawing():
        drawn, axes = grid_of_axes(1, 1 + several, 3.6, sharex=True)
        _panel(axes[0, 0], member_windows, member_windows["rms"], table["t"], table["rms"], VERMILION, "rms of all" if several else "rms")
        drawn.suptitle(title, fontsize="medium")
        axes[0, 0].set(title="error from the start", ylabel="energy error H - H$_0$ [unit of H]")
        if several:
            distances = (member_windows["mean"] - member_windows["window"].map(table["mean"])).abs()
            _panel(axes[0, 1], member_windows, distances, table["t"], table["spread"], BLUE, "spread of members")
            axes[0, 1].set(title="distance from the mean of all", ylabel="means over windows [unit of H]")
    return drawn


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
