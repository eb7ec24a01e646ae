"""Claims of the report on ensembles: results from the start of a case, compared with results from all starts of its energy."""

from types import SimpleNamespace

import numpy as np
import pandas as pd

from daebench.diagnostics.drift import BOUNDED, DRIFTS, FAILED, KEPT
from daebench.pages.report.claims import require
from daebench.reports.ensembles.motions import FRACTIONS, METHODS, STRUCTURED
from daebench.reports.ensembles.numbers import Numbers

TWICE = 2.0
"""An error differs from the median if it is more than this factor above or below it."""

LOW, HIGH = 0.05, 0.95
"""Quantiles that enclose nine tenths of the starts."""

DECIDED = 0.5
"""A setting is decided if more than this fraction of its starts has a verdict; claims about trends need decided settings."""

ROUND_OFF = 1e-12
"""Smaller errors are round-off, and are not compared."""


def check(numbers: Numbers) -> SimpleNamespace:
    """Return the numbers of the text; the first sentence that does not hold raises ClaimRefuted."""
    sizes, first, verdicts, failures = errors(numbers.runs), winners(numbers.runs), trends(numbers.runs), failed(numbers.runs)
    titles = {motion.key: motion.title for motion in numbers.motions}
    return SimpleNamespace(
        titles=titles,
        starts=int(numbers.runs["start"].max()) + 1,
        total=len(numbers.runs),
        errors=spread(sizes),
        sizes=sizes,
        first=order(first),
        winners=first,
        failures=failures,
        hidden=hidden(failures),
        trends=verdicts,
        verdict=agreement(verdicts),
        price=price(numbers.alone),
        distributions=numbers.starts,
    )


def errors(runs: pd.DataFrame) -> pd.DataFrame:
    """Return one row per motion, method and cost: the case's own error, quantiles over all starts, and the fraction with less error."""
    rows = []
    for (motion, method, fraction), some in runs.groupby(["motion", "method", "price"], sort=False):
        size = some["size"].to_numpy()
        own, (low, median, high) = size[0], np.quantile(size, (LOW, 0.5, HIGH), method="inverted_cdf")
        rows.append({"motion": motion, "method": method, "price": fraction, "h": some["h"].iloc[0], "own": own})
        rows[-1] |= {"low": low, "median": median, "high": high, "rank": float(np.mean(size < own)), "largest": float(np.max(size))}
        rows[-1]["stopped"] = float(np.mean(some["failure"] != ""))
    return pd.DataFrame(rows)


def spread(sizes: pd.DataFrame) -> SimpleNamespace:
    """Return how far the case's own error differs from those of other starts, if all are known and above round-off."""
    known = sizes[np.isfinite(sizes["largest"]) & (sizes["low"] > ROUND_OFF)]
    off = known["own"] / known["median"]
    range_of = known["high"] / known["low"]
    worst = known.iloc[int((known["high"] / known["own"]).to_numpy().argmax())]
    require(bool((known["low"] <= known["median"]).all() and (known["median"] <= known["high"]).all()), "quantiles are in order", known)
    return SimpleNamespace(
        n=len(known),
        off=int(((off > TWICE) | (off < 1 / TWICE)).sum()),
        spread=float(range_of.median()),
        most=float(range_of.max()),
        worst=worst,
        factor=float(worst["high"] / worst["own"]),
        over=int((known["high"] > TWICE * known["own"]).sum()),
    )


def winners(runs: pd.DataFrame) -> pd.DataFrame:
    """Return one row per motion and cost: the fraction of starts from which each method is best, and the best from the case's start.

    Runs that stopped have no error; a start from which all stop has no winner, and fractions are of the starts with a winner.
    """
    rows = []
    for (motion, fraction), some in runs.groupby(["motion", "price"], sort=False):
        sizes = np.stack([some.loc[some["method"] == method, "size"].to_numpy(dtype=float) for method in METHODS], axis=1)
        best = np.where(np.isfinite(sizes).any(axis=1), np.argmin(sizes, axis=1), -1)
        parts = np.array([np.mean(best[best >= 0] == k) if (best >= 0).any() else 0.0 for k in range(len(METHODS))])
        most = int(np.argmax(parts))
        row = {"motion": motion, "price": fraction, "own": METHODS[best[0]] if best[0] >= 0 else "", "most": METHODS[most]}
        row |= {"part": parts[most], "own_part": parts[best[0]] if best[0] >= 0 else 0.0}
        row |= {"error": float(np.sqrt(parts[most] * (1 - parts[most]) / max(1, (best >= 0).sum()))), "none": float(np.mean(best < 0))}
        rows.append(row | dict(zip(METHODS, parts, strict=True)))
    table = pd.DataFrame(rows)
    totals = table[list(METHODS)].sum(axis=1)
    require(np.all(np.abs(totals - 1) < 1e-12), "fractions of the starts add up to one", totals.tolist())
    return table


def order(first: pd.DataFrame) -> SimpleNamespace:
    """Return how often the best method from the start of the case is the best from the most starts, and from how many."""
    wrong = first[first["own"] != first["most"]]
    return SimpleNamespace(
        n=len(first),
        wrong=wrong,
        least=float(first["part"].min()),
        unanimous=int((first["part"] == 1).sum()),
        divided=first.iloc[int(first["part"].to_numpy().argmin())],
    )


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
    finest = verdicts[(verdicts["price"] == FRACTIONS[-1]) & (verdicts["failed"] == 0)]
    decided = finest[finest["undetermined"] < 1 - DECIDED]
    structured, others = (decided[decided["method"].isin(STRUCTURED) == flag] for flag in (True, False))
    require(
        bool((structured["drifts"] < structured["flat"]).all()),
        "with the smallest steps symplectic methods have more starts without drift than with one",
        structured[["motion", "method", "flat", "drifts"]].to_dict("records"),
    )
    require(
        bool((others["drifts"] > others["flat"]).all()),
        "with the smallest steps the other methods have more starts with a drift than without",
        others[["motion", "method", "flat", "drifts"]].to_dict("records"),
    )
    return SimpleNamespace(
        n=len(verdicts),
        differs=int((verdicts["own"] != verdicts["most"]).sum()),
        astray=verdicts[(verdicts["own"] != verdicts["most"]) & (verdicts["failed"] == 0)].sort_values("part", ascending=False),
        structured=len(structured),
        of=int(finest["method"].isin(STRUCTURED).sum()),
        least_flat=float((structured["flat"] / (structured["flat"] + structured["drifts"])).min()),
        false_drift=float(structured["drifts"].max()),
        others=len(others),
        least_drift=float(others["drifts"].min()),
    )


def price(alone: pd.DataFrame) -> SimpleNamespace:
    """Return the time of a single start over that of one of many."""
    require(bool((alone["starts"] > 1).all()), "one start of many costs less than a single start", alone["starts"].tolist())
    return SimpleNamespace(least=float(alone["starts"].min()), most=float(alone["starts"].max()))
