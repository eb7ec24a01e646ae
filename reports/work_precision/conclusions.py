"""Conclusions of the report on work against precision: winners, fronts and recommendations, tested before they are printed; tables."""

from collections.abc import Mapping, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup

from daebench.pages.report import NONE, THIN, count, number, power_of_ten
from daebench.pages.report.claims import require
from daebench.pages.report.tables import Of, Table, code, long, part, text, tiny
from daebench.reference.keep import store
from daebench.reference.keep.form import DATA
from daebench.reports.work_precision.works import COARSE, WANTED, Numbers, Work
from daebench.studies.work_precision.study import CONSERVED, LEVELS, ROUND_OFF, at_least, cheapest, costs_at, front, recommended

MIDDLE = 1e-6
"""The accuracy of the sentences and of the overview."""

CURVES = 6
"""Most curves of the diagram that is seen first."""


def check(numbers: Numbers) -> SimpleNamespace:
    """Return the numbers of the text; the first sentence that does not hold raises ClaimRefuted."""
    check_defects(numbers.defects)
    summaries = {work.key: check_work(work, numbers.runs[work.key]) for work in numbers.works}
    runs, certified = pd.concat(numbers.runs.values()), store.names(DATA)
    return SimpleNamespace(
        works=numbers.works,
        references=len(certified),
        unused=len({*certified} - {f"{work.problem}-{work.case}" for work in numbers.works}),
        coarse={method: tol for method, tol in COARSE.items() if method in set(runs["method"])},
        found=summaries,
        total=len(runs),
        failed=(runs["failure"] != "").sum(),
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
        curves=curves(table, work.error, best["seconds"]),
        advice=advice,
        failed=failed,
        keeps=keeps(work, table),
        bound=table[f"bound_{work.letter}"].max(),
        below=(table[work.error] <= table[f"bound_{work.letter}"]).sum(),
    )


def curves(table: pd.DataFrame, error: str, best: pd.DataFrame) -> list[str]:
    """Return the methods that are seen first: RATTLE, the cheapest IDA, and those that are most often on the front, or next to it."""
    names = table["method"]
    by_cost = list(costs_at(table, error, "seconds", MIDDLE))
    solvers = [name for name in [*by_cost, *names] if name.startswith("ida:")]
    first = [*names[names == "rattle"], *solvers[:1], *best["method"].value_counts().index, *by_cost]
    return list(dict.fromkeys(first))[:CURVES]


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
    others = [SimpleNamespace(names=[name], n=count, composed=False) for name, count in counts if name not in composed]
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
        level=claiming["energy"].notna().sum(),
        others=len(others),
        others_level=others["energy"].notna().sum(),
        exceptions=list(dict.fromkeys(others["method"][others["energy"].notna()])),
    )


TIMES_COST = "times<small>the cost</small>"
WORDS = CONSERVED | {"two_form": "two-form", "casimirs": "Casimir functions", "constraints": "constraints"}


def setting(resolution: str, value: float) -> Markup:
    """Return a step size or tolerance with its name: h = 1/64, tol = 10^-9."""
    if resolution == "tol":
        return Markup("tol{0}={0}{1}").format(THIN, power_of_ten(value))
    parts = round(1 / value)
    shown = f"1/{parts}" if parts > 1 and abs(parts * value - 1) < 1e-12 else number(value, 3)
    return Markup("<i>h</i>{0}={0}{1}").format(THIN, shown)


def milliseconds(seconds: float) -> Markup:
    """Return a time in milliseconds."""
    return number(1e3 * seconds)


def times(ratio: float) -> Markup:
    """Return a factor; an en dash where there is no second method."""
    return Markup("{}{}{}").format(number(ratio), THIN, "\N{MULTIPLICATION SIGN}") if ratio == ratio else Markup(NONE)


def named(value: str) -> Markup:
    """Return a method's name as HTML, an en dash for none."""
    return code(value) if value else Markup(NONE)


def chosen(row: Any) -> Markup:
    """Return a method with its step size or tolerance; an en dash where there is none."""
    if not isinstance(row, dict) or not row["method"]:
        return Markup(NONE)
    return Markup("{}<br>{}").format(code(row["method"]), setting(row["knob"], row["value"]))


