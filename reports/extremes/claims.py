"""Claims of the report on extremes, tested on the numbers before they are printed."""

from types import SimpleNamespace

import pandas as pd

from daebench.pages.report.claims import require
from daebench.reports.extremes.numbers import Numbers
from daebench.studies.grid.outcomes import FINE, OUTCOMES
from daebench.studies.grid.rows import by_method

ON_MANIFOLD = 1e-12
"""Largest |g|, in squares of a length of 1, of a scheme that keeps it to round-off."""


def check(numbers: Numbers) -> SimpleNamespace:
    """Return the numbers of the text; the first sentence that does not hold raises ClaimRefuted."""
    for key, table in numbers.tables.items():
        require(len(table), f"the section {key} has runs", "none")
    words = set(numbers.tables["map"]["outcome"])
    return SimpleNamespace(
        runs=sum(len(table) for table in numbers.tables.values()) + len(numbers.precision),
        steps=limits(numbers.tables["steps"]),
        masses=ratios(numbers.tables["masses"]),
        chaos=horizons(numbers.tables["chaos"]),
        outcomes={word: OUTCOMES[word] for word in OUTCOMES if word in words},
    )


def limits(table: pd.DataFrame) -> SimpleNamespace:
    """Return the methods that keep the energy with the largest steps, and those whose runs reach their end with much larger steps.

    If several methods reach the end with the largest step that was tried, their limit is not known: all of them are named.
    """
    both = table.pivot(index="method", columns="verdict", values="h")
    require((both["keeps the energy"] <= both["completes"]).all(), "a run that keeps the energy reaches its end", both)
    energy_steps = both["keeps the energy"]
    room = (both["completes"] / energy_steps)[energy_steps > 0].sort_values(ascending=False)
    open_end = set(table[(table["verdict"] == "completes") & (table["fails"] == float("inf"))]["method"])
    most = room[room.index.isin(open_end)] if open_end & set(room.index) else room.iloc[:1]
    facts = {"most": list(most.index), "room": [float(x) for x in most], "least": bool(open_end)}
    return SimpleNamespace(best=list(energy_steps[energy_steps == energy_steps.max()].index), h=float(energy_steps.max()), **facts)


def ratios(table: pd.DataFrame) -> SimpleNamespace:
    """Return the methods that are fine for all masses, and test that RATTLE keeps the manifold wherever it reaches its end."""
    rattle = table[(table["method"] == "rattle") & (table["failure"] == "")]
    require((rattle["g"] <= ON_MANIFOLD).all(), "RATTLE keeps the constraints to round-off for every mass", rattle["g"].max())
    methods = by_method(table)
    through = [name for name, rows in methods if (rows["failure"] == "").all()]
    fine = [name for name, rows in methods if (rows["outcome"] == FINE).all()]
    return SimpleNamespace(through=through, fine=fine, g=float(rattle["g"].max()), n=len(methods))


def horizons(table: pd.DataFrame) -> SimpleNamespace:
    """Return the time at which double precision ends, and test that no run follows the motion beyond it."""
    double = float(table["double_horizon"].iloc[0])
    longest = float(table["horizon"].max())
    require(longest <= double * 1.1, "no run follows the chaotic motion beyond what double precision allows", (longest, double))
    end, grown = (float(table[name].iloc[0]) for name in ("t_end", "grown"))
    facts = {
        "longest": longest,
        "methods": list(dict.fromkeys(table["method"][table["horizon"] == longest])),
        "tenfold": float(table["tenfold"].iloc[0]),
    }
    return SimpleNamespace(double=double, end=end, rounding=grown * 2.0**-53, **facts)
