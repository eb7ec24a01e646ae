"""Findings of each extreme: claims, and a table with one row per method, or per method and its comparison."""

import re
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType, SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup, escape

from daebench.draw.figures import BLUE, ORANGE
from daebench.draw.methods import name_of
from daebench.pages.report import NONE, count, number
from daebench.pages.report.claims import require
from daebench.pages.report.tables import Columns, Table, code, part, text
from daebench.reports.extremes.sections import MAPPED
from daebench.studies.grid.outcomes import FINE
from daebench.studies.grid.rows import by_method, error_of
from daebench.studies.precision import smallest_steps
from daebench.studies.stability.penalty import LIMITS

NOTHING: Mapping[str, Any] = MappingProxyType({})
KNOB = "<i>h</i> [s]<small>or tol</small>"


def best_of(runs: pd.DataFrame, column: str) -> Mapping[str, Any]:
    """Return the run with the smallest value of a column; nothing if no run has a value."""
    return dict(runs.sort_values(column).iloc[0]) if runs[column].notna().any() else NOTHING


def fine_runs(table: pd.DataFrame) -> Table:
    """Return, by method, the fine fraction of a map, the median energy error there, the drifting fraction, and the commonest failure."""
    rows = []
    for method, runs in by_method(table):
        fine, others = runs[runs["outcome"] == FINE], runs["outcome"].value_counts().drop(FINE, errors="ignore")
        row = {"method": method, "runs": len(runs), "fine": 100 * len(fine) / len(runs), "size": fine["size"].median()}
        row["drift"] = 100 * (fine["trend"] == "drifts").mean() if len(fine) else np.nan
        rows.append(row | {"most": f"{others.index[0]} ({others.iloc[0]})" if len(others) else NONE})
    return Table(
        pd.DataFrame(rows),
        {
            "method": code,
            "runs": count,
            "fine": (number, "fine<small>% of all</small>"),
            "drift": (number, "with drift<small>% of fine</small>"),
            "size": (number, "energy error<small>median, fine runs</small>"),
            "most": "most frequent<small>other outcome</small>",
        },
    )


def over_parameter(table: pd.DataFrame) -> Table:
    """Return for how many values of a parameter each method is fine, where it is not, and its largest energy error."""
    rows = []
    for method, runs in by_method(table):
        bad = runs[runs["outcome"] != FINE]
        row = {"method": method, "values": len(runs), "fine": len(runs) - len(bad), "energy": runs["energy_part"].max()}
        row |= {"low": bad["varied"].min(), "high": bad["varied"].max()}
        rows.append(row | {"outcomes": ", ".join(dict.fromkeys(bad["outcome"])) or NONE})
    return Table(
        pd.DataFrame(rows),
        {
            "method": code,
            "values": count,
            "fine": count,
            "low": (number, "not fine<small>from</small>"),
            "high": (number, "<small>to</small>"),
            "outcomes": "outcome<small>there</small>",
            "energy": (number, "energy error<small>largest, of its size</small>"),
        },
    )


def over_penalty(table: pd.DataFrame) -> Table:
    """Return, with the smallest step, the smallest error of each method with a penalty, and of the constrained method of its order."""
    same = table[table["value"] == table["value"].min()]
    limits = same[same["eps"] == 0].set_index("method")
    rows = []
    for method, runs in by_method(same[same["eps"] > 0]):
        good, limit = runs[runs["failure"] == ""], limits.loc[LIMITS[method]]
        best = best_of(good, "error_q")
        row = {"method": method, "error": best.get("error_q", np.nan), "eps": best.get("eps", np.nan), "failed": len(runs) - len(good)}
        row |= {"constrained": LIMITS[method], "limit": limit["error_q"]}
        rows.append(row | {"work": best.get("evaluations", np.nan) / limit["evaluations"]})
    return Table(
        pd.DataFrame(rows),
        {
            "method": (code, "with a penalty"),
            "error": (number, "least error<small>of <i>q</i></small>"),
            "eps": (number, "at <i>\u03b5</i>"),
            "constrained": (code, "with the constraint"),
            "limit": (number, "error<small>of <i>q</i></small>"),
            "work": (number, "evaluations<small>ratio</small>"),
            "failed": (count, "failed runs"),
        },
    )


def to_round_off(table: pd.DataFrame) -> Table:
    """Return the smallest error of each method, where it occurs, and the error with its smallest step size or tolerance."""
    error, rows = error_of(table), []
    for method, runs in by_method(table):
        good = runs[runs["failure"] == ""]
        best, finest = best_of(good, error), best_of(good, "value")
        row = {"method": method, "knob": runs["knob"].iloc[0], "error": best.get(error, np.nan), "at": best.get("value", np.nan)}
        rows.append(row | {"finest": finest.get("value", np.nan), "last": finest.get(error, np.nan), "failed": len(runs) - len(good)})
    return Table(
        pd.DataFrame(rows),
        {
            "method": code,
            "knob": KNOB,
            "error": (number, "least error"),
            "at": number,
            "finest": (number, "smallest<small>that ends</small>"),
            "last": (number, "error<small>there</small>"),
            "failed": (count, "failed runs"),
        },
    )


def until_lost(table: pd.DataFrame) -> Table:
    """Return the longest time for which each method follows the motion, and the step size or tolerance."""
    rows = []
    for method, runs in by_method(table):
        good = runs[runs["failure"] == ""].sort_values(["horizon", "value"])
        best = dict(good.iloc[-1]) if len(good) else NOTHING
        row = {"method": method, "horizon": best.get("horizon", np.nan), "knob": runs["knob"].iloc[0]}
        rows.append(row | {"value": best.get("value", np.nan)})
    columns: Columns = {"method": code, "horizon": (number, "follows until<small>s</small>"), "knob": KNOB, "value": (number, "at")}
    return Table(pd.DataFrame(rows), columns)


