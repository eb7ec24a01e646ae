"""The tables of the report on problems."""

import re
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup

from daebench.draw.figures import save_table
from daebench.pages.report import NONE, TIMES, count, number, table
from daebench.pages.report.tables import Formats, Tabulate, code, text, tiny
from daebench.reports.problems.facts import Facts
from daebench.reports.problems.ivps import horizon, step_size
from daebench.reports.problems.numbers import Numbers


def tables(numbers: Numbers, across: pd.DataFrame, folder: Path) -> Mapping[str, Tabulate]:
    """Write the tables as CSV into a folder, all columns and rows, and return functions from a caption to HTML, by name."""
    overview = overview_frame(numbers.facts)
    for stem, data in (("runs", numbers.runs), ("rank_loss", numbers.rank), ("across", across), ("overview", overview)):
        save_table(folder / f"{stem}.csv", data)
    makers: dict[str, Tabulate] = {
        "overview": partial(overview_table, overview),
        "across": partial(across_table, across),
        "rank": partial(rank_table, numbers),
    }
    for name, problem_runs in numbers.runs.groupby("problem", sort=False):
        save_table(folder / f"{name}.csv", problem_runs.dropna(axis="columns", how="all"))
        makers[str(name)] = partial(runs_table, problem_runs.reset_index(drop=True))
    return makers


def overview_frame(facts: Sequence[Facts]) -> pd.DataFrame:
    """Return one row per problem: sizes, structure, declarations, references, and the step and end of its runs."""
    rows = []
    for problem in facts:
        certified = [case["name"] for case in problem.cases if case["certified"] is not None]
        row, plan = (
            {"problem": problem.name, "d": problem.d, "m": problem.m, "dof": problem.dof, "mass": problem.structure},
            horizon(problem.name),
        )
        row |= {"integrals": ", ".join(problem.integrals), "has": ", ".join(problem.has), "cases": len(problem.cases)}
        row |= {"certified": len(certified), "h": step_size(problem.name), "t_end": plan.t_end, "unit": plan.unit, "why": plan.why}
        rows.append(row)
    return pd.DataFrame(rows)


def overview_table(frame: pd.DataFrame, caption: str) -> Markup:
    """Return the overview, one row per problem with a link to its section."""
    shown = frame.assign(
        integrals=frame["integrals"].replace("", NONE),
        references=[f"{done} of {all_}" for done, all_ in zip(frame["certified"], frame["cases"], strict=True)],
        end=[f"{t:g} {'' if unit == 's' else TIMES + ' '}{unit}" for t, unit in zip(frame["t_end"], frame["unit"], strict=True)],
    )
    formats: Formats = {"problem": link, "d": count, "m": count, "dof": count, "mass": text, "integrals": text, "references": text}
    formats |= {"end": text}
    headings = {"problem": "problem", "d": "<i>d</i>", "m": "<i>m</i>", "dof": "degrees<small>of freedom</small>", "mass": "mass matrix"}
    headings |= {"integrals": "integrals<small>besides H</small>", "references": "certified<small>cases</small>", "end": "run to"}
    return table("overview", shown, formats, headings, caption)


def link(name: str) -> Markup:
    """Return the name of a problem with a link to its section."""
    return Markup('<a href="#{0}"><code>{0}</code></a>').format(name)


def across_table(frame: pd.DataFrame, caption: str) -> Markup:
    """Return the results of each method on all problems together."""
    first = frame["family"] != frame["family"].shift()
    shown = frame.assign(group=frame["family"].where(first, ""))
    formats: Formats = {"method": code, "group": text, "asked": count, "refused": count, "stopped": count, "reached": count}
    formats |= {"manifold": count, "bounded": count, "median": number, "most": number}
    headings = {
        "group": "family",
        "asked": "problems",
        "refused": "refuses",
        "stopped": "stops",
        "reached": "reaches<small>the end</small>",
    }
    headings |= {"manifold": "on the<small>manifold</small>", "bounded": "energy<small>no drift</small>"}
    headings |= {"median": "energy error<small>median</small>", "most": "<small>largest</small>"}
    return table("across", shown, formats, headings, caption)


