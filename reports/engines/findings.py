"""Findings of the report on engines: accuracy at equal cost, verdicts on energies, statements of documentation, tested; tables."""

import math
from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup

from daebench.diagnostics.drift import FAILED
from daebench.pages.report import MINUS, count, number, power_of_ten
from daebench.pages.report.claims import require
from daebench.pages.report.sentences import exponent_text
from daebench.pages.report.tables import Of, Table, long, part, text, tiny
from daebench.reports.engines.documentation import HOLDS, NOT, PART
from daebench.reports.engines.measured import IDA, KAHAN, OWN, RATTLE, Numbers
from daebench.reports.engines.motions import BY_KEY

SAME = 0.02
"""Relative tolerance for the errors of different codes of one scheme with one step size."""

TWINS = (("Mici", "constrained leapfrog"), ("OpenMM", "RATTLE, tolerance 1e-12"))
"""Settings that are RATTLE in another code."""

ROUNDED = 1e4
"""Errors this many times above the bound of the reference are errors of the scheme, not round-off."""

SINGULAR = "iftomm"
"""Motion that passes a configuration in which G loses rank."""

LEVELS = (1e-2, 1e-4, 1e-6, 1e-8)
"""Errors for which the page says who reaches them first."""

LEVEL = 1e-3
"""Error for which the table gives a time."""


def check(numbers: Numbers) -> SimpleNamespace:
    """Return the numbers of the page; the first sentence that does not hold raises ClaimRefuted."""
    runs, chosen = numbers.runs, numbers.chosen
    if not numbers.engines:
        return SimpleNamespace(engines=[], firsts=[], unfinished=[], sentences=counted(numbers.sentences))
    failed = runs[runs["failure"] != ""]
    require(failed["error"].isna().all() and failed["seconds"].isna().all(), "failed runs show no number", len(failed))
    done = runs[runs["failure"] == ""]
    require((done["error"] >= done["bound"]).all(), "no error is below the error bound of the reference", done["error"].min())
    within = chosen[chosen["within"]]
    budgets = within["motion"].map(lambda key: BY_KEY[key].budget)
    require((within["seconds"] <= budgets).all(), "runs at equal cost are within the budget", within["seconds"].max())
    return SimpleNamespace(
        engines=[engine.name for engine in numbers.engines],
        contenders=len(chosen[chosen["engine"] != OWN]),
        total=len(runs),
        failed=len(failed),
        firsts=[first(motion, rows) for motion, rows in chosen.groupby("motion", sort=False)],
        reduced=against_rattle(chosen, constrained=False),
        closed=against_rattle(chosen, constrained=True),
        races=[race(runs, error) for error in LEVELS],
        owns=[name for name in (RATTLE, IDA, KAHAN) if name in set(runs[runs["engine"] == OWN]["setting"])],
        verdicts=verdicts(chosen),
        twins=twins(runs),
        sentences=counted(numbers.sentences),
        unfinished=unfinished(chosen),
        singular=singular(runs),
    )


def first(motion: Any, rows: pd.DataFrame) -> SimpleNamespace:
    """Return the most accurate engine on a motion at equal cost, the most accurate one with constraints, and RATTLE."""
    good = rows[(rows["failure"] == "") & rows["within"]]
    engines = good[good["engine"] != OWN].sort_values("error")
    tied = engines[engines["constrained"]]
    rattle = part(good, engine=OWN, setting=RATTLE)
    best = engines.iloc[0] if len(engines) else None
    closed = tied.iloc[0] if len(tied) else None
    same = best is not None and closed is not None and best.name == closed.name
    return SimpleNamespace(
        motion=BY_KEY[str(motion)],
        best=best,
        closed=None if same else closed,
        rattle=float(rattle["error"].iloc[0]) if len(rattle) else float("nan"),
    )


