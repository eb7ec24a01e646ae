"""The tables of the report on tolerances."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup

from daebench.draw.figures import save_table
from daebench.pages.report import NONE, count, listing, number, power_of_ten, table, with_error
from daebench.pages.report.tables import Formats, Tabulate, text
from daebench.reports.index_reduction.figures import label
from daebench.reports.tolerances.bands import typical
from daebench.reports.tolerances.drift import QUANTITIES
from daebench.reports.tolerances.numbers import Numbers
from daebench.reports.tolerances.projection import PROJECTED
from daebench.reports.tolerances.runs import FORMULATIONS, IN_WORDS, IVPS, KINDS, REACHED

SHOWN_TOLERANCES = (1e-6, 1e-9, 1e-12)
WANTED = 1e-6
"""Accuracy, m, for which the table gives the required tolerance."""


def tables(numbers: Numbers, folder: Path) -> Mapping[str, Tabulate]:
    """Write the tables as CSV into a folder, all columns and rows, and return functions from a caption to HTML, by name."""
    runs = numbers.runs
    data = {"runs": runs, "laws": numbers.laws, "reached": reached(runs), "ends": ends(runs[runs["start"] == 0])}
    data |= {"projected": numbers.projected, "example": numbers.example}
    for stem, frame in data.items():
        save_table(folder / f"{stem}.csv", frame)
    makers = {"reached": reached_table, "ends": ends_table, "laws": laws_table, "example": example_table}
    return {name: partial(make, data[name]) for name, make in makers.items()}


def to_ask(rows: pd.DataFrame, wanted: float) -> float:
    """Return the loosest tolerance such that it and every tighter one give the wanted accuracy, NaN if there is none.

    A run without a result does not give the accuracy.
    """
    rows = rows.sort_values("tol")
    good = np.cumprod((rows["error"] <= wanted).to_numpy(dtype=int)).astype(bool)
    return float(rows["tol"][good].max()) if good.any() else float("nan")


def reached(runs: pd.DataFrame) -> pd.DataFrame:
    """Return one row for each problem and formulation, default treatments: errors at chosen tolerances, and the required tolerance."""
    bands, rows = typical(runs[runs["default"]]), list[dict[str, Any]]()
    for ivp, name in IVPS.items():
        for formulation in FORMULATIONS:
            chosen = bands[(bands["scene"] == ivp) & (bands["formulation"] == formulation)].set_index("tol")
            row: dict[str, Any] = {"scene": name, "formulation": label(formulation)}
            for tol in SHOWN_TOLERANCES:
                row |= {f"{what}_{tol:.0e}": float(chosen[what].get(tol, np.nan)) for what in ("error", "low", "high")}
            best = chosen["error"].dropna().sort_values()
            rows.append(row | {"ask": to_ask(chosen.reset_index(), WANTED), "best": best.iloc[0], "best_tol": best.index[0]})
    return pd.DataFrame(rows)


def reached_table(frame: pd.DataFrame, caption: str) -> Markup:
    """Return the errors reached, problem by problem: medians, and deciles below them."""
    first = frame["scene"] != frame["scene"].shift()
    shown = pd.DataFrame({"scene": frame["scene"].where(first, ""), "formulation": frame["formulation"]}, dtype=object)
    headings = {"scene": "problem", "ask": f"ask for<small>to get {power_of_ten(WANTED)} m</small>", "best": "best<small>of all, m</small>"}
    for tol in SHOWN_TOLERANCES:
        columns = [frame[f"{what}_{tol:.0e}"] for what in ("error", "low", "high")]
        cells = [_with_deciles(*values) for values in zip(*columns, strict=True)]
        shown[f"error_{tol:.0e}"] = pd.Series(cells, dtype=object)  # text that is HTML must not become a string of pandas
        headings[f"error_{tol:.0e}"] = f"error at<small>{power_of_ten(tol)}, m</small>"
    shown[["ask", "best", "best_tol"]] = frame[["ask", "best", "best_tol"]]
    formats: Formats = dict.fromkeys(map(str, shown), text)
    formats |= {"ask": power, "best": number, "best_tol": power}
    return table("reached", shown, formats, headings | {"best_tol": "at<small>tolerance</small>"}, caption)


def _with_deciles(error: float, low: float, high: float) -> Markup:
    """Return a median with the deciles in small below it; a dash if it is not finite."""
    parts = [number(value, 2) if np.isfinite(value) else Markup(NONE) for value in (error, low, high)]
    return Markup("{}<br><small>{} to {}</small>").format(*parts)


def example_table(frame: pd.DataFrame, caption: str) -> Markup:
    """Return SUNDIALS' example of a projected pendulum: the output of SUNDIALS, and the result of HLW (1.18)."""
    shown = frame.assign(method=["projected" if method == PROJECTED else "not" for method in frame["method"]])
    first = shown["tol"] != shown["tol"].shift()
    powers = [power_of_ten(tol) if new else "" for tol, new in zip(shown["tol"], first, strict=True)]
    shown = shown.assign(tol=pd.Series(powers, dtype=object))
    formats: Formats = {"tol": text, "method": text, "printed_error": number, "error": number}
    formats |= {"printed_g": zero_or_number, "g": zero_or_number, "printed_steps": count, "steps": count}
    headings = {
        "tol": "tolerance",
        "method": "steps",
        "printed_error": "error<small>SUNDIALS, m</small>",
        "error": "error<small>(1.18), m</small>",
    }
    headings |= {
        "printed_g": "||<i>q</i>|²&thinsp;&minus;&thinsp;1|<small>SUNDIALS</small>",
        "g": "||<i>q</i>|²&thinsp;&minus;&thinsp;1|<small>(1.18)</small>",
    }
    headings |= {"printed_steps": "number<small>SUNDIALS</small>", "steps": "number<small>(1.18)</small>"}
    return table("example", shown[list(formats)], formats, headings, caption)


