"""The tables of the report on work against precision."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd
from markupsafe import Markup

from daebench.draw.figures import save_table
from daebench.pages.report import NONE, THIN, count, number, power_of_ten, table
from daebench.pages.report.tables import Formats, Tabulate, code, column, text, tiny
from daebench.reports.work_precision.claims import MIDDLE
from daebench.reports.work_precision.ivps import Work
from daebench.reports.work_precision.numbers import Numbers
from daebench.studies.work_precision.recommend import CONSERVED

TIMES_COST = "times<small>the cost</small>"
WORDS = CONSERVED | {"two_form": "two-form", "casimirs": "Casimir functions", "constraints": "constraints"}


def tables(numbers: Numbers, summaries: Mapping[str, SimpleNamespace], folder: Path) -> Mapping[str, Tabulate]:
    """Write the tables as CSV into a folder, all columns and rows, and return functions from a caption to HTML, by name and motion."""
    save_table(folder / "defects.csv", numbers.defects)
    made: dict[str, Tabulate] = {"summary": partial(summary_table, numbers, summaries)}
    for work in numbers.works:
        summary = summaries[work.key]
        stems = {"runs": numbers.runs[work.key], "winners": summary.winners, "keeps": summary.keeps, "advice": summary.advice}
        stems["front"] = summary.front["seconds"]
        for stem, data in stems.items():
            save_table(folder / f"{stem}-{work.key}.csv", data)
        resolutions = dict(numbers.runs[work.key].groupby("method")["knob"].first())
        made[f"winners-{work.key}"] = partial(winners_table, work, summary.winners, resolutions)
        made[f"keeps-{work.key}"] = partial(keeps_table, work, summary.keeps, numbers.defects[numbers.defects["key"] == work.key])
        made[f"advice-{work.key}"] = partial(advice_table, work, summary.advice)
        made[f"front-{work.key}"] = partial(front_table, work, summary.front["seconds"])
        if len(summary.failed):
            made[f"failed-{work.key}"] = partial(failed_table, work, summary.failed)
    return made


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


def summary_table(numbers: Numbers, summaries: Mapping[str, SimpleNamespace], caption: str) -> Markup:
    """Return the recommended method on each motion at one accuracy, with a column for each conserved quantity."""
    asked = [name for name in CONSERVED if any(name in set(summary.advice["conserve"]) for summary in summaries.values())]
    rows = []
    for work in numbers.works:
        advice = summaries[work.key].advice
        choices = advice[advice["level"] == MIDDLE].set_index("conserve").to_dict("index")
        rows.append([work.title, work.t_end, *(chosen(choices[name]) if name in choices else Markup(NONE) for name in asked)])
    frame = pd.DataFrame(rows, columns=["motion", "t", *asked], dtype=object)
    formats: Formats = {"motion": text, "t": count} | dict.fromkeys(asked, text)
    return table("summary", frame, formats, {"t": "to <i>t</i><small>s</small>"} | WORDS, caption)


def chosen(row: Mapping[Any, Any]) -> Markup:
    """Return a method with its step size or tolerance."""
    return Markup("{}<br>{}").format(code(row["method"]), setting(row["knob"], row["value"])) if row["method"] else Markup(NONE)


def winners_table(work: Work, frame: pd.DataFrame, resolutions: Mapping[Any, str], caption: str) -> Markup:
    """Return the cheapest methods by accuracy."""
    shown = frame.assign(
        at=column([setting(resolutions[method], value) for method, value in zip(frame["method"], frame["value"], strict=True)], frame)
    )
    formats: Formats = {"level": power_of_ten, "method": code, "at": text, "seconds": milliseconds, "next": named, "ratio": times}
    formats |= {"method_counted": named, "evaluations": count, "next_counted": named, "ratio_counted": times}
    headings = {
        "level": f"|Δ<i>{work.letter}</i>|",
        "method": "by time",
        "at": "with",
        "seconds": "ms",
        "next": "next",
        "ratio": TIMES_COST,
    }
    headings |= {
        "method_counted": "by evaluations",
        "evaluations": "count",
        "next_counted": "next",
        "ratio_counted": TIMES_COST,
    }
    return table(f"winners-{work.key}", shown, formats, headings, caption)


def front_table(work: Work, frame: pd.DataFrame, caption: str) -> Markup:
    """Return the Pareto front by time."""
    shown = frame.assign(at=column([setting(*pair) for pair in zip(frame["knob"], frame["value"], strict=True)], frame))
    formats: Formats = {"method": code, "at": text, work.error: number, "seconds": milliseconds, "evaluations": count}
    return table(f"front-{work.key}", shown, formats, {"at": "with", work.error: "error", "seconds": "CPU time<small>ms</small>"}, caption)


def keeps_table(work: Work, frame: pd.DataFrame, defects: pd.DataFrame, caption: str) -> Markup:
    """Return the quantities that each method conserves."""
    defect = frame["method"].map(defects.set_index("method")["defect"])
    shown = frame.assign(defect=defect, kept=column([verdict(row) for row in frame.to_dict("records")], frame))
    formats: Formats = {"method": code, "error": number, "kept": text, "energy_error": tiny}
    formats |= {name: tiny for name in ("g", "Gv", "casimirs", "integrals", "defect") if shown[name].notna().any()}
    headings = {"error": "smallest<small>error</small>", "kept": "energy<small>without drift</small>"}
    headings |= {"energy_error": "energy<small>error</small>", "g": "|<i>g</i>|", "Gv": "|<i>G H<sub>p</sub></i>|"}
    headings |= {"casimirs": "Casimir<small>error</small>", "integrals": "momentum<small>error</small>"}
    headings |= {"defect": f"{'structure' if work.poisson else 'two-form'}<small>defect</small>"}
    return table(f"keeps-{work.key}", shown, formats, headings, caption)


def verdict(row: Mapping[Any, Any]) -> Markup:
    """Return whether a method claims energy without drift, and from which step size or tolerance on none was measured."""
    if not row["claimed"]:
        return Markup("not claimed")
    if row["all"]:
        return Markup("yes")
    return Markup("from {}").format(setting(row["knob"], row["energy"])) if row["energy"] == row["energy"] else Markup("no")


def advice_table(work: Work, frame: pd.DataFrame, caption: str) -> Markup:
    """Return the recommendations."""
    records = frame.to_dict("records")
    shown = frame.assign(
        accuracy=column([power_of_ten(row["level"]) for row in records], frame),
        keep=[WORDS[row["conserve"]] for row in records],
        at=column([setting(row["knob"], row["value"]) if row["method"] else Markup(NONE) for row in records], frame),
    )
    formats: Formats = {"accuracy": text, "keep": text, "method": named, "at": text, "cost": milliseconds, "error": number}
    formats |= {"next": named, "ratio": times}
    headings = {"accuracy": f"|Δ<i>{work.letter}</i>|", "keep": "must conserve", "method": "take", "at": "with"}
    headings |= {
        "cost": "CPU time<small>ms</small>",
        "error": "error<small>reached</small>",
        "next": "next best",
        "ratio": TIMES_COST,
    }
    return table(f"advice-{work.key}", shown, formats, headings, caption)


def sentence(value: str) -> Markup:
    """Return a sentence that may wrap over several lines."""
    return Markup('<span class="long">{}</span>').format(value)


def failed_table(work: Work, frame: pd.DataFrame, caption: str) -> Markup:
    """Return the runs that show no number, and why."""
    pairs = zip(frame["knob"], frame["value"], strict=True)
    shown = frame.assign(at=column([setting(resolution or "h", value) for resolution, value in pairs], frame))
    return table(f"failed-{work.key}", shown, {"method": code, "at": text, "failure": sentence}, {"at": "with", "failure": "why"}, caption)