def largest_steps(steps: pd.DataFrame) -> Table:
    """Return the largest steps of each method, and what ends a run with a larger one."""
    limits = steps.pivot(index="method", columns="verdict", values="h").reindex(steps["method"].unique()).reset_index()
    limits["why"] = [_reason(why) or "none; the largest step tried" for why in steps["why"][steps["verdict"] == "completes"]]
    return Table(
        limits,
        {
            "method": text,
            "completes": (number, "reaches its end up to <i>h</i>"),
            "keeps the energy": (number, "keeps the energy up to"),
            "why": "what ends it",
        },
    )


def in_precision(runs: pd.DataFrame) -> Table:
    """Return errors in single, double and compensated arithmetic with the smallest steps."""
    precise = smallest_steps(runs)
    return Table(
        precise,
        {
            "method": text,
            "way": text,
            "value": (number, "<i>h</i>"),
            "time_ratio": (number, "time"),
            error_of(precise): (number, "error of <i>q</i>"),
            "energy_error": (number, "energy error"),
            "energy_verdict": "energy",
            "g": (number, "|<i>g</i>|"),
            "defect": (number, "two-form"),
        },
    )


BY_EXTREME: Mapping[str, Callable[[pd.DataFrame], Table]] = MappingProxyType(
    {
        "outcome-map": fine_runs,
        "parameter-range": over_parameter,
        "penalty": over_penalty,
        "round-off": to_round_off,
        "lost-motion": until_lost,
    }
)
"""Functions that make the table of an extreme, by its name."""


ON_MANIFOLD = 1e-12
"""Largest |g|, in squares of a length of 1, of a scheme that keeps it to round-off."""


def limits(table: pd.DataFrame) -> SimpleNamespace:
    """Return the methods that keep the energy with the largest steps, and those whose runs reach their end with much larger steps.

    If several methods reach the end with the largest step that was tried, their limit is not known: all of them are named.
    """
    both = table.pivot(index="method", columns="verdict", values="h")
    require((both["keeps the energy"] <= both["completes"]).all(), "a run that keeps the energy reaches its end", both)
    energy_steps = both["keeps the energy"]
    room = (both["completes"] / energy_steps)[energy_steps > 0].sort_values(ascending=False)
    open_end = set(part(table, verdict="completes", fails=float("inf"))["method"])
    most = room[room.index.isin(open_end)] if open_end & set(room.index) else room.iloc[:1]
    facts = {"most": list(most.index), "room": [float(x) for x in most], "least": bool(open_end)}
    return SimpleNamespace(best=list(energy_steps[energy_steps == energy_steps.max()].index), h=energy_steps.max(), **facts)


def ratios(table: pd.DataFrame) -> SimpleNamespace:
    """Return the methods that are fine for all masses, and test that RATTLE keeps the manifold wherever it reaches its end."""
    rattle = part(table, method="rattle", failure="")
    require((rattle["g"] <= ON_MANIFOLD).all(), "RATTLE keeps the constraints to round-off for every mass", rattle["g"].max())
    methods = by_method(table)
    through = [name for name, rows in methods if (rows["failure"] == "").all()]
    fine = [name for name, rows in methods if (rows["outcome"] == FINE).all()]
    return SimpleNamespace(through=through, fine=fine, g=rattle["g"].max(), n=len(methods))


def horizons(table: pd.DataFrame) -> SimpleNamespace:
    """Return the time at which double precision ends, and test that no run follows the motion beyond it."""
    double = float(table["double_horizon"].iloc[0])
    longest = float(table["horizon"].max())
    require(longest <= double * 1.1, "no run follows the chaotic motion beyond what double precision allows", (longest, double))
    end, grown = (float(table[name].iloc[0]) for name in ("t_end", "grown"))
    facts = {
        "longest": longest,
        "methods": list(dict.fromkeys(table["method"][table["horizon"] == longest])),
        "tenfold": float(table["tenfold"].iloc[0]),
    }
    return SimpleNamespace(double=double, end=end, rounding=grown * 2.0**-53, **facts)


def _reason(why: str) -> str:
    """Return the reason in the message of a failure, without place and advice."""
    return why.rpartition("): ")[2].split(";")[0].rstrip(".")


def typeset(sentence: str, methods: Iterable[str]) -> Markup:
    """Return a sentence as HTML: names of methods as code, and powers of ten as such."""
    names = "|".join(re.escape(name) for name in sorted(methods, key=len, reverse=True))
    html = str(escape(sentence))
    html = re.sub(rf"(?<![\w:/+])({names})(?![\w/+]|:\w)", r"<code>\1</code>", html) if names else html
    return Markup(re.sub(r"(?<![\w.=])(\d(?:\.\d+)?e[+-]\d+)", lambda power: str(number(float(power[1]))), html))


def thumbnail(axis: Any, limits: pd.DataFrame) -> None:
    """Draw two bars a method: to the largest step that reaches the end, and to the largest that holds the energy."""
    steps = limits.pivot_table(index="method", columns="verdict", values="h")
    methods = [name for name in MAPPED if name in steps.index]
    held = next(name for name in steps.columns if name != "completes")
    for column, color, words in (("completes", ORANGE, "reaches the end"), (held, BLUE, "holds the energy")):
        axis.barh(range(len(methods)), steps.loc[methods, column], color=color, height=0.6, label=words)
    axis.set_yticks(range(len(methods)), [name_of(name) for name in methods])
    axis.invert_yaxis()
    axis.grid(visible=False, axis="y")
    axis.set_title("largest usable step, pendulum", loc="right")
    axis.set_xlabel("step size [s]", loc="right")
    axis.legend(fontsize=6.5, loc="upper right", handlelength=1.0)
