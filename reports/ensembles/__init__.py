"""Errors, winners, failures and verdicts from a thousand starts of one energy, and their cost."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from types import SimpleNamespace

import pandas as pd

from daebench.pages.report import Progress, number, percent
from daebench.pages.report.claims import require
from daebench.pages.report.page import constants, make_report
from daebench.pages.report.tables import Columns, Table, code
from daebench.pages.report.thumbnail import draw_thumbnail
from daebench.reports.ensembles import errors, measured, motions, verdicts
from daebench.reports.ensembles.measured import Numbers, measure
from daebench.reports.ensembles.motions import METHODS

CONSTANTS = constants(motions, errors, verdicts, measured)


def make(out: Path, progress: Progress) -> Path:
    """Make the report in a folder; return the path of its page, see :func:`daebench.pages.report.page.make_report`."""
    return make_report("ensembles", out, progress, measure, check, draw, tables, c=CONSTANTS)


def check(numbers: Numbers) -> SimpleNamespace:
    """Return the numbers of the text; the first sentence that does not hold raises ClaimRefuted."""
    sizes, first, said, failures = (
        errors.errors(numbers.runs),
        errors.winners(numbers.runs),
        verdicts.trends(numbers.runs),
        verdicts.failed(numbers.runs),
    )
    titles = {motion.key: motion.title for motion in numbers.motions}
    return SimpleNamespace(
        titles=titles,
        starts=int(numbers.runs["start"].max()) + 1,
        total=len(numbers.runs),
        errors=errors.spread(sizes),
        sizes=sizes,
        first=errors.order(first),
        winners=first,
        failures=failures,
        hidden=verdicts.hidden(failures),
        trends=said,
        verdict=verdicts.agreement(said),
        price=price(numbers.alone),
        distributions=numbers.starts,
    )


def price(alone: pd.DataFrame) -> SimpleNamespace:
    """Return the time of a single start over that of one of many."""
    require((alone["starts"] > 1).all(), "one start of many costs less than a single start", alone["starts"].tolist())
    return SimpleNamespace(least=alone["starts"].min(), most=alone["starts"].max())


def draw(numbers: Numbers, findings: SimpleNamespace, folder: Path) -> Iterator[Path]:
    """Draw all figures into a folder, and give the paths of the SVG files."""
    yield errors.draw_errors(findings.sizes, findings.titles, folder)
    yield errors.draw_winners(findings.winners, findings.titles, folder)
    yield verdicts.draw_verdicts(findings.trends, findings.titles, folder)
    yield draw_thumbnail(folder, lambda axis: errors.thumbnail(axis, findings))


def tables(numbers: Numbers, findings: SimpleNamespace) -> Mapping[str, Table | pd.DataFrame]:
    """Return the tables."""
    motion: Columns = {"motion": findings.titles.get}
    setting: Columns = motion | {"method": code, "h": (number, "<i>h</i>")}
    every = {method: str(code(method)) for method in METHODS}
    prices = numbers.prices.pivot(index="motion", columns="method", values="ratio").reset_index()
    return {
        "errors": Table(
            findings.sizes,
            setting
            | {"own": (number, "case"), "low": (number, "5 %"), "median": number, "high": (number, "95 %")}
            | {"rank": (percent, "starts with less")},
        ),
        "winners": Table(
            findings.winners,
            motion
            | {
                "price": lambda fraction: "1" if fraction == 1 else f"{fraction} times that",
                "own": (lambda method: code(method) if method else "none", "best, case"),
                "most": (code, "best from the most starts"),
                "part": (percent, "of the starts"),
                "error": (percent, "±"),
            }
            | {method: (percent, heading) for method, heading in every.items()},
        ),
        "failures": Table(
            findings.failures,
            setting
            | {
                "part": (percent, "stopped"),
                "own": (lambda why: why or "reached its end", "the case"),
                "why": "why, and how many",
            },
        ),
        "verdicts": Table(
            findings.trends,
            setting
            | {"own": "case", "flat": (percent, "no drift"), "undetermined": percent, "drifts": percent, "failed": (percent, "stopped")},
        ),
        "price": Table(
            numbers.alone.merge(prices, on="motion"),
            motion
            | {"alone": (number, "alone [ns]"), "together": (number, "of many [ns]"), "starts": (number, "times")}
            | {method: (number, heading) for method, heading in every.items() if method != METHODS[0]},
        ),
    }