def verdict(row: Mapping[Any, Any]) -> Markup:
    """Return whether a method claims energy without drift, and from which step size or tolerance on none was measured."""
    if not row["claimed"]:
        return Markup("not claimed")
    if row["all"]:
        return Markup("yes")
    return Markup("from {}").format(setting(row["knob"], row["energy"])) if row["energy"] == row["energy"] else Markup("no")


SETTING = (Of(lambda resolution, value: setting(resolution or "h", value), "knob", "value"), "with")


def summary_table(works: Sequence[Work], summaries: Mapping[str, SimpleNamespace]) -> Table:
    """Return the recommended method on each motion at one accuracy, with a column for each conserved quantity."""
    advised = {work.key: part(summaries[work.key].advice, level=MIDDLE).set_index("conserve").to_dict("index") for work in works}
    rows = [{"motion": work.title, "t": work.t_end} | advised[work.key] for work in works]
    columns: dict[str, Any] = {"motion": text, "t": (count, "to <i>t</i><small>s</small>")}
    columns |= {
        name: (Of(chosen, name), WORDS[name])
        for name in CONSERVED
        if any(name in set(summaries[work.key].advice["conserve"]) for work in works)
    }
    return Table(pd.DataFrame(rows, dtype=object), columns, {})


def winners_table(work: Work, winners: pd.DataFrame, resolutions: Mapping[Any, str]) -> Table:
    """Return the cheapest methods by accuracy."""
    return Table(
        winners.assign(knob=winners["method"].map(resolutions)),
        {
            "level": (power_of_ten, f"|Δ<i>{work.letter}</i>|"),
            "method": (code, "by time"),
            "at": SETTING,
            "seconds": (milliseconds, "ms"),
            "next": named,
            "ratio": (times, TIMES_COST),
            "method_counted": (named, "by evaluations"),
            "evaluations": (count, "count"),
            "next_counted": (named, "next"),
            "ratio_counted": (times, TIMES_COST),
        },
        winners,
    )


def front_table(work: Work, front: pd.DataFrame) -> Table:
    """Return the Pareto front by time."""
    columns = {"method": code, "at": SETTING, work.error: (number, "error"), "seconds": (milliseconds, "CPU time<small>ms</small>")}
    return Table(front, columns | {"evaluations": count})


def keeps_table(work: Work, conserved: pd.DataFrame, defects: pd.DataFrame) -> Table:
    """Return the quantities that each method conserves."""
    shown = conserved.assign(defect=conserved["method"].map(part(defects, key=work.key).set_index("method")["defect"]))
    headings = {
        "g": "|<i>g</i>|",
        "Gv": "|<i>G H<sub>p</sub></i>|",
        "casimirs": "Casimir<small>error</small>",
        "integrals": "momentum<small>error</small>",
        "defect": f"{'structure' if work.poisson else 'two-form'}<small>defect</small>",
    }
    columns: dict[str, Any] = {
        "method": code,
        "error": (number, "smallest<small>error</small>"),
        "kept": (Of(verdict), "energy<small>without drift</small>"),
        "energy_error": (tiny, "energy<small>error</small>"),
    }
    columns |= {name: (tiny, heading) for name, heading in headings.items() if shown[name].notna().any()}
    return Table(shown, columns, conserved)


def advice_table(work: Work, advice: pd.DataFrame) -> Table:
    """Return the recommendations."""
    return Table(
        advice,
        {
            "accuracy": (Of(power_of_ten, "level"), f"|Δ<i>{work.letter}</i>|"),
            "conserve": (WORDS.__getitem__, "must conserve"),
            "method": (named, "take"),
            "at": (Of(lambda method, *of: setting(*of) if method else Markup(NONE), "method", "knob", "value"), "with"),
            "cost": (milliseconds, "CPU time<small>ms</small>"),
            "error": (number, "error<small>reached</small>"),
            "next": (named, "next best"),
            "ratio": (times, TIMES_COST),
        },
    )


FAILED = {"method": code, "at": SETTING, "failure": (long, "why")}
"""Runs that show no number, and why."""