def zero_or_number(value: float) -> Markup:
    """Return a number; zero is printed as 0."""
    return number(value) if value else Markup("0")


def power(value: float) -> Markup:
    """Return a power of ten, or a dash where there is none."""
    return power_of_ten(value) if np.isfinite(value) else Markup(NONE)


def ends(runs: pd.DataFrame) -> pd.DataFrame:
    """Return one row per formulation and treatment: the number of runs by outcome, over all problems, including runs without a failure."""
    names = (REACHED, *KINDS.values(), "other")
    rows = []
    for formulation in FORMULATIONS:
        for treatment in ("none", "atol", "derivative", "suppress"):
            treated_runs = runs[(runs["formulation"] == formulation) & (runs["cure"] == treatment)]
            good = treated_runs[treated_runs["end"] == REACHED]
            counts = {name: int(np.sum(treated_runs["end"] == name)) for name in names}
            tightest = good.groupby("scene")["tol"].min().reindex(list(IVPS))
            rows.append(
                {
                    "formulation": label(formulation),
                    "cure": treatment,
                    "default": bool(treated_runs["default"].iloc[0]),
                    "runs": len(treated_runs),
                }
                | counts
                | {"tightest_of_worst_scene": tightest.max() if tightest.notna().all() else float("nan")}
            )
    return pd.DataFrame(rows)


def ends_table(frame: pd.DataFrame, caption: str) -> Markup:
    """Return how runs ended."""
    words = {"none": "none (plain)"}
    first = frame["formulation"] != frame["formulation"].shift()
    treatments = [
        words.get(treatment, treatment) + (", default" if default else "")
        for treatment, default in zip(frame["cure"], frame["default"], strict=True)
    ]
    shown = frame.assign(formulation=frame["formulation"].where(first, ""), cure=treatments)
    formats: Formats = {"formulation": text, "cure": text, "runs": count, REACHED: zero}
    formats |= {name: zero for name in (*KINDS.values(), "other") if frame[name].any()}
    headings = {REACHED: "reached<small>the end</small>", "error test": "error test<small>IDA stops</small>"}
    headings |= {"Newton": "Newton<small>IDA stops</small>", "step size": "step size<small>collapsed</small>"}
    headings |= {"patience": "given up<small>too much work</small>", "other": "other<small>IDA stops</small>"}
    return table("ends", shown, formats, headings, caption)


def zero(value: int) -> Markup:
    """Return a count, or a dash for none."""
    return count(value) if value else Markup(NONE)


def laws_table(laws: pd.DataFrame, caption: str) -> Markup:
    """Return the fitted powers of time."""
    rows: list[dict[str, Any]] = []
    for formulation in FORMULATIONS:
        for tol, tol_laws in reversed(list(laws[laws["formulation"] == formulation].groupby("tol"))):
            laws_by_quantity = tol_laws.set_index("quantity")
            powers = {name: with_error(laws_by_quantity["exponent"][name], laws_by_quantity["error"][name]) for name in QUANTITIES}
            rows.append({"formulation": label(formulation), "tol": tol} | powers | {"windows": int(laws_by_quantity["windows"]["error"])})
    shown = pd.DataFrame(rows, dtype=object)  # text that is HTML must not become a string of pandas
    formats: Formats = {"formulation": text, "tol": power_of_ten}
    formats |= dict.fromkeys(QUANTITIES, text) | {"windows": count}
    headings = {"tol": "tolerance", "g": "|<i>g</i>|", "energy": "energy error", "error": "position error"}
    return table("laws", shown, formats, headings | {"windows": "windows<small>of the last</small>"}, caption)


def sentences(failed: pd.DataFrame) -> Markup:
    """Return a sentence on runs that ended early: from how many starts, which, and why."""
    phrases = []
    for (formulation, scene, tol, end), rows in failed.groupby(["formulation", "scene", "tol", "end"], sort=False):
        phrases.append(
            Markup("{} on the {} at tolerance {} from {} {} ({})").format(
                label(str(formulation)),
                IVPS[str(scene)],
                power_of_ten(float(str(tol))),
                len(rows),
                "start" if len(rows) == 1 else "starts",
                IN_WORDS[str(end)],
            )
        )
    return listing(phrases)
