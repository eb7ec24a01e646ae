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
from daebench.reports.tolerances.drift import QUANTITIES
from daebench.reports.tolerances.numbers import Numbers
from daebench.reports.tolerances.runs import FORMULATIONS, IN_WORDS, IVPS, KINDS, REACHED

SHOWN_TOLERANCES = (1e-6, 1e-9, 1e-12)
WANTED = 1e-6
"""Accuracy, m, for which the table says what to ask for."""


def tables(numbers: Numbers, folder: Path) -> Mapping[str, Tabulate]:
    """Write the tables as CSV into a folder, all columns and rows, and return functions from a caption to HTML, by name."""
    runs = numbers.runs.assign(scene=numbers.runs["problem"] + "-" + numbers.runs["case"])
    data = {"runs": numbers.runs, "laws": numbers.laws, "reached": reached(runs), "ends": ends(runs)}
    for stem, frame in data.items():
        save_table(folder / f"{stem}.csv", frame)
    makers = {"reached": reached_table, "ends": ends_table, "laws": laws_table}
    return {name: partial(make, data[name]) for name, make in makers.items()}


def at(rows: pd.DataFrame, tol: float) -> float:
    """Return the error at a tolerance, NaN if there is none."""
    errors = rows["error"][rows["tol"] == tol]
    return float(errors.iloc[0]) if len(errors) else float("nan")


def to_ask(rows: pd.DataFrame, wanted: float) -> float:
    """Return the loosest tolerance from which on every tighter one gives the wanted accuracy, NaN if there is none.

    A run without a result does not give it.
    """
    rows = rows.sort_values("tol")
    good = np.cumprod((rows["error"] <= wanted).to_numpy(dtype=int)).astype(bool)
    return float(rows["tol"][good].max()) if good.any() else float("nan")


def reached(runs: pd.DataFrame) -> pd.DataFrame:
    """Return one row for each problem and formulation, default treatments: errors at chosen tolerances, and what to ask for."""
    rows = []
    for ivp, name in IVPS.items():
        for formulation in FORMULATIONS:
            default_runs = runs[(runs["scene"] == ivp) & (runs["formulation"] == formulation) & runs["default"]]
            errors = {f"error_{tol:.0e}": at(default_runs, tol) for tol in SHOWN_TOLERANCES}
            last = default_runs[default_runs["error"].notna()].sort_values("error").iloc[0]
            rows.append(
                {"scene": name, "formulation": label(formulation)}
                | errors
                | {
                    "ask": to_ask(default_runs, WANTED),
                    "best": last["error"],
                    "best_tol": last["tol"],
                    "amplification": default_runs["amplification"].iloc[0],
                }
            )
    return pd.DataFrame(rows)


def reached_table(frame: pd.DataFrame, caption: str) -> Markup:
    """Return what was reached, problem by problem."""
    first = frame["scene"] != frame["scene"].shift()
    shown = frame.assign(scene=frame["scene"].where(first, ""))
    errors = [f"error_{tol:.0e}" for tol in SHOWN_TOLERANCES]
    formats: Formats = {"scene": text, "formulation": text}
    formats |= dict.fromkeys(errors, number) | {"ask": power, "best": number, "best_tol": power}
    headings = {"scene": "problem", "ask": f"ask for<small>to get {power_of_ten(WANTED)} m</small>", "best": "best<small>of all, m</small>"}
    headings |= {"best_tol": "at<small>tolerance</small>"}
    headings |= {name: f"error at<small>{power_of_ten(tol)}, m</small>" for name, tol in zip(errors, SHOWN_TOLERANCES, strict=True)}
    return table("reached", shown, formats, headings, caption)


def power(value: float) -> Markup:
    """Return a power of ten, or a dash where there is none."""
    return power_of_ten(value) if np.isfinite(value) else Markup(NONE)


def ends(runs: pd.DataFrame) -> pd.DataFrame:
    """Return one row a formulation and treatment: how many runs ended how, over all problems, those without a failure included."""
    names = (REACHED, *KINDS.values(), "other")
    rows = []
    for formulation in FORMULATIONS:
        for treatment in ("none", "atol", "derivative"):
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
    """Return runs that ended early, in words: which, where and why."""
    phrases = [
        Markup("{} on the {} at tolerance {} (at t = {} {})").format(
            label(str(row["formulation"])),
            IVPS[str(row["scene"])],
            power_of_ten(row["tol"]),
            number(row["t_reached"], 3),
            IN_WORDS[str(row["end"])],
        )
        for row in failed.to_dict("records")
    ]
    return listing(phrases)
