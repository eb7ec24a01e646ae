"""The tables of the report on engines."""

import math
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup

from daebench.diagnostics.drift import FAILED
from daebench.draw.figures import save_table
from daebench.pages.report import MINUS, NONE, count, number, power_of_ten, table
from daebench.pages.report.sentences import exponent_text
from daebench.pages.report.tables import Formats, Tabulate, column, text, tiny
from daebench.reports.engines.claims import LEVEL
from daebench.reports.engines.motions import BY_KEY
from daebench.reports.engines.numbers import OWN, RATTLE, Numbers


def tables(numbers: Numbers, folder: Path) -> Mapping[str, Tabulate]:
    """Write the tables as CSV into a folder, all columns and rows, and return functions from a caption to HTML, by name."""
    stems = {"runs": numbers.runs, "chosen": numbers.chosen, "tuned": numbers.tuned, "documentation": numbers.sentences}
    for stem, frame in stems.items():
        if len(frame):
            save_table(folder / f"{stem}.csv", frame)
    made: dict[str, Tabulate] = {}
    if not numbers.engines:
        return made
    for motion, rows in numbers.chosen.groupby("motion", sort=False):
        made[f"motion-{motion}"] = partial(motion_table, str(motion), rows, numbers.runs)
    if len(numbers.sentences):
        made["documentation"] = partial(sentences_table, numbers.sentences)
    if len(numbers.tuned):
        made["tuned"] = partial(tuned_table, numbers.tuned)
    return made


def at(row: Mapping[Any, Any]) -> Markup:
    """Return a step size, a power of two, or a tolerance, a power of ten."""
    if row["knob"] == "h":
        return Markup("<i>h</i>&nbsp;=&nbsp;2<sup>{}</sup>").format(exponent_text(round(math.log2(float(row["value"])))))
    return Markup("tol&nbsp;=&nbsp;{}").format(power_of_ten(float(row["value"])))


def named(row: Mapping[Any, Any]) -> Markup:
    """Return an engine and its setting, with marks for reduced coordinates and for a run that takes longer than the budget."""
    marks = f"{'' if row['constrained'] else ' °'}{'' if row['within'] or row['failure'] else ' *'}"
    setting = f"{row['setting']}{', ' + row['variant'] if row['variant'] else ''}"
    return Markup("{}{}<small class='setting'>{}</small>").format(row["engine"], marks, setting)


def time_for(rows: pd.DataFrame, level: float) -> float:
    """Return the shortest time of a run of the required accuracy, ms; NaN if there is none."""
    good = rows[(rows["failure"] == "") & (rows["error"] <= level)]["seconds"]
    return 1e3 * float(good.min()) if len(good) else float("nan")


def verdict(row: Mapping[Any, Any]) -> str:
    """Return the verdict on the energy, with its law if it drifts; for a run that ends after t = 10, that it stops."""
    if row["verdict"] == FAILED and not row["failure"]:
        return "stops before"
    return f"{row['verdict']}, {row['law']}" if row["law"] and row["verdict"] == "drifts" else str(row["verdict"])


def motion_table(key: str, chosen: pd.DataFrame, runs: pd.DataFrame, caption: str) -> Markup:
    """Return the contenders of a motion at equal cost, daebench's own first, then by their error."""
    own, others = chosen[chosen["engine"] == OWN], chosen[chosen["engine"] != OWN].sort_values("error")
    rows = pd.concat([own, others], ignore_index=True)
    records = rows.to_dict("records")
    mine = runs[runs["motion"] == key]
    known = own[own["setting"] == RATTLE]
    known_time = time_for(mine[(mine["engine"] == OWN) & (mine["setting"] == RATTLE)], LEVEL) if len(known) else float("nan")
    level = [time_for(mine[(mine["engine"] == row["engine"]) & (mine["setting"] == row["setting"])], LEVEL) for row in records]
    shown = rows.assign(
        engine=column([named(row) for row in records], rows),
        at=column([at(row) for row in records], rows),
        energy=[verdict(row) for row in records],
        milliseconds=1e3 * rows["seconds"],
        level=level,
        times=np.array(level) / known_time,
    )
    formats: Formats = {"engine": text, "at": text, "error": number, "g": tiny, "Gv": tiny, "energy_error": tiny}
    formats |= {"energy": text, "order": order, "milliseconds": number, "level": number, "times": number}
    headings = {"error": "error<small>at t = 10</small>", "g": "|<i>g</i>|", "Gv": "|<i>G v</i>|", "at": "with"}
    headings |= {"energy_error": "energy<small>error</small>", "energy": f"energy<small>to t = {BY_KEY[key].long:g}</small>"}
    headings |= {"order": "order<small>measured</small>", "milliseconds": "time<small>ms</small>"}
    headings |= {"level": f"time to 10<sup>{MINUS}3</sup><small>ms</small>", "times": "ratio<small>to RATTLE's time</small>"}
    return table(f"motion-{key}", shown, formats, headings, caption)


def order(value: float) -> Any:
    """Return a measured order."""
    return number(value, 2) if value == value else NONE


def long_text(value: str) -> Markup:
    """Return a sentence in HTML that may wrap over several lines."""
    return Markup('<span class="long">{}</span>').format(Markup(value))


def phrase(value: str) -> Markup:
    """Return a few words that may wrap over several lines."""
    return Markup('<span class="phrase">{}</span>').format(value)


def sentences_table(frame: pd.DataFrame, caption: str) -> Markup:
    """Return statements of documentation, and the measurements."""
    formats: Formats = {"engine": text, "place": phrase, "sentence": long_text, "measured": long_text, "verdict": phrase}
    headings = {"place": "where", "sentence": "statement, paraphrased"}
    return table("documentation", frame, formats, headings, caption)


def tuned_table(frame: pd.DataFrame, caption: str) -> Markup:
    """Return the free numbers of settings that were tried, and the chosen ones."""
    rows = []
    for (engine, setting, motion), tried in frame.groupby(["engine", "setting", "motion"], sort=False):
        taken = tried[tried["taken"]].iloc[0]
        solved = tried["error"].dropna()
        row = {"engine": engine, "setting": setting, "motion": BY_KEY[str(motion)].title, "value": float(taken["value"])}
        row |= {"variant": taken["variant"], "error": float(taken["error"]), "median": float(solved.median()) if len(solved) else np.nan}
        rows.append(row | {"tried": len(tried), "failed": int(tried["error"].isna().sum())})
    shown = pd.DataFrame(rows)
    formats: Formats = {
        "engine": text,
        "setting": text,
        "motion": text,
        "value": number,
        "variant": text,
        "error": number,
        "median": number,
    }
    formats |= {"tried": count, "failed": count}
    headings = {
        "value": "h<small>s</small>",
        "variant": "taken",
        "error": "its error<small>at t = 10</small>",
        "median": "median<small>of all</small>",
    }
    return table("tuned", shown, formats, headings, caption)
