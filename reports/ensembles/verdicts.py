"""Whether runs stop and whether their energy drifts, by the fraction of the starts."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd

from daebench.diagnostics.drift import BOUNDED, DRIFTS, FAILED, KEPT
from daebench.draw.figures import GREEN, VERMILION, grid_of_axes, save
from daebench.pages.report.claims import require
from daebench.pages.report.tables import part
from daebench.reports.ensembles.errors import NAMES, bar, legend, mark_case
from daebench.reports.ensembles.motions import FRACTIONS, METHODS, MIDDLE, STRUCTURED

DECIDED = 0.5
"""A setting is decided if more than this fraction of its starts has a verdict; claims about trends need decided settings."""


def failed(runs: pd.DataFrame) -> pd.DataFrame:
    """Return one row per motion, method and cost with runs that stopped: fraction of starts, reasons, and the case's own outcome."""
    rows = []
    for (motion, method, fraction), some in runs.groupby(["motion", "method", "price"], sort=False):
        stopped = some[some["failure"] != ""]
        if len(stopped):
            why = stopped["failure"].value_counts()
            row = {"motion": motion, "method": method, "price": fraction, "h": some["h"].iloc[0], "part": len(stopped) / len(some)}
            rows.append(row | {"why": ", ".join(f"{reason} {count}" for reason, count in why.items()), "own": some["failure"].iloc[0]})
    return pd.DataFrame(rows, columns=["motion", "method", "price", "h", "part", "why", "own"])


def hidden(failures: pd.DataFrame) -> SimpleNamespace:
    """Return settings in which the case's own run reaches its end and others do not."""
    quiet = failures[failures["own"] == ""]
    return SimpleNamespace(
        n=len(quiet), of=len(failures), worst=None if quiet.empty else quiet.iloc[int(quiet["part"].to_numpy().argmax())]
    )


def trends(runs: pd.DataFrame) -> pd.DataFrame:
    """Return one row per motion, method and cost: fractions of the starts by verdict on the energy, and the verdict of the case."""
    rows = []
    for (motion, method, fraction), some in runs.groupby(["motion", "method", "price"], sort=False):
        parts = some["verdict"].value_counts(normalize=True)
        row = {"motion": motion, "method": method, "price": fraction, "h": some["h"].iloc[0], "own": some["verdict"].iloc[0]}
        row |= {"flat": float(parts.get(BOUNDED, 0) + parts.get(KEPT, 0)), "drifts": float(parts.get(DRIFTS, 0))}
        rows.append(row | {"failed": float(parts.get(FAILED, 0)), "most": str(parts.index[0]), "part": float(parts.iloc[0])})
    table = pd.DataFrame(rows)
    return table.assign(undetermined=1 - table["flat"] - table["drifts"] - table["failed"])


def agreement(verdicts: pd.DataFrame) -> SimpleNamespace:
    """Return in how many settings the case's own verdict is the most frequent one, for methods that keep the two-form and for others."""
    finest = part(verdicts, price=FRACTIONS[-1], failed=0)
    decided = finest[finest["undetermined"] < 1 - DECIDED]
    structured, others = (decided[decided["method"].isin(STRUCTURED) == flag] for flag in (True, False))
    require(
        (structured["drifts"] < structured["flat"]).all(),
        "with the smallest steps symplectic methods have more starts without drift than with one",
        structured[["motion", "method", "flat", "drifts"]].to_dict("records"),
    )
    require(
        (others["drifts"] > others["flat"]).all(),
        "with the smallest steps the other methods have more starts with a drift than without",
        others[["motion", "method", "flat", "drifts"]].to_dict("records"),
    )
    return SimpleNamespace(
        n=len(verdicts),
        differs=(verdicts["own"] != verdicts["most"]).sum(),
        astray=verdicts[(verdicts["own"] != verdicts["most"]) & (verdicts["failed"] == 0)].sort_values("part", ascending=False),
        structured=len(structured),
        of=finest["method"].isin(STRUCTURED).sum(),
        least_flat=(structured["flat"] / (structured["flat"] + structured["drifts"])).min(),
        false_drift=structured["drifts"].max(),
        others=len(others),
        least_drift=others["drifts"].min(),
    )


VERDICTS = {
    "flat": ("no drift", GREEN),
    "undetermined": ("undetermined", "#d9d9d9"),
    "drifts": ("drifts", VERMILION),
    "failed": ("stopped", "#000000"),
}
"""Fractions of the starts: their names and colours."""


def draw_verdicts(verdicts: Any, titles: dict[str, str], folder: Path) -> Path:
    """Draw the fraction of the starts with each verdict on the energy: one bar for each motion and method, at the middle cost."""
    rows = verdicts[verdicts["price"] == MIDDLE]
    figure, axes = grid_of_axes(4, 2, 7.0, sharey=True, sharex=True)
    for ax, (key, title) in zip(axes.flat, titles.items(), strict=False):
        for k, method in enumerate(METHODS):
            one = part(rows, motion=key, method=method).iloc[0]
            bar(ax, k, [(100 * one[verdict], color, "") for verdict, (_, color) in VERDICTS.items()])
            verdict_of_case = {"bounded": "flat", "kept": "flat"}.get(one["own"], one["own"])
            mark_case(ax, one, list(VERDICTS), verdict_of_case, k, 2.0)
        ax.set(
            title=title,
            yticks=range(len(METHODS)),
            yticklabels=NAMES,
            xlim=(0, 100),
            ylim=(len(METHODS) - 0.4, -0.6),
        )
        ax.grid(visible=False)
    for ax in (axes[-1, 0], axes[-2, 1]):
        ax.set_xlabel("fraction of the starts  [%]")
        ax.tick_params(labelbottom=True)
    empty = axes.flat[len(titles)]
    empty.axis("off")
    legend(empty, [(*verdict, "") for verdict in VERDICTS.values()], "start of the case", loc="center")
    return save(figure, folder, "verdicts", rows)
