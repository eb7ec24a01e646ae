"""Claims of each method beside its measurements, one row per method: the numbers of the first figure and the first table."""

from collections.abc import Mapping, Sequence
from types import SimpleNamespace
from typing import Any

import pandas as pd
from markupsafe import Markup

from daebench.diagnostics.drift import BOUNDED, DRIFTS, UNDETERMINED
from daebench.diagnostics.drift import KEPT as ROUND_OFF
from daebench.methods.fixed_step.compositions import COMPOSITIONS
from daebench.methods.fixed_step.parts import PROJECTIONS
from daebench.pages.report import NONE, count, with_error
from daebench.pages.report.claims import require
from daebench.pages.report.tables import Of, Table, code, long, tiny
from daebench.reports.methods.families import SYSTEMS, family, left_out, method
from daebench.reports.methods.sweep import PENDULUM, TORUS
from daebench.studies.claims.bench import FALLS_SHORT, NOT_APPLICABLE, OK

PROPERTIES: Mapping[str, str] = {
    "symmetric": "symmetric",
    "symplectic": "symplectic",
    "g": "keeps g",
    "Gv": "keeps G H_p",
    "H": "keeps H",
}
"""Columns of the matrix, and their names in ``daebench check``."""

KEPT, HIDDEN, LOST = "kept", "hidden", "lost"
"""Claimed and measured; not claimed, but round-off wherever it was measured; not claimed, and not round-off."""


def check_claims(claims: pd.DataFrame) -> None:
    """Test that no method falls short of a claim on either motion, and that each claim was measured and holds on at least one motion."""
    asked = claims[claims["property"] != "refused"]
    for row in asked[asked["verdict"] == FALLS_SHORT].to_dict("records"):
        claim = f"{row['method']} has order {row['claimed']}" if row["property"] == "order" else f"{row['method']}: {row['property']}"
        require(False, f"{claim} on {row['problem']}", f"{row['measured']:.3g} against a bound of {row['bound']:.3g}")
    claimed = asked[[value is not False and value is not None for value in asked["claimed"]]]
    for (name, property), findings in claimed.groupby(["method", "property"], sort=False):
        if set(findings["verdict"]) != {NOT_APPLICABLE}:
            require((findings["verdict"] == OK).any(), f"a claim of {name} was measured ({property})", ", ".join(findings["verdict"]))


def matrix(claims: pd.DataFrame) -> pd.DataFrame:
    """Return one row per method, see below; the worse of both motions counts.

    Columns: method, family, system, source, claimed (the order), order and order_error (measured, NaN where there is none), h and h_torus;
    for each key of :data:`PROPERTIES` its state and, with the suffix "_most", the largest defect or residual; and refused, the problems
    that the method does not take.
    """
    return pd.DataFrame([_row(str(name), findings) for name, findings in claims.groupby("method", sort=False)])


def _row(name: str, findings: pd.DataFrame) -> dict[str, Any]:
    claims = method(name).claims
    fits = findings[(findings["property"] == "order") & findings["measured"].notna()].sort_values("measured")
    row: dict[str, Any] = {
        "method": name,
        "family": family(name),
        "system": SYSTEMS.get(claims.system, claims.system),
        "source": source(name),
    }
    row |= {"claimed": claims.order, "order": _first(fits["measured"]), "order_error": _first(fits["standard_error"])}
    row |= {"orders": len(fits), "refused": ", ".join(findings.loc[findings["property"] == "refused", "problem"])}
    for key, property in PROPERTIES.items():
        row |= _state(key, findings[(findings["property"] == property) & (findings["verdict"] != NOT_APPLICABLE)])
    return row


def source(name: str) -> str:
    """Return the source of a method: of the scheme, and of the composition's weights or the projection."""
    fixed_step = method(name)
    parts = [fixed_step.claims.source]
    parts += [COMPOSITIONS[fixed_step.composition].source] if fixed_step.composition else []
    return "; ".join(parts + ([PROJECTIONS[fixed_step.projection]] if fixed_step.projection else []))


def _state(key: str, findings: pd.DataFrame) -> dict[str, Any]:
    """Return the state of a property and the largest number measured."""
    if findings.empty:
        return {key: "", f"{key}_most": float("nan")}
    claimed = any(claim is True for claim in findings["claimed"])
    hidden = bool((findings["measured"] <= findings["bound"]).all())
    return {key: KEPT if claimed else HIDDEN if hidden else LOST, f"{key}_most": findings["measured"].max()}


def _first(values: "pd.Series[float]") -> float:
    return float(values.iloc[0]) if len(values) else float("nan")


