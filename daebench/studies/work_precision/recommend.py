"""Recommended methods, with step size or tolerance, for an accuracy and quantities to be conserved."""

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from daebench.diagnostics.drift import BOUNDED, KEPT, UNDETERMINED
from daebench.studies.work_precision.study import cheapest
from daebench.systems.lazily import pandas as pd

ROUND_OFF = 1e-12
"""An error of a conserved quantity of the size of one, or a defect, up to this is round-off."""

EPS = float(np.finfo(float).eps)

LEAST = 3
"""Runs of a method that have to agree that it keeps something: a single one may do so by chance."""

CONSERVED = {
    "nothing": "nothing",
    "energy": "energy without drift",
    "constraints": "constraints to round-off",
    "casimirs": "Casimir functions to round-off",
    "two_form": "two-form (symplectic)",
}
"""What may be asked for, and its words."""


def with_conserved(table: "pd.DataFrame", defects: Mapping[str, float], claims: Mapping[str, Collection[str]]) -> "pd.DataFrame":
    """Return a table of a work-precision study with columns ``keeps_...``: what each run claims to keep and was measured to keep."""
    done = table["failure"] == ""
    two_form = done & (table["method"].map(defects) <= ROUND_OFF)
    unrefuted = two_form & _claiming(table, claims, "two_form") & (table["energy_verdict"] == UNDETERMINED)
    conserved = {"nothing": done, "energy": done & (table["energy_verdict"].isin((KEPT, BOUNDED)) | unrefuted)}
    if {"g", "Gv"} <= set(table.columns):
        conserved["constraints"] = done & (table[["g", "Gv"]].max(axis=1, skipna=False) <= ROUND_OFF)
    if "casimirs" in table and table["casimirs"].notna().any():
        added_up = (EPS * table["steps"]).clip(lower=ROUND_OFF)  # one rounding a step of a number of the size of one
        conserved["casimirs"] = done & (table["casimirs"] <= added_up)
    for name in set(conserved) - {"nothing"}:
        conserved[name] = _agreed(table, conserved[name])
    conserved["two_form"] = two_form
    claiming = {name: _claiming(table, claims, name) for name in conserved}
    parts = {"claims_energy": claiming["energy"], "measured_energy": conserved["energy"]}
    for name in set(conserved) - {"nothing"}:
        conserved[name] = conserved[name] & claiming[name]
    return table.assign(**parts, **{f"keeps_{name}": conserved[name] for name in CONSERVED if name in conserved})


def _claiming(table: "pd.DataFrame", claims: Mapping[str, Collection[str]], name: str) -> "pd.Series[bool]":
    """Return which runs are of methods that claim to keep something."""
    return table["method"].map({method: name in claims.get(method, ()) for method in set(table["method"])})


def _agreed(table: "pd.DataFrame", flags: "pd.Series[bool]") -> "pd.Series[bool]":
    """Return for which runs something holds, and for all of the same method with smaller values that came to their end."""
    done = table[table["failure"] == ""]
    agreed = pd.Series(False, index=table.index)
    for _, runs in done.sort_values("value").groupby("method"):
        so_far = flags[runs.index].cummin().to_numpy()
        if len(so_far) >= LEAST:
            agreed[runs.index] = so_far & so_far[LEAST - 1]
    return agreed


def recommended(table: "pd.DataFrame", error: str, cost: str, levels: Sequence[float]) -> "pd.DataFrame":
    """Return for each accuracy, and each thing that is to be conserved, the cheapest run that does both, and the next best method.

    The table is that of :func:`with_conserved`; columns are level, conserve, method, knob, value, cost, error, price, next, ratio; one row
    each of level and conserve. Cost and error are those of the run with this value; price is the cost of the accuracy itself, between
    runs, and ratio the factor by which the next method is more expensive there, see
    :func:`daebench.studies.work_precision.study.cheapest`. Where no run does both, method is "" and numbers are NaN.
    """
    nan = float("nan")
    rows = []
    for level in levels:
        for name in (quantity for quantity in CONSERVED if f"keeps_{quantity}" in table):
            keeping = table[table[f"keeps_{name}"]]
            row = {"level": level, "conserve": name, "method": "", "knob": "", "value": nan, "cost": nan, "error": nan}
            row |= {"price": nan, "next": "", "ratio": nan}
            for best in cheapest(keeping, error, cost, [level]).to_dict("records"):
                run = keeping[(keeping["method"] == best["method"]) & (keeping["value"] == best["value"])].iloc[0]
                row |= {"method": best["method"], "knob": run["knob"], "value": best["value"], "cost": run[cost], "error": run[error]}
                row |= {"price": best[cost], "next": best["next"], "ratio": best["ratio"]}
            rows.append(row)
    return pd.DataFrame(rows)
