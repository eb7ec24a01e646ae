"""What long runs tell: statistics of windows, over the members of an ensemble, and a verdict."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from daebench.diagnostics.energy import Drift, energy_drift
from daebench.diagnostics.random_walk import MEMBERS, Walk, random_walk
from daebench.studies.blocks import middles
from daebench.studies.checkpoint import Checkpoint
from daebench.studies.long_run import LongRun
from daebench.studies.starts import ROUNDINGS
from daebench.studies.windows import COUNT, LEAST, MEAN, MOST, centres, mean_square

if TYPE_CHECKING:
    import pandas as pd


def members_table(spec: LongRun, members: Mapping[int, Checkpoint]) -> "pd.DataFrame":
    """Return the windows of each member, a row each: t in seconds, samples, mean, rms, least and most of H(x) - H(x0)."""
    import pandas as pd

    found = []
    for number, kept in members.items():
        table = kept.windows.with_(kept.errors).table
        found.append(
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
    return pd.concat(found, ignore_index=True)


def windows_table(each: "pd.DataFrame") -> "pd.DataFrame":
    """Return the windows over all members that have as many samples of one as any.

    Columns t, members, mean over all samples, rms over all samples, spread, which is the standard deviation over members of their
    means and NaN for one member, and the largest modulus.
    """
    full = each[each["samples"] == each.groupby("window")["samples"].transform("max")]
    groups = full.assign(square=full["rms"] ** 2, largest=full[["least", "most"]].abs().max(axis=1)).groupby("window")
    table = groups.agg(t=("t", "first"), members=("member", "size"), mean=("mean", "mean"), square=("square", "mean"))
    table["rms"] = np.sqrt(table.pop("square"))
    return table.assign(spread=groups["mean"].std(ddof=1), largest=groups["largest"].max()).reset_index(drop=True)


def growth(spec: LongRun, members: Mapping[int, Checkpoint]) -> Walk | Drift | None:
    """Return how the energy error grows: of an ensemble of 16 or more a :class:`Walk`, of fewer the :class:`Drift` of their mean.

    Members that failed are left out; None if there is no other.
    """
    blocks = [kept.blocks.with_(kept.errors) for kept in members.values() if not kept.failure]
    if not blocks:
        return None
    length = max(each.length for each in blocks)
    means = [each.at(length) for each in blocks]
    error = np.array([each[: min(map(len, means))] for each in means])
    t = middles(error.shape[1], length) * spec.stride * spec.h
    first = abs(next(iter(members.values())).first)
    resolution = float(np.finfo(spec.precision).eps) * max(first, ROUNDINGS * float(np.max(np.abs(error))))
    if len(error) >= MEMBERS:
        return random_walk(t, error, resolution=resolution)
    return energy_drift(t, np.mean(error, axis=0), resolution=resolution)
