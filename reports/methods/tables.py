"""The tables of the report on methods."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup

from daebench.diagnostics.drift import BOUNDED, DRIFTS, UNDETERMINED
from daebench.draw.figures import save_table
from daebench.pages.report import NONE, count, number, table, with_error
from daebench.pages.report.tables import Formats, Tabulate, code, column, text, tiny
from daebench.reports.methods.guide import EVALUATIONS
from daebench.reports.methods.matrix import KEPT, LOST, PROPERTIES, over_time
from daebench.reports.methods.numbers import Numbers
from daebench.reports.methods.series import powers

WORDS = {KEPT: "yes", LOST: "no", "hidden": "(yes)", BOUNDED: "bounded", DRIFTS: "drifts", UNDETERMINED: "?"}


def tables(numbers: Numbers, matrix: pd.DataFrame, folder: Path) -> Mapping[str, Tabulate]:
    """Write the tables as CSV into a folder, all columns and rows, and return functions from a caption to HTML, by name."""
    fitted_powers = powers(numbers.defects)
    stems = {"methods": matrix, "claims": numbers.claims, "orders": numbers.orders, "powers": fitted_powers, "work": numbers.work}
    stems |= {"long": numbers.drift, "ida": numbers.ida, "reverse": numbers.reverse}
    for stem, data in stems.items():
        save_table(folder / f"{stem}.csv", data)
    return {
        "methods": partial(methods_table, over_time(matrix, numbers.drift)),
        "sources": partial(sources_table, matrix),
        "powers": partial(powers_table, fitted_powers),
        "long": partial(long_table, numbers.drift),
        "work": partial(work_table, numbers.work),
        "ida": partial(ida_table, numbers.ida),
    }


def methods_table(frame: pd.DataFrame, caption: str) -> Markup:
    """Return one row per method: its order, and each property with the largest measured number."""
    rows = frame.to_dict("records")
    orders = [with_error(row["order"], row["order_error"]) for row in rows]
    shown = frame.assign(measured=column(orders, frame))
    for key in PROPERTIES:
        shown[key] = column([cell(row[key], row[f"{key}_most"]) for row in rows], frame)
    formats: Formats = {"method": code, "claimed": count, "measured": text}
    formats |= dict.fromkeys(PROPERTIES, text)
    headings = {"claimed": "order<small>claimed</small>", "measured": "order<small>measured</small>"}
    headings |= {"g": "<i>g</i> = 0", "Gv": "<i>G H<sub>p</sub></i> = 0", "H": "energy"}
    return table("methods", shown, formats, headings, caption)


def sources_table(frame: pd.DataFrame, caption: str) -> Markup:
    """Return the equations that each method solves, and its source."""
    formats: Formats = {"method": code, "system": text, "source": Markup('<span class="long">{}</span>').format}
    return table("sources", frame, formats, {"system": "solves"}, caption)


def cell(state: str, most: float) -> Markup:
    """Return whether a property is kept, and the largest defect."""
    return Markup(NONE) if not state else Markup("{} <small>{}</small>").format(WORDS[state], tiny(most))


def powers_table(frame: pd.DataFrame, caption: str) -> Markup:
    """Return one row per method: the powers of h in its defects, or a note that there is no power."""
    shown = frame.pivot(index="method", columns="property", values=["most", "power", "power_error"])
    shown = shown.loc[list(frame["method"].unique())]
    cells: dict[str, list[Any]] = {}
    for structure in ("symplectic", "symmetric"):
        columns = zip(shown["most", structure], shown["power", structure], shown["power_error", structure], strict=True)
        cells[structure] = [with_error(power, error) if np.isfinite(power) else tiny(most) for most, power, error in columns]
        cells[f"{structure}_word"] = ["power of h" if np.isfinite(power) else "round-off" for power in shown["power", structure]]
    cell_frame = pd.DataFrame({"method": shown.index, **{name: pd.Series(values, dtype=object) for name, values in cells.items()}})
    formats: Formats = {"method": code, "symplectic": text, "symplectic_word": text, "symmetric": text, "symmetric_word": text}
    headings = {"symplectic": "two-form", "symplectic_word": "<small>which is</small>", "symmetric": "symmetry"}
    return table("powers", cell_frame, formats, headings | {"symmetric_word": "<small>which is</small>"}, caption)


def long_table(frame: pd.DataFrame, caption: str) -> Markup:
    """Return energy and distance from the manifold over the long run."""
    slopes = [with_error(*pair) for pair in zip(frame["slope"], frame["slope_error"], strict=True)]
    ends = [Markup("ends early") if row["failure"] else Markup(str(row["kind"])) for row in frame.to_dict("records")]
    shown = frame.assign(drift=column(slopes, frame), became=column(ends, frame))
    formats: Formats = {"method": code, "energy": tiny, "became": text, "drift": text, "distance": tiny}
    headings = {"energy": "energy error<small>largest</small>", "became": "<small>which is</small>", "drift": "slope<small>J/s</small>"}
    return table("long", shown, formats, headings | {"distance": "distance from<small>the manifold</small>"}, caption)


def work_table(frame: pd.DataFrame, caption: str) -> Markup:
    """Return the work of a step and its time."""
    kinds = ("newton", *EVALUATIONS, "solve")
    three = partial(number, digits=3)
    formats: Formats = {"method": code, "h": three}
    formats |= dict.fromkeys((*kinds, "ns"), three)
    headings = {"h": "<i>h</i>", "newton": "Newton<small>iterations</small>", "H_p": "<i>H<sub>p</sub></i>", "H_q": "<i>H<sub>q</sub></i>"}
    headings |= {"g": "<i>g</i>", "G": "<i>G</i>", "second": "second<small>derivatives</small>", "solve": "linear<small>solves</small>"}
    return table("work", frame, formats, headings | {"ns": "time<small>ns</small>"}, caption)


def ida_table(frame: pd.DataFrame, caption: str) -> Markup:
    """Return the residuals of IDA, formulation by formulation."""
    formats: dict[str, Any] = {"method": code, "g": tiny, "Gv": tiny, "energy": tiny, "steps": count}
    headings = {"g": "|<i>g</i>|", "Gv": "|<i>G H<sub>p</sub></i>|", "energy": "energy error"}
    return table("ida", frame, formats, headings, caption)