def against_rattle(chosen: pd.DataFrame, *, constrained: bool) -> SimpleNamespace:
    """Return the motions on which an engine is more accurate than RATTLE at equal cost, in reduced coordinates or with constraints."""
    won, motions = [], 0
    for motion, rows in chosen.groupby("motion", sort=False):
        known = rows[(rows["engine"] == OWN) & (rows["setting"] == RATTLE) & rows["within"]]["error"]
        rivals = rows[(rows["engine"] != OWN) & rows["within"] & (rows["constrained"] == constrained) & (rows["failure"] == "")]
        if len(known) and len(rivals):
            motions += 1
            if rivals["error"].min() < known.iloc[0]:
                won.append(BY_KEY[str(motion)].title)
    return SimpleNamespace(motions=motions, won=won)


def race(runs: pd.DataFrame, error: float) -> SimpleNamespace:
    """Return who is the first in CPU time to reach an error on each motion.

    ``rattle`` is on how many motions RATTLE of daebench comes before all engines, ``own`` on how many any method of daebench does,
    ``tied`` and ``reduced`` the motions on which an engine is the first of all, with and without constraints, and ``nobody`` on how many
    no run reaches the error.
    """
    enough = runs[(runs["failure"] == "") & (runs["error"] <= error)]
    counts = {"rattle": 0, "own": 0, "nobody": 0}
    won: dict[bool, list[str]] = {True: [], False: []}
    for key in dict.fromkeys(runs["motion"]):
        rows = enough[enough["motion"] == key]
        engines, ours = rows[rows["engine"] != OWN], rows[rows["engine"] == OWN]
        rival = float(engines["seconds"].min()) if len(engines) else np.inf
        counts["rattle"] += bool((ours[ours["setting"] == RATTLE]["seconds"] < rival).any())
        counts["own"] += (first := bool((ours["seconds"] < rival).any()))
        counts["nobody"] += not len(rows)
        if len(engines) and not first:
            won[bool(engines.loc[engines["seconds"].idxmin(), "constrained"])].append(BY_KEY[str(key)].title)
    return SimpleNamespace(error=error, motions=runs["motion"].nunique(), tied=won[True], reduced=won[False], **counts)


def verdicts(chosen: pd.DataFrame) -> list[tuple[str, int, int]]:
    """Return the number of settings of engines by the verdict on their energy, and how many of these have constraints."""
    engines = chosen[chosen["engine"] != OWN]
    counts = engines["verdict"].value_counts()
    return [(str(verdict), int(n), int(engines[engines["verdict"] == verdict]["constrained"].sum())) for verdict, n in counts.items()]


def twins(runs: pd.DataFrame) -> SimpleNamespace:
    """Test that codes of RATTLE agree in their errors with daebench's at the same step sizes; return how well, over how many runs.

    Where G loses rank, rounding decides how a run continues; motions with such places are left out.
    """
    runs = runs[runs["motion"] != SINGULAR]
    ours = part(runs, engine=OWN, setting=RATTLE).set_index(["motion", "value"])["error"]
    names, worst, count = [], 0.0, 0
    for engine, setting in TWINS:
        rows = part(runs, engine=engine, setting=setting, failure="")
        theirs = rows[rows["error"] > ROUNDED * rows["bound"]].set_index(["motion", "value"])["error"]
        both = ours.index.intersection(theirs.index)
        if len(both):
            names.append(engine)
            count += len(both)
            worst = max(worst, float(np.max(np.abs(theirs[both] / ours[both] - 1))))
    require(worst <= SAME, f"RATTLE of {' and '.join(names)} agrees with daebench's", f"a relative difference of {worst:.1e}")
    return SimpleNamespace(names=names, worst=worst, count=count)


def counted(sentences: pd.DataFrame) -> SimpleNamespace:
    """Return how many statements of documentation hold, hold in part, and do not hold."""
    values = list(sentences["verdict"]) if len(sentences) else []
    require(set(values) <= {HOLDS, PART, NOT}, "each statement has a verdict", sorted(set(values)))
    return SimpleNamespace(total=len(values), holds=values.count(HOLDS), part=values.count(PART), no=values.count(NOT))


