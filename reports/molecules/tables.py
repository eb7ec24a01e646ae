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
from daebench.reports.molecules.motions import GAUSS_SEIDEL, ILVES, LINCS, TITLES
from daebench.reports.molecules.numbers import Numbers

Format = Callable[[Any], Any]


def femtoseconds(h: float) -> Markup:
    """Return a step in fs."""
    return number(100 * h, 2 if 100 * h < 1 else 1)


def tolerance(value: float) -> Markup:
    """Return a tolerance, or nothing where there is none."""
    return power_of_ten(value) if np.isfinite(value) else Markup("")


def tables(numbers: Numbers, conclusions: SimpleNamespace, folder: Path) -> dict[str, Callable[[str], Markup]]:
    """Write the tables as CSV; return what makes HTML of each, given a caption."""
    title, step, spread = TITLES.__getitem__, {"h": "step [fs]"}, {"mean": "change", "error": "&plusmn;", "high": "95&thinsp;%"}
    first: dict[str, Format] = {"molecule": title, "scheme": name_of, "choice": text, "precision": str}
    every: dict[str, Format] = {**first, "velocities": str, "h": femtoseconds, **dict.fromkeys(("mean", "error", "low", "high"), number)}
    every |= {"slope": number, "rate": number, "trend": str, "rounds": number}
    layouts: dict[str, tuple[pd.DataFrame, dict[str, Format], dict[str, str]]] = {
        "asked": (
            both_asked(conclusions.asked),
            {
                "molecule": title,
                "h": femtoseconds,
                "gauss": tolerance,
                "gauss_rounds": number,
                "newton": tolerance,
                "newton_rounds": number,
            },
            step | {"gauss": "Gauss-Seidel", "gauss_rounds": "rounds a step", "newton": "ILVES", "newton_rounds": "rounds a step"},
        ),
        "radii": (
            conclusions.radii,
            {
                "molecule": title,
                "positions": str,
                "constraints": str,
                "degrees": str,
                "radius": lambda x: number(x, 3),
                "refused": _refused,
            },
            {"degrees": "degrees of freedom", "radius": "spectral radius", "refused": "LINCS"},
        ),
        "solvers": (
            with_choice(conclusions.solvers),
            first | {"mean": number, "error": number, "high": number, "rate": number, "trend": str, "rounds": number, "times": number},
            spread | {"rate": "kJ/mol/ns per degree of freedom", "trend": "verdict", "rounds": "rounds a step", "times": "CPU time"},
        ),
        "laws": (
            with_exponents(conclusions.laws),
            {"molecule": title, "scheme": name_of, "what": str, "a_text": text, "b_text": text, "points": str},
            {"what": "runs", "a_text": "<i>a</i>", "b_text": "<i>b</i>", "points": "settings"},
        ),
        "single": (
            with_exponents(conclusions.hess.smaller.laws),
            {"molecule": title, "scheme": name_of, "velocities": str, "b_text": text, "points": str},
            {"velocities": "velocities from", "b_text": "<i>b</i>", "points": "settings"},
        ),
        "runs": (
            with_choice(conclusions.runs),
            every,
            step | spread | {"low": "5&thinsp;%", "slope": "of it, last 7/8", "rate": "kJ/mol/ns/dof", "trend": "verdict"},
        ),
        "converged": (
            conclusions.converged,
            {
                "molecule": title,
                "h": femtoseconds,
                "kinetic": number,
                "fluctuation": number,
                "oscillation": number,
                "verdict": str,
                "bound": number,
            },
            step
            | {
                "kinetic": "kinetic energy [kJ/mol]",
                "fluctuation": "its fluctuation [kJ/mol]",
                "oscillation": "oscillation",
                "bound": "bound",
            },
        ),
    }
    for name, (frame, _, _) in layouts.items():
        save_table(folder / f"{name}.csv", frame.drop(columns=[x for x in ("a_text", "b_text", "choice", "trend") if x in frame]))
    save_table(folder / "starts.csv", numbers.starts)
    return {name: partial(table, name, *layout) for name, layout in layouts.items()}


def both_asked(asked: pd.DataFrame) -> pd.DataFrame:
    """Return one row a molecule and step, with both solvers side by side."""
    sides = []
    for scheme, name in ((GAUSS_SEIDEL, "gauss"), (ILVES, "newton")):
        some = asked[asked["scheme"] == scheme].set_index(["molecule", "h"])[["tolerance", "rounds"]]
        sides.append(some.set_axis([name, f"{name}_rounds"], axis=1))
    return pd.concat(sides, axis=1).reset_index()


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


def _refused(sentence: str) -> str:
    return "refused" if sentence else "runs"
