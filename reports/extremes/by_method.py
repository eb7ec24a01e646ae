"""Findings of each extreme as a table: one row per method, or per method and its comparison."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup

from daebench.pages.report import NONE, count, number
from daebench.pages.report.tables import Formats, code, text
from daebench.studies.grid.outcomes import FINE
from daebench.studies.grid.rows import by_method, error_of
from daebench.studies.stability.penalty import LIMITS

Layout = tuple[pd.DataFrame, Formats, dict[str, str]]
"""Rows, what makes text of each column, and headings."""

NOTHING: Mapping[str, Any] = MappingProxyType({})
KNOB = "<i>h</i> [s]<small>or tol</small>"


def value(x: float) -> Markup:
    """Return a number with two digits, an en dash where there is none."""
    return number(x) if np.isfinite(x) else Markup(NONE)


def best_of(runs: pd.DataFrame, column: str) -> Mapping[str, Any]:
    """Return the run with the smallest value of a column; nothing if no run has a value."""
    return dict(runs.sort_values(column).iloc[0]) if runs[column].notna().any() else NOTHING


def fine_runs(table: pd.DataFrame) -> Layout:
    """Return, by method, the fine fraction of a map, the median energy error there, the drifting fraction, and the commonest failure."""
    rows = []
    for method, runs in by_method(table):
        fine, others = runs[runs["outcome"] == FINE], runs["outcome"].value_counts().drop(FINE, errors="ignore")
        row = {"method": method, "runs": len(runs), "fine": 100 * len(fine) / len(runs), "size": fine["size"].median()}
        row["drift"] = 100 * float((fine["trend"] == "drifts").mean()) if len(fine) else float("nan")
        rows.append(row | {"most": f"{others.index[0]} ({others.iloc[0]})" if len(others) else NONE})
    formats: Formats = {"method": code, "runs": count, "fine": value, "drift": value, "size": value, "most": text}
    headings = {"fine": "fine<small>% of all</small>", "drift": "with drift<small>% of fine</small>"}
    headings |= {"size": "energy error<small>median, fine runs</small>", "most": "most frequent<small>other outcome</small>"}
    return pd.DataFrame(rows), formats, headings


def over_parameter(table: pd.DataFrame) -> Layout:
    """Return for how many values of a parameter each method is fine, where it is not, and its largest energy error."""
    rows = []
    for method, runs in by_method(table):
        bad = runs[runs["outcome"] != FINE]
        row = {"method": method, "values": len(runs), "fine": len(runs) - len(bad), "energy": runs["energy_part"].max()}
        row |= {"low": float(bad["varied"].min()), "high": float(bad["varied"].max())}
        rows.append(row | {"outcomes": ", ".join(dict.fromkeys(bad["outcome"])) or NONE})
    formats: Formats = {"method": code, "values": count, "fine": count, "low": value, "high": value, "outcomes": text, "energy": value}
    headings = {"low": "not fine<small>from</small>", "high": "<small>to</small>", "outcomes": "outcome<small>there</small>"}
    return pd.DataFrame(rows), formats, headings | {"energy": "energy error<small>largest, of its size</small>"}


def over_penalty(table: pd.DataFrame) -> Layout:
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
    formats: Formats = {"method": code, "error": value, "eps": value, "constrained": code, "limit": value, "work": value, "failed": count}
    headings = {"method": "with a penalty", "error": "least error<small>of <i>q</i></small>", "eps": "at <i>\u03b5</i>"}
    headings |= {"constrained": "with the constraint", "limit": "error<small>of <i>q</i></small>", "failed": "failed runs"}
    return pd.DataFrame(rows), formats, headings | {"work": "evaluations<small>ratio</small>"}


def to_round_off(table: pd.DataFrame) -> Layout:
    """Return the smallest error of each method, where it occurs, and the error with its smallest step size or tolerance."""
    error, rows = error_of(table), []
    for method, runs in by_method(table):
        good = runs[runs["failure"] == ""]
        best, finest = best_of(good, error), best_of(good, "value")
        row = {"method": method, "knob": runs["knob"].iloc[0], "error": best.get(error, np.nan), "at": best.get("value", np.nan)}
        rows.append(row | {"finest": finest.get("value", np.nan), "last": finest.get(error, np.nan), "failed": len(runs) - len(good)})
    formats: Formats = {"method": code, "knob": text, "error": value, "at": value, "finest": value, "last": value, "failed": count}
    headings = {
        "knob": KNOB,
        "error": "least error",
        "at": "at",
        "finest": "smallest<small>that ends</small>",
        "last": "error<small>there</small>",
    }
    return pd.DataFrame(rows), formats, headings | {"failed": "failed runs"}


def until_lost(table: pd.DataFrame) -> Layout:
    """Return the longest time for which each method follows the motion, and the step size or tolerance."""
    rows = []
    for method, runs in by_method(table):
        good = runs[runs["failure"] == ""].sort_values(["horizon", "value"])
        best = dict(good.iloc[-1]) if len(good) else NOTHING
        row = {"method": method, "horizon": best.get("horizon", np.nan), "knob": runs["knob"].iloc[0]}
        rows.append(row | {"value": best.get("value", np.nan)})
    formats: Formats = {"method": code, "horizon": value, "knob": text, "value": value}
    return pd.DataFrame(rows), formats, {"horizon": "follows until<small>s</small>", "knob": KNOB, "value": "at"}


BY_EXTREME: Mapping[str, Callable[[pd.DataFrame], Layout]] = MappingProxyType(
    {
        "outcome-map": fine_runs,
        "parameter-range": over_parameter,
        "penalty": over_penalty,
        "round-off": to_round_off,
        "lost-motion": until_lost,
    }
)
"""Functions that make the table of an extreme, by its name."""
