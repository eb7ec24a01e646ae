"""The tables of the report on Poisson systems."""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd
from markupsafe import Markup

from daebench.draw.figures import save_table
from daebench.pages.report import NONE, count, number, table, with_error
from daebench.pages.report.tables import Formats, Tabulate, code, column, text, tiny
from daebench.reports.poisson.casimirs import TITLES
from daebench.reports.poisson.defects import slopes
from daebench.reports.poisson.lattice import QUANTITIES
from daebench.reports.poisson.methods import CASIMIR_SYSTEMS, kept
from daebench.reports.poisson.numbers import Numbers
from daebench.reports.poisson.orbits import METHODS

SHORT = {"split": "parts with known flows", "constant": "constant", "bilinear": "one bilinear block", "": "none"}


def tables(numbers: Numbers, folder: Path) -> Mapping[str, Tabulate]:
    """Write the tables as CSV into a folder, all columns and rows, and return functions from a caption to HTML, by name."""
    powers = all_slopes(numbers)
    stems = {"orbits": numbers.orbits.table, "slopes": powers, "casimirs": numbers.casimirs, "break_off": numbers.break_off}
    stems |= {"lattice": numbers.lattice, "cost": numbers.cost, "body": numbers.body, "methods": numbers.methods}
    for stem, data in stems.items():
        save_table(folder / f"{stem}.csv", data)
    return {
        "orbits": partial(orbits_table, numbers.orbits.table),
        "casimirs": partial(casimirs_table, numbers.casimirs, numbers.break_off),
        "lattice": partial(lattice_table, numbers.lattice),
        "body": partial(body_table, numbers.body),
        "methods": partial(methods_table, numbers.methods),
    }


def all_slopes(numbers: Numbers) -> pd.DataFrame:
    """Return the fitted powers of all three panels of the figure of defects."""
    frames = [slopes(numbers.defects).assign(defect="poisson, lotka_volterra")]
    frames += [
        slopes(numbers.lemma, structure).assign(defect=f"{structure}, spherical_pendulum") for structure in ("symplectic", "poisson")
    ]
    return pd.concat(frames, ignore_index=True)


def orbits_table(frame: pd.DataFrame, caption: str) -> Markup:
    """Return the table of the orbits of Fig. 4.1."""
    orbits = frame[frame["method"].isin(METHODS)].reset_index(drop=True)
    shown = orbits.assign(case=[f"({case})" for case in orbits["case"]])
    formats: Formats = {"method": code, "case": text, "revolutions": count, "period": partial(number, digits=3), "spread": number}
    formats |= {"wander": number, "orbit": text, "most": number, "kind": text}
    headings = {"case": "from", "spread": "crossings<small>spread in u</small>", "wander": "drift<small>over the run</small>"}
    headings |= {"most": "energy<small>largest error</small>", "kind": "energy<small>becomes</small>"}
    return table("orbits", shown, formats, headings, caption)


def casimirs_table(frame: pd.DataFrame, break_off: pd.DataFrame, caption: str) -> Markup:
    """Return the errors of Casimir functions and energy, system by system."""
    first = frame["problem"] != frame["problem"].shift()
    times = break_off.set_index("method")["t"]
    ends = [
        number(times[name], 4) if problem == "lotka_volterra_3d" else Markup(NONE)
        for problem, name in zip(frame["problem"], frame["method"], strict=True)
    ]
    shown = frame.assign(system=frame["problem"].map(TITLES).where(first, ""), off=column(ends, frame))
    formats: Formats = {"system": text, "method": code, "defect": tiny, "casimir": tiny, "casimir_kind": text, "energy": tiny}
    formats |= {"energy_kind": text, "off": text}
    headings = {"defect": "Poisson<small>defect</small>", "casimir": "Casimir functions<small>largest error</small>"}
    headings |= {
        "casimir_kind": "<small>which is</small>",
        "energy": "energy<small>largest error</small>",
        "energy_kind": "<small>which is</small>",
    }
    return table("casimirs", shown, formats, headings | {"off": "breaks off<small>at t</small>"}, caption)


def lattice_table(frame: pd.DataFrame, caption: str) -> Markup:
    """Return the errors of the integrals of the lattice."""
    formats: Formats = {"method": code, "h": number}
    formats |= dict.fromkeys(QUANTITIES, tiny) | {"energy_kind": text, "us": number}
    headings = {"h": "<i>h</i>", "energy_kind": "energy<small>becomes</small>", "us": "µs<small>per step</small>"}
    return table("lattice", frame.assign(us=frame["ns"] / 1e3), formats, headings, caption)


def body_table(frame: pd.DataFrame, caption: str) -> Markup:
    """Return the errors of energy and Casimir function of the rigid body, with the order of the factors in the name."""
    formats: Formats = {"method": code, "C": tiny, "C_kind": text, "energy": tiny, "energy_kind": text, "defect": tiny}
    headings = {"C": "Casimir function<small>largest error</small>", "C_kind": "<small>which is</small>"}
    headings |= {"energy": "energy<small>largest error</small>", "energy_kind": "<small>which is</small>"}
    return table("body", frame, formats, headings | {"defect": "Poisson defect<small>of 3 steps</small>"}, caption)


def methods_table(frame: pd.DataFrame, caption: str) -> Markup:
    """Return the closing table."""
    names: dict[Any, str] = dict(zip(CASIMIR_SYSTEMS, ("species", "body"), strict=True))
    casimirs = [kept({problem: row[f"casimir_{problem}"] for problem in CASIMIR_SYSTEMS}) or NONE for row in frame.to_dict("records")]
    for problem, name in names.items():
        casimirs = [entry.replace(problem, name) for entry in casimirs]
    shown = frame.assign(
        structure=[
            "canonical coordinates" if form else SHORT[structure] for structure, form in zip(frame["class"], frame["form"], strict=True)
        ],
        measured=["yes" if good else "no" for good in frame["claimed"]],
        casimirs=casimirs,
        drift=column([with_error(*pair) if kind != "bounded" else Markup("bounded") for *pair, kind in drifts(frame)], frame),
    )
    formats: Formats = {"method": code, "order": count, "structure": text, "measured": text, "defect": tiny, "casimirs": text}
    formats |= {"energy": number, "drift": text, "ns": number}
    headings = {"structure": "Poisson integrator for<small>structure of B, H</small>", "measured": "Poisson<small>map</small>"}
    headings |= {"defect": "defect<small>of 3 steps</small>", "casimirs": "Casimirs<small>kept</small>", "ns": "ns<small>per step</small>"}
    headings |= {"energy": "energy<small>largest error</small>", "drift": "energy drift<small>per unit of time</small>"}
    return table("methods", shown, formats, headings, caption)


def drifts(frame: pd.DataFrame) -> list[tuple[float, float, str]]:
    """Return slope, its error and kind of the energy drift, method by method."""
    return [(float(a), float(b), str(kind)) for a, b, kind in zip(frame["slope"], frame["slope_error"], frame["kind"], strict=True)]