def over_time(table: pd.DataFrame, drift: pd.DataFrame) -> pd.DataFrame:
    """Return the table with the verdict of the long run in place of "lost": bounded, drifts or undetermined; lost where a run stopped."""
    seen = {ROUND_OFF: BOUNDED, BOUNDED: BOUNDED, DRIFTS: DRIFTS, UNDETERMINED: UNDETERMINED}
    verdicts = drift.set_index("method")
    rows = [dict(row) for row in table.to_dict("records")]
    for row in rows:
        for key in ("g", "Gv", "H"):
            if row[key] == LOST and row["method"] in verdicts.index:
                row[key] = seen.get(str(verdicts.loc[row["method"], f"{key}_long"]), LOST)
    return pd.DataFrame(rows, columns=list(table.columns))


def keeping(table: pd.DataFrame, *properties: str) -> list[str]:
    """Return the methods that claim, and thus keep, all of these properties."""
    chosen: Sequence[bool] = [all(row[column] == KEPT for column in properties) for row in table.to_dict("records")]
    return list(table.loc[list(chosen), "method"])


def tally(claims: pd.DataFrame, table: pd.DataFrame) -> SimpleNamespace:
    """Return the counts of claims and methods."""
    asked = claims[claims["property"] != "refused"]
    ode = table[table["family"].isin(["ode", "projected"])]
    untouched = ode.loc[ode["symplectic"] != LOST, "method"].tolist()
    require(not untouched, "no method of (1.18), projected or not, is symplectic", untouched)
    for key in ("symplectic", "g", "Gv", "H"):
        exceptions = table[(table["family"] == "ode") & (table[key] != LOST)]
        require(exceptions.empty, f"methods for (1.18) lose {key}", list(exceptions["method"]))
    uneven = [name for name in keeping(table, "symplectic") if name not in keeping(table, "symmetric")]
    tilted = list(table.loc[table["family"].isin(["symplectic", "composed"]) & (table["Gv"] == LOST), "method"])
    off = list(table.loc[table["family"].isin(["symplectic", "composed"]) & (table["g"] == LOST), "method"])
    require(not off, "symplectic methods for (1.9) keep the constraint", off)
    everything = keeping(table, "symmetric", "symplectic", "g", "Gv")
    refused = list(table.loc[table["refused"] == TORUS.problem, "method"])
    hidden = {key: list(table.loc[table[key] == HIDDEN, "method"]) for key in ("symmetric", "symplectic", "g", "Gv", "H")}
    return SimpleNamespace(
        methods=len(table),
        held=(asked["verdict"] == OK).sum(),
        everything=everything,
        schemes=list(dict.fromkeys(method(name).scheme for name in everything)),
        uneven=uneven,
        tilted=tilted,
        symplectic=keeping(table, "symplectic"),
        energy=keeping(table, "H"),
        hidden={key: names for key, names in hidden.items() if names},
        refused=[name for name in refused if not method(name).claims.constraints],
        distances=[name for name in refused if method(name).claims.constraints],
        left_out=left_out(),
        shorter=shorter(claims),
    )


def shorter(claims: pd.DataFrame) -> list[tuple[str, float]]:
    """Return the methods that complete the pendulum's run only with a step size below half of its step size, and these step sizes."""
    pendulum_claims = claims[(claims["problem"] == PENDULUM.problem) & claims["h"].notna()]
    return [(str(name), float(h)) for name, h in pendulum_claims.groupby("method", sort=False)["h"].first().items() if h < PENDULUM.h / 2]


WORDS = {KEPT: "yes", LOST: "no", "hidden": "(yes)", BOUNDED: "bounded", DRIFTS: "drifts", UNDETERMINED: "?"}


def methods_table(table: pd.DataFrame, drift: pd.DataFrame) -> Table:
    """Return one row per method: its order, and each property with the largest measured number."""
    headings = {
        "symmetric": "symmetric",
        "symplectic": "symplectic",
        "g": "<i>g</i> = 0",
        "Gv": "<i>G H<sub>p</sub></i> = 0",
        "H": "energy",
    }
    columns = {
        "method": code,
        "claimed": (count, "order<small>claimed</small>"),
        "measured": (Of(with_error, "order", "order_error"), "order<small>measured</small>"),
    }
    columns |= {key: (Of(cell, key, f"{key}_most"), heading) for key, heading in headings.items()}
    return Table(over_time(table, drift), columns, table)


SOURCES = {"method": code, "system": "solves", "source": long}
"""The equations that each method solves, and its source."""


def cell(state: str, most: float) -> Markup:
    """Return whether a property is kept, and the largest defect."""
    return Markup(NONE) if not state else Markup("{} <small>{}</small>").format(WORDS[state], tiny(most))
