"""The tables of the report on molecules, each with its data as CSV."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup

from daebench.draw.figures import save_table
from daebench.draw.methods import name_of
from daebench.pages.report import NONE, number, power_of_ten, table, with_error
from daebench.pages.report.tables import column, text
from daebench.reports.molecules.motions import LINCS, TITLES
from daebench.reports.molecules.numbers import Numbers

Format = Callable[[Any], Any]

Layout = tuple[pd.DataFrame, dict[str, Format], dict[str, str]]
"""Rows, the columns that are shown with what makes text of each, and the headings that are not the column's name."""

ROUNDS = "iterations per step"
STEP = {"h": "step [fs]"}
SPREAD = {"mean": "change", "error": "&plusmn;", "high": "largest"}


def femtoseconds(h: float) -> Markup:
    """Return a step in fs."""
    return number(100 * h, 2 if 100 * h < 1 else 1)


def solver(scheme: str) -> str:
    """Return the name of a solver, without that of the scheme whose step it takes."""
    return name_of(scheme).removeprefix("RATTLE, ")


def tolerance(value: float) -> Markup:
    """Return a tolerance, or an en dash where there is none."""
    return power_of_ten(value) if np.isfinite(value) else Markup(NONE)


TITLE: Format = TITLES.__getitem__
SETTING: dict[str, Format] = {"molecule": TITLE, "scheme": name_of, "choice": text, "precision": str}


def tables(numbers: Numbers, conclusions: SimpleNamespace, folder: Path) -> dict[str, Callable[[str], Markup]]:
    """Write the tables as CSV; return what makes HTML of each, given a caption."""
    layouts: dict[str, Layout] = {
        "asked": _asked(conclusions.asked),
        "radii": _radii(conclusions.radii),
        "solvers": _solvers(conclusions.solvers),
        "laws": _laws(conclusions.laws),
        "single": _single(conclusions.hess.smaller.laws),
        "runs": _runs(conclusions.runs),
        "converged": _converged(conclusions.converged),
    }
    for name, (frame, _, _) in layouts.items():
        save_table(folder / f"{name}.csv", frame.drop(columns=[x for x in ("a_text", "b_text", "choice", "trend") if x in frame]))
    save_table(folder / "starts.csv", numbers.starts)
    return {name: partial(table, name, *layout) for name, layout in layouts.items()}


def _asked(asked: pd.DataFrame) -> Layout:
    rows = asked.pivot(index=["molecule", "scheme"], columns="h", values="tolerance").reindex(list(TITLES), level=0)
    names = {float(h): f"h{100 * h:g}" for h in rows.columns}
    formats: dict[str, Format] = {"molecule": TITLE, "scheme": solver} | dict.fromkeys(names.values(), tolerance)
    return (
        rows.rename(columns=names).reset_index(),
        formats,
        {name: f"{femtoseconds(h)}&nbsp;fs" for h, name in names.items()} | {"scheme": "solver"},
    )


def _radii(molecules: pd.DataFrame) -> Layout:
    formats: dict[str, Format] = {"molecule": TITLE} | dict.fromkeys(("positions", "constraints", "degrees"), str)
    formats |= {"radius": lambda x: number(x, 3), "refused": lambda sentence: "refused" if sentence else "runs"}
    return molecules, formats, {"degrees": "degrees of freedom", "radius": "spectral radius", "refused": "LINCS"}


def _solvers(solvers: pd.DataFrame) -> Layout:
    headings = {"rate": "kJ/mol/ns per degree of freedom", "trend": "verdict", "rounds": ROUNDS, "times": "CPU time"}
    formats = SETTING | dict.fromkeys(("mean", "error", "high", "rate"), number) | {"trend": str, "rounds": number, "times": number}
    return with_choice(solvers), formats, SPREAD | headings


def _laws(laws: pd.DataFrame) -> Layout:
    formats: dict[str, Format] = {"molecule": TITLE, "scheme": name_of, "what": str, "a_text": text, "b_text": text, "points": str}
    return with_exponents(laws), formats, {"what": "runs", "a_text": "<i>a</i>", "b_text": "<i>b</i>", "points": "settings"}


def _single(laws: pd.DataFrame) -> Layout:
    formats: dict[str, Format] = {"molecule": TITLE, "scheme": name_of, "velocities": str, "b_text": text, "points": str}
    return with_exponents(laws), formats, {"velocities": "velocities from", "b_text": "<i>b</i>", "points": "settings"}


def _runs(runs: pd.DataFrame) -> Layout:
    headings = {"low": "smallest", "slope": "of it, last 7/8", "rate": "kJ/mol/ns/dof", "trend": "verdict", "rounds": ROUNDS}
    formats = SETTING | {"velocities": str, "h": femtoseconds}
    formats |= dict.fromkeys(("mean", "error", "low", "high", "slope", "rate"), number) | {"trend": str, "rounds": number}
    return with_choice(runs), formats, STEP | SPREAD | headings


def _converged(converged: pd.DataFrame) -> Layout:
    formats: dict[str, Format] = {"molecule": TITLE, "h": femtoseconds}
    formats |= dict.fromkeys(("kinetic", "fluctuation", "oscillation"), number) | {"verdict": str, "bound": number}
    headings = {"kinetic": "kinetic energy [kJ/mol]", "fluctuation": "its fluctuation [kJ/mol]", "oscillation": "oscillation"}
    return converged, formats, STEP | headings | {"bound": "bound"}


def with_choice(rows: pd.DataFrame) -> pd.DataFrame:
    """Return runs with what their solver was given, and their verdict, in words."""

    def choice(row: Any) -> Markup:
        if row["scheme"] == LINCS:
            return Markup(f"({row['order']}, {row['iterations']})")
        return tolerance(row["tolerance"])

    def trend(row: Any) -> str:
        words = f"{row['verdict']}, {row['law']}" if row["law"] else str(row["verdict"])
        return words or NONE

    records = rows.to_dict("records")
    return rows.assign(choice=column([choice(row) for row in records], rows), trend=[trend(row) for row in records])


def with_exponents(laws: pd.DataFrame) -> pd.DataFrame:
    """Return laws with their exponents and errors as HTML."""
    texts = {f"{x}_text": column([with_error(*pair) for pair in zip(laws[x], laws[f"{x}_error"], strict=True)], laws) for x in "ab"}
    return laws.assign(**texts)
