"""Claims of each method beside its measurements, one row per method: the numbers of the first figure and the first table."""

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd

from daebench.diagnostics.drift import BOUNDED, DRIFTS, UNDETERMINED
from daebench.diagnostics.drift import KEPT as ROUND_OFF
from daebench.methods.fixed_step.compositions import COMPOSITIONS
from daebench.methods.fixed_step.parts import PROJECTIONS
from daebench.pages.report.claims import require
from daebench.reports.methods.families import SYSTEMS, family, method
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
    """Test that no method falls short of a claim on either motion, and that each claim was measured and holds on at least one motion.

    Raises
    ------
    ClaimRefuted
        If one does not hold.
    """
    asked = claims[claims["property"] != "refused"]
    for row in asked[asked["verdict"] == FALLS_SHORT].to_dict("records"):
        claim = f"{row['method']} has order {row['claimed']}" if row["property"] == "order" else f"{row['method']}: {row['property']}"
        require(False, f"{claim} on {row['problem']}", f"{row['measured']:.3g} against a bound of {row['bound']:.3g}")
    made = asked[[value is not False and value is not None for value in asked["claimed"]]]
    for (name, property), findings in made.groupby(["method", "property"], sort=False):
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
    """Return the table with the verdict of the long run in the place of "lost": bounded, drifts or undetermined; lost where a run stopped.

    Parameters
    ----------
    table : DataFrame
        A row a method, as :func:`matrix` returns it; IDA's rows may be among them.
    drift : DataFrame
        A row a long run: columns method, g_long, Gv_long and H_long, names of verdicts.
    """
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
