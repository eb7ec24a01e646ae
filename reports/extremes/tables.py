"""The tables of the report on extremes, each with its data as CSV."""

import re
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path

from markupsafe import Markup, escape

from daebench.draw.figures import save_table
from daebench.pages.report import number, table
from daebench.reports.extremes import ivps
from daebench.reports.extremes.by_method import BY_EXTREME, Layout
from daebench.reports.extremes.numbers import Numbers
from daebench.studies.grid.rows import error_of
from daebench.studies.precision.study import smallest_steps


def tables(numbers: Numbers, folder: Path) -> dict[str, Callable[[str], Markup]]:
    """Write the tables as CSV; return what makes HTML of each, given a caption."""
    steps = numbers.tables["steps"]
    limits = steps.pivot(index="method", columns="verdict", values="h").reindex(list(dict.fromkeys(steps["method"]))).reset_index()
    limits["why"] = list(steps[steps["verdict"] == "completes"]["why"].map(_reason))
    limits["why"] = limits["why"].where(limits["why"] != "", "none; the largest step tried")
    precise = smallest_steps(numbers.precision)
    error = error_of(precise)
    layouts: dict[str, Layout] = {
        "limits": (
            limits,
            {"method": str, "completes": number, "keeps the energy": number, "why": str},
            {"completes": "reaches its end up to <i>h</i>", "keeps the energy": "keeps the energy up to", "why": "what ends it"},
        ),
        "precision": (
            precise,
            {
                "method": str,
                "way": str,
                "value": number,
                "time_ratio": number,
                error: number,
                "energy_error": number,
                "energy_verdict": str,
                "g": number,
                "defect": number,
            },
            {
                "value": "<i>h</i>",
                "time_ratio": "time",
                error: "error of <i>q</i>",
                "energy_error": "energy error",
                "energy_verdict": "energy",
                "g": "|<i>g</i>|",
                "defect": "two-form",
            },
        ),
    }
    shown = [section for section in ivps.SECTIONS if section.extreme in BY_EXTREME and section.key in numbers.tables]
    layouts |= {section.key: BY_EXTREME[section.extreme](numbers.tables[section.key]) for section in shown}
    for name, (frame, _, _) in layouts.items():
        save_table(folder / f"{name}.csv", frame)
    return {name: partial(table, name, *parts) for name, parts in layouts.items()}


def _reason(why: str) -> str:
    """Return the reason in the message of a failure, without place and advice."""
    return why.rpartition("): ")[2].split(";")[0].rstrip(".")


def typeset(sentence: str, methods: Iterable[str]) -> Markup:
    """Return a sentence as HTML: names of methods as code, and powers of ten as such."""
    names = "|".join(re.escape(name) for name in sorted(methods, key=len, reverse=True))
    html = str(escape(sentence))
    html = re.sub(rf"(?<![\w:/+])({names})(?![\w/+]|:\w)", r"<code>\1</code>", html) if names else html
    return Markup(re.sub(r"(?<![\w.=])(\d(?:\.\d+)?e[+-]\d+)", lambda power: str(number(float(power[1]))), html))