def runs_table(frame: pd.DataFrame, caption: str) -> Markup:
    """Return the results of each method on one problem; a reason takes the place of numbers if there is no full run."""
    whole = frame.reindex(columns=[*frame.columns, *(column for column in COLUMNS if column not in frame)])
    shown = whole.assign(became=[outcome(row) for row in whole.to_dict("records")])
    formats: Formats = {"method": code, "became": text, "energy": number, "kind": present, "g": fine, "Gv": fine}
    if whole["integrals"].notna().any():
        formats["integrals"] = fine
    formats |= {"steps": counted, "evaluations": counted, "solves": counted}
    headings = {"became": "run", "energy": "energy<small>error</small>", "kind": "<small>which is</small>"}
    headings |= {"g": "|<i>g</i>|", "Gv": "|<i>G H<sub>p</sub></i>|", "integrals": "integrals<small>error</small>"}
    return table(frame["problem"].iloc[0], shown, formats, headings | {"evaluations": "evaluations", "solves": "solves"}, caption)


COLUMNS = ("energy", "kind", "g", "Gv", "integrals", "steps", "evaluations", "solves")


def outcome(row: Mapping[Any, Any]) -> str:
    """Return how a run ended, in a few words."""
    if row["end"] == "reached":
        return "complete" if not row.get("branches") or pd.isna(row["branches"]) else f"complete; {row['branches']}"
    if row["end"] == "refused":
        return "refuses"
    if row["end"] == "not run":
        return "not run"
    return f"stops at {row['t']:.3g}"


def fine(value: float) -> Markup:
    """Return a residual, or a dash where there is none."""
    return tiny(value) if np.isfinite(value) else Markup(NONE)


def present(value: Any) -> str:
    """Return text, or a dash where there is none."""
    return value if isinstance(value, str) else NONE


def counted(value: float) -> Markup:
    """Return a count, or a dash where there is none."""
    return count(value) if np.isfinite(value) else Markup(NONE)


def rank_table(numbers: Numbers, caption: str) -> Markup:
    """Return the behaviour of each method where G loses rank."""
    frame = numbers.rank
    first = frame["problem"] != frame["problem"].shift()
    shown = frame.assign(
        scene=(frame["problem"] + " " + frame["case"]).where(first, ""),
        ended=[f"{'complete' if row['end'] == 'reached' else 'stops'} at {row['t']:.4g}" for row in frame.to_dict("records")],
        went=[went(row) for row in frame.to_dict("records")],
    )
    formats: Formats = {"method": code, "scene": text, "mode": text, "ended": text, "told": partial(number, digits=5), "went": text}
    formats |= {"turn": number, "pivot": number, "energy": number}
    headings = {"mode": "on singular", "ended": "run<small>t, s</small>", "told": "rank lost<small>reported, s</small>"}
    headings |= {"went": "branch", "turn": "turn<small>degrees</small>", "pivot": "smallest<small>pivot</small>"}
    return table("rank", shown, formats, headings | {"energy": "energy error<small>J</small>"}, caption)


def went(row: Mapping[Any, Any]) -> str:
    """Return the branch of a run, a dash if it stopped."""
    return row["branch"] if isinstance(row["branch"], str) and row["branch"] else NONE


def reason(row: Mapping[Any, Any]) -> str:
    """Return why a run ended early or was refused: the sentence without name, case, residual and advice."""
    sentence = re.sub(r", residual [^;,]*?(?=[;,.]*$|[;,])", "", str(row["why"]))
    sentence = re.sub(r"; (to go on|use|remove|start|which)\b.*$", "", sentence).rstrip(".")
    cause = re.sub(r"^.*?\((?:step|tol)[^)]*\): ", "", sentence)
    return cause if cause != sentence else re.sub(r"^\S+ (on|cannot start on) [^:]*?: ", "", sentence)
