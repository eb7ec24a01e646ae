"""The tables of the report on index reduction."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd
from markupsafe import Markup

from daebench.draw.figures import save_table
from daebench.pages.report import count, number, power_of_ten, table, with_error
from daebench.pages.report.tables import Formats, Tabulate, code, column, text, tiny
from daebench.reports.index_reduction.figures import label
from daebench.reports.index_reduction.numbers import DEFECT_STEPS, FAST, SLOW, T_LONG, Numbers

SHOWN_TOLERANCES = (1e-6, 1e-9, 1e-12)


def tables(numbers: Numbers, ida: pd.DataFrame, folder: Path) -> Mapping[str, Tabulate]:
    """Write the tables as CSV into a folder, all columns and rows, and return functions from a caption to HTML, by name."""
    for stem, data in (("schemes", numbers.table), ("orders", numbers.errors), ("ida", ida)):
        save_table(folder / f"{stem}.csv", data)
    makers = {"structure": structure, "drift": drifts, "cost": cost}
    return {name: partial(maker, numbers.table) for name, maker in makers.items()} | {"ida": partial(ida_table, ida)}


def pairs(frame: pd.DataFrame, name: str) -> "pd.Series[Any]":
    """Return a column with its standard errors."""
    return column([with_error(*pair) for pair in zip(frame[name], frame[f"{name}_error"], strict=True)], frame)


def structure(frame: pd.DataFrame, caption: str) -> Markup:
    """Return order, two-form and symmetry of each scheme, claimed and measured."""
    yes = {name: [("yes" if claim else "no") for claim in frame[f"claimed_{name}"]] for name in ("symplectic", "symmetric")}
    shown = pd.DataFrame(
        {
            "method": frame["method"],
            "equations": ["(1.18)" if system == "ode" else "(1.9)" for system in frame["system"]],
            "claimed_order": frame["claimed_order"],
            "order_q": pairs(frame, "order_q"),
            **yes,
            "symplecticity": frame["symplecticity"],
            "reversibility": frame["reversibility"],
        }
    )
    formats: Formats = {"method": code, "equations": text, "claimed_order": text, "order_q": text}
    formats |= {"symplectic": text, "symplecticity": tiny, "symmetric": text, "reversibility": tiny}
    headings = {
        "method": "scheme",
        "equations": "applied to",
        "claimed_order": "order<small>claimed</small>",
        "order_q": "order in <i>q</i><small>measured</small>",
        "symplectic": "symplectic<small>claimed</small>",
        "symplecticity": f"defect<small>{DEFECT_STEPS} steps</small>",
        "symmetric": "symmetric<small>claimed</small>",
        "reversibility": "defect<small>1 step</small>",
    }
    return table("structure", shown, formats, headings, caption)


def growth(row: Mapping[Any, Any]) -> Markup:
    """Return the growth exponent in words or as a number."""
    kind = str(row["kind"])
    return (
        Markup("{} ({})").format(with_error(row["growth"], row["growth_error"]), kind) if row["growth"] == row["growth"] else Markup(kind)
    )


def drifts(frame: pd.DataFrame, caption: str) -> Markup:
    """Return the errors of energy, constraints and angular momentum."""
    shown = frame.assign(slope=pairs(frame, "slope"), growth=column([growth(row) for row in frame.to_dict("records")], frame))
    formats: Formats = {"method": code, "energy_error": tiny, "slope": text, "growth": text, "g": tiny, "Gv": tiny, "L3": tiny}
    headings = {
        "method": "scheme",
        "energy_error": "energy error<small>largest</small>",
        "slope": "slope<small>per unit of time</small>",
        "growth": f"growth exponent<small>to t = {T_LONG:g}</small>",
        "g": "|<i>g</i>|<small>largest</small>",
        "Gv": "|<i>G H<sub>p</sub></i>|<small>largest</small>",
        "L3": "<i>L</i><sub>3</sub> error<small>largest</small>",
    }
    return table("drift", shown, formats, headings, caption)


def cost(frame: pd.DataFrame, caption: str) -> Markup:
    """Return the work of a step and its time."""
    kinds = ("newton", "H_p", "H_q", "g", "G", "second", "solve")
    formats: Formats = {"method": code} | {f"work_{kind}": lambda value: number(value, 3) if value else Markup("0") for kind in kinds}
    headings = {
        "method": "scheme",
        "work_newton": "Newton<small>iterations</small>",
        "work_H_p": "<i>H<sub>p</sub></i>",
        "work_H_q": "<i>H<sub>q</sub></i>",
        "work_g": "<i>g</i>",
        "work_G": "<i>G</i>",
        "work_second": "second<small>derivatives</small>",
        "work_solve": "linear<small>solves</small>",
        "ns_per_step": "time<small>ns</small>",
    }
    return table("cost", frame, formats | {"ns_per_step": lambda value: number(value, 3)}, headings, caption)


def ida_table(ida: pd.DataFrame, caption: str) -> Markup:
    """Return a selection of IDA's runs."""
    shown = ida[[any(abs(tol / chosen - 1) < 1e-9 for chosen in SHOWN_TOLERANCES) for tol in ida["tol"]]]
    shown = shown.assign(
        case=shown["case"].map({SLOW: "slow", FAST: "fast"}),
        formulation=shown["formulation"].map(label),
        ms=1e3 * shown["seconds"],
    )
    formats: Formats = {"case": text, "formulation": text, "tol": power_of_ten}
    formats |= {"error": number, "g": number, "Gv": number, "steps": count, "ms": lambda value: number(value, 2)}
    headings = {
        "case": "swing",
        "tol": "tolerance",
        "error": "position error",
        "g": "|<i>g</i>|",
        "Gv": "|<i>G H<sub>p</sub></i>|",
        "ms": "CPU time<small>ms</small>",
    }
    return table("ida", shown, formats, headings, caption)
