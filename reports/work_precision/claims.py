"""Claims of the report on work against precision: winners, fronts, recommendations, tested before they are printed."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd

from daebench.pages.report.claims import require
from daebench.reports.work_precision.ivps import WANTED, Work
from daebench.reports.work_precision.numbers import Numbers
from daebench.studies.work_precision.recommend import CONSERVED, ROUND_OFF, recommended
from daebench.studies.work_precision.study import LEVELS, at_least, cheapest, front

MIDDLE = 1e-6
"""The accuracy of the sentences and of the overview."""


def check(numbers: Numbers) -> SimpleNamespace:
    """Return the numbers of the text; the first sentence that does not hold raises ClaimRefuted."""
    check_defects(numbers.defects)
    summaries = {work.key: check_work(work, numbers.runs[work.key]) for work in numbers.works}
    runs = pd.concat(numbers.runs.values())
    return SimpleNamespace(
        works=numbers.works,
        found=summaries,
        total=len(runs),
        failed=int((runs["failure"] != "").sum()),
        **tally([summary.winners for summary in summaries.values()]),
        cells=sum(len(summary.winners) for summary in summaries.values()),
        price={name: price([summary.advice for summary in summaries.values()], name) for name in CONSERVED if name != "nothing"},
        structure=structure(numbers),
        uncounted=[str(name) for name, method_runs in runs.groupby("method", sort=False) if method_runs["evaluations"].isna().all()],
    )


def check_defects(frame: pd.DataFrame) -> None:
    """Test that methods keep the two-form, or the structure matrix, if and only if they claim it."""
    for row in frame.dropna(subset=["defect"]).to_dict("records"):
        good = (row["defect"] <= ROUND_OFF) == row["claimed"]
        require(
            good, f"{row['method']} is {'' if row['claimed'] else 'not '}symplectic on {row['key']}", f"a defect of {row['defect']:.2e}"
        )


def check_work(work: Work, table: pd.DataFrame) -> SimpleNamespace:
    """Test runs, front and recommendations of a motion, and return the numbers of its section."""
    failed = table[table["failure"] != ""]
    shown = failed[[work.error, "seconds"]].notna().any(axis=1)
    require(not shown.any(), f"failed runs on {work.key} show no number", f"{int(shown.sum())} that do")
    best = {cost: front(table, work.error, cost) for cost in ("seconds", "evaluations")}
    for cost, runs in best.items():
        falls = np.all(np.diff(at_least(runs, work.error)) < 0) and np.all(np.diff(runs[cost]) >= 0)
        require(falls, f"along the front on {work.key} errors fall and {cost} grow", runs[[cost, work.error]].to_numpy().tolist())
    advice = recommended(table, work.error, "seconds", WANTED)
    for row in advice[advice["method"] != ""].to_dict("records"):
        what = f"{row['method']} reaches {row['level']:.0e} on {work.key}"
        require(row["error"] <= row["level"], what, f"an error of {row['error']:.2e}")
    first = winners(work, table)
    return SimpleNamespace(
        winners=first,
        phrases=phrases(first),
        front=best,
        advice=advice,
        failed=failed,
        keeps=keeps(work, table),
        bound=float(table[f"bound_{work.letter}"].max()),
        below=int((table[work.error] <= table[f"bound_{work.letter}"]).sum()),
    )


def winners(work: Work, table: pd.DataFrame) -> pd.DataFrame:
    """Return the cheapest method for each accuracy: by time, and by evaluations."""
    winners_by_cost = {cost: cheapest(table, work.error, cost, LEVELS).set_index("level") for cost in ("seconds", "evaluations")}
    joined = winners_by_cost["seconds"].join(winners_by_cost["evaluations"].add_suffix("_counted"))
    words = dict.fromkeys(("method_counted", "next_counted"), "")  # if no method that counts evaluations reaches the accuracy
    return joined.rename(columns={"evaluations_counted": "evaluations"}).fillna(words).reset_index()


def phrases(frame: pd.DataFrame) -> list[SimpleNamespace]:
    """Return the winners by time, one phrase for each range of accuracies with the same winner.

    Each has the first and last level, the method, the smallest and largest factor to the next method, the next methods, and the winners by
    evaluations if they differ, with whether one of them is the cheapest throughout.
    """
    stretches = []
    alone = frame["next"] == ""
    for _, rows in frame.groupby(((frame["method"] != frame["method"].shift()) | (alone != alone.shift())).cumsum()):
        method = str(rows["method"].iloc[0])
        counted = list(dict.fromkeys(rows["method_counted"][~rows["method_counted"].isin([method, ""])]))
        followers = [name for name in dict.fromkeys(rows["next"]) if name]
        span = {"first": rows["level"].iloc[0], "last": rows["level"].iloc[-1], "least": rows["ratio"].min(), "most": rows["ratio"].max()}
        throughout = len(counted) == 1 and bool((rows["method_counted"] == counted[0]).all())
        stretches.append(SimpleNamespace(method=method, next=followers, counted=counted, throughout=throughout, **span))
    return stretches


def keeps(work: Work, table: pd.DataFrame) -> pd.DataFrame:
    """Return one row per method: its smallest error, largest step size or tolerance that keeps the energy, and conserved quantities there.

    Columns method, knob, error, claimed, energy (as measured; NaN if it is kept with none), then of the most accurate run: energy_drift,
    g, Gv or casimirs, and integrals.
    """
    rows: list[dict[str, Any]] = []
    for name, runs in table[table["failure"] == ""].groupby("method", sort=False):
        best = runs.sort_values(work.error).iloc[0]
        row = {"method": name, "knob": best["knob"], "error": best[work.error], "claimed": bool(runs["claims_energy"].all())}
        row |= {"energy": runs["value"].where(runs["measured_energy"]).max(), "all": bool(runs["measured_energy"].all())}
        rows.append(row | {quantity: best.get(quantity, np.nan) for quantity in ("energy_error", "g", "Gv", "casimirs", "integrals")})
    return pd.DataFrame(rows)


def tally(frames: list[pd.DataFrame]) -> dict[str, Any]:
    """Return the method that is most often the cheapest by time, over all motions and accuracies, and how often the others are.

    Each of the ``others`` is a list of names and a number, the largest first: a method, or the schemes of all other compositions together.
    """
    (first, most), *counts = pd.concat(frames)["method"].value_counts().items()
    composed = {str(name): int(count) for name, count in counts if "/" in str(name)}
    composed = composed if len(composed) > 1 else {}
    others = [SimpleNamespace(names=[name], n=int(count), composed=False) for name, count in counts if name not in composed]
    if composed:
        schemes = list(dict.fromkeys(name.partition("/")[0] for name in composed))
        others.append(SimpleNamespace(names=schemes, n=sum(composed.values()), composed=True))
    return {"first": (str(first), int(most)), "others": sorted(others, key=lambda group: -group.n)}


def price(frames: list[pd.DataFrame], conserve: str) -> SimpleNamespace:
    """Return the cost of the cheapest run that conserves a quantity over that of the cheapest run, over motions and accuracies.

    Median and most are over the n cases with such a run, in ``free`` of which it costs nothing; cases counts all in which it could be
    required.
    """
    ratios, cases = [], 0
    for frame in frames:
        costs = frame.pivot_table(index="level", columns="conserve", values="price")
        if conserve in set(frame["conserve"]):
            cases += int(costs["nothing"].notna().sum())
        if conserve in costs:
            ratios += list((costs[conserve] / costs["nothing"]).dropna())
    require(all(ratio >= 1 for ratio in ratios), f"a run that conserves {conserve} is never cheaper than the cheapest run", ratios)
    worst = {"median": float(np.median(ratios or [np.nan])), "most": max(ratios, default=float("nan"))}
    return SimpleNamespace(cases=cases, n=len(ratios), free=ratios.count(1.0), **worst)


def structure(numbers: Numbers) -> SimpleNamespace:
    """Return how many pairs of method and motion claim energy without drift, and how many of these and of the others have none."""
    frames = [keeps(work, numbers.runs[work.key]).assign(key=work.key) for work in numbers.works]
    every = pd.concat(frames, ignore_index=True)
    claiming, others = every[every["claimed"]], every[~every["claimed"]]
    return SimpleNamespace(
        claiming=len(claiming),
        level=int(claiming["energy"].notna().sum()),
        others=len(others),
        others_level=int(others["energy"].notna().sum()),
        exceptions=list(dict.fromkeys(others["method"][others["energy"].notna()])),
    )