def singular(runs: pd.DataFrame) -> SimpleNamespace | None:
    """Return how many runs through the singularity did not reach their end, and how many of RATTLE; None if there are none."""
    rows = runs[runs["motion"] == SINGULAR]
    if not len(rows):
        return None
    stopped = rows["failure"] != ""
    rattle = (rows["engine"] == OWN) & (rows["setting"] == RATTLE)
    counts = {"failed": int(stopped.sum()), "total": len(rows), "rattle_failed": int((stopped & rattle).sum()), "rattle": int(rattle.sum())}
    return SimpleNamespace(**counts)


def unfinished(chosen: pd.DataFrame) -> list[tuple[str, str, str, str]]:
    """Return the settings of which no run reached its end: engine, setting, motion and why the last did not."""
    rows = chosen[chosen["failure"] != ""]
    return [(row["engine"], row["setting"], BY_KEY[row["motion"]].title, row["failure"]) for row in rows.to_dict("records")]


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


def motion_table(key: str, chosen: pd.DataFrame, runs: pd.DataFrame) -> Table:
    """Return the contenders of a motion at equal cost, daebench's own first, then by their error."""
    ours, others = part(chosen, engine=OWN), chosen[chosen["engine"] != OWN].sort_values("error")
    rows, mine = pd.concat([ours, others], ignore_index=True), part(runs, motion=key)
    level = [time_for(part(mine, engine=engine, setting=setting), LEVEL) for engine, setting in rows[["engine", "setting"]].to_numpy()]
    known = time_for(part(mine, engine=OWN, setting=RATTLE), LEVEL) if len(part(ours, setting=RATTLE)) else np.nan
    return Table(
        rows.assign(milliseconds=1e3 * rows["seconds"], level=level, times=np.array(level) / known),
        {
            "engine": Of(named),
            "at": (Of(at), "with"),
            "error": (number, "error<small>at t = 10</small>"),
            "g": (tiny, "|<i>g</i>|"),
            "Gv": (tiny, "|<i>G v</i>|"),
            "energy_error": (tiny, "energy<small>error</small>"),
            "energy": (Of(verdict), f"energy<small>to t = {BY_KEY[key].long:g}</small>"),
            "order": (number, "order<small>measured</small>"),
            "milliseconds": (number, "time<small>ms</small>"),
            "level": (number, f"time to 10<sup>{MINUS}3</sup><small>ms</small>"),
            "times": (number, "ratio<small>to RATTLE's time</small>"),
        },
        {},
    )


def phrase(value: str) -> Markup:
    """Return a few words that may wrap over several lines."""
    return Markup('<span class="phrase">{}</span>').format(value)


def markup(value: str) -> Markup:
    """Return a sentence in HTML that may wrap over several lines."""
    return long(Markup(value))


DOCUMENTATION = {
    "engine": text,
    "place": (phrase, "where"),
    "sentence": (markup, "statement, paraphrased"),
    "measured": markup,
    "verdict": phrase,
}
"""Statements of documentation, and the measurements."""


def tuned_table(frame: pd.DataFrame) -> Table:
    """Return the free numbers of settings that were tried, and the chosen ones."""
    rows = []
    for (engine, setting, motion), tried in frame.groupby(["engine", "setting", "motion"], sort=False):
        taken = tried[tried["taken"]].iloc[0]
        row = {"engine": engine, "setting": setting, "motion": BY_KEY[str(motion)].title, "value": float(taken["value"])}
        row |= {"variant": taken["variant"], "error": float(taken["error"]), "median": tried["error"].median()}
        rows.append(row | {"tried": len(tried), "failed": int(tried["error"].isna().sum())})
    return Table(
        pd.DataFrame(rows),
        {
            "engine": text,
            "setting": text,
            "motion": text,
            "value": (number, "h<small>s</small>"),
            "variant": "taken",
            "error": (number, "its error<small>at t = 10</small>"),
            "median": (number, "median<small>of all</small>"),
            "tried": count,
            "failed": count,
        },
        frame,
    )
