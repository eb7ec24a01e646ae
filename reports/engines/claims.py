"""Claims of the report on engines: accuracy at equal cost, verdicts on energies, and statements of documentation, tested on numbers."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd

from daebench.pages.report.claims import require
from daebench.reports.engines.documentation import HOLDS, NOT, PART
from daebench.reports.engines.motions import BY_KEY
from daebench.reports.engines.numbers import IDA, KAHAN, OWN, RATTLE, Numbers

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
    rattle = good[(good["engine"] == OWN) & (good["setting"] == RATTLE)]
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
        engines, own = rows[rows["engine"] != OWN], rows[rows["engine"] == OWN]
        rival = float(engines["seconds"].min()) if len(engines) else np.inf
        counts["rattle"] += bool((own[own["setting"] == RATTLE]["seconds"] < rival).any())
        counts["own"] += (first := bool((own["seconds"] < rival).any()))
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
    own = runs[(runs["engine"] == OWN) & (runs["setting"] == RATTLE)].set_index(["motion", "value"])["error"]
    names, worst, count = [], 0.0, 0
    for engine, setting in TWINS:
        rows = runs[(runs["engine"] == engine) & (runs["setting"] == setting) & (runs["failure"] == "")]
        theirs = rows[rows["error"] > ROUNDED * rows["bound"]].set_index(["motion", "value"])["error"]
        both = own.index.intersection(theirs.index)
        if len(both):
            names.append(engine)
            count += len(both)
            worst = max(worst, float(np.max(np.abs(theirs[both] / own[both] - 1))))
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
