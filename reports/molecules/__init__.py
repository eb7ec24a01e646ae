"""Which constraint tolerance a molecule needs: energy drift with the constraint solvers of molecular dynamics, its law, and its cost."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd
from markupsafe import Markup

from daebench.draw.methods import name_of
from daebench.pages.report import NONE, Progress, number, power_of_ten, with_error
from daebench.pages.report.page import constants, make_report
from daebench.pages.report.tables import Columns, Of, Table, finite, text
from daebench.pages.report.thumbnail import draw_thumbnail
from daebench.pages.report.two_processes import Job, computed
from daebench.reports.molecules import hess, laws, motions, tolerance, well
from daebench.reports.molecules.energy_change import described, measured
from daebench.reports.molecules.motions import (
    GAUSS_SEIDEL,
    ILVES,
    KERNELS,
    LINCS,
    T_END,
    TITLES,
)


def femtoseconds(h: float) -> Markup:
    """Return a step in fs."""
    return number(100 * h, 2 if 100 * h < 1 else 1)


CONSTANTS = constants(motions, well, tolerance, laws)


def make(out: Path, progress: Progress) -> Path:
    """Make the report in a folder; return the path of its page, see :func:`daebench.pages.report.page.make_report`."""
    return make_report("molecules", out, progress, measure, check, draw, tables, c=CONSTANTS, femtoseconds=femtoseconds)


@dataclass(frozen=True)
class Numbers:
    """The measurements of the report."""

    molecules: pd.DataFrame
    """One row a molecule: positions, constraints, degrees of freedom, spectral radius of LINCS, why it is refused, how loose a tolerance
    is, see :func:`looseness`.
    """
    converged: pd.DataFrame
    """One row a molecule and step, of the runs with constraints met to round-off: fluctuation of the kinetic energy, standard deviation of
    the energy along a run, verdict.
    """
    runs: pd.DataFrame
    """One row a setting, see :func:`row`."""
    starts: pd.DataFrame
    """One row a setting and start: the change of the energy."""
    growth: pd.DataFrame
    """Mean and spread over time, of each setting with the middle step."""
    t_end: float = T_END
    """End of the runs, 0.1 ps."""


def measure(tell: Progress) -> Numbers:
    """Return the numbers, with both cores where there are two."""
    jobs: list[Job] = [(measured, kernel) for kernel in KERNELS]
    first: list[Job] = [(described, (molecule,)) for molecule in reversed(TITLES)]
    results = dict(computed([*first, *jobs], tell, "runs"))
    molecules, energies = zip(*(results[described, (molecule,)] for molecule in TITLES), strict=True)
    order = sorted(jobs, key=lambda job: list(TITLES).index(job[1][0]))
    runs, starts, growth = (pd.concat(frames, ignore_index=True) for frames in zip(*(results[job] for job in order), strict=True))
    return Numbers(pd.DataFrame(molecules), pd.concat(energies, ignore_index=True), runs, starts, growth)


def check(numbers: Numbers) -> SimpleNamespace:
    """Return the numbers of the text; the first sentence that does not hold raises ClaimRefuted."""
    runs = tolerance.with_rates(numbers.runs, numbers.converged, numbers.molecules, numbers.t_end)
    enough, powers = tolerance.asked(runs), laws.check_laws(runs)
    return SimpleNamespace(
        runs=runs,
        asked=enough,
        answer=tolerance.check_answer(enough),
        radii=tolerance.check_radii(numbers.molecules),
        laws=powers,
        law_of=laws.by_molecule(powers, GAUSS_SEIDEL),
        two_rounds=laws.by_molecule(powers, ILVES),
        stairs=laws.check_stairs(runs),
        exact=tolerance.check_exact(runs, numbers.converged),
        solvers=tolerance.solvers(runs, enough),
        cost=tolerance.cost(runs, enough),
        missed=tolerance.missed_in_single(runs),
        floor=tolerance.floor(runs),
        scatter=tolerance.scatter(runs),
        tenfold=laws.tenfold(powers),
        lincs=laws.extremes(powers[powers["scheme"] == LINCS]["b"].dropna()),
        loose=laws.extremes(numbers.molecules["loose"]),
        luck=laws.luck(numbers.starts, runs),
        hess=hess.check_hess(runs),
        converged=numbers.converged,
    )


def draw(numbers: Numbers, findings: SimpleNamespace, folder: Path) -> Iterator[Path]:
    """Draw all figures into a folder, and give the paths of the SVG files."""
    yield tolerance.draw_answer(findings.runs, findings.answer.usual, folder)
    yield tolerance.draw_tolerances(numbers.runs, folder)
    yield hess.draw_growth(numbers.growth, folder)
    yield hess.draw_steps(numbers.runs, folder)
    yield draw_thumbnail(folder, lambda axis: tolerance.thumbnail(axis, findings.runs))


def tables(numbers: Numbers, findings: SimpleNamespace) -> Mapping[str, Table | pd.DataFrame]:
    """Return the tables."""
    enough = findings.asked.pivot(index=["molecule", "scheme"], columns="h", values="tolerance").reindex(list(TITLES), level=0)
    steps = {f"h{100 * h:g}": (finite(power_of_ten), f"{femtoseconds(h)}&nbsp;fs") for h in enough.columns}
    solver = {"scheme": (lambda scheme: name_of(scheme).removeprefix("RATTLE, "), "solver")}
    return {
        "asked": Table(enough.set_axis(list(steps), axis=1).reset_index(), MOLECULE | solver | steps),
        "radii": Table(findings.radii, RADII),
        "solvers": Table(findings.solvers, SOLVERS),
        "laws": Table(findings.laws, NAMED | {"what": "runs"} | A | B | POINTS),
        "single": Table(findings.hess.smaller.laws, NAMED | {"velocities": "velocities from"} | B | POINTS),
        "runs": Table(findings.runs, RUNS),
        "converged": Table(findings.converged, CONVERGED),
        "starts": numbers.starts,
    }


def choice(row: Mapping[Any, Any]) -> Markup:
    """Return the options of a solver."""
    if row["scheme"] == LINCS:
        return Markup(f"({row['order']}, {row['iterations']})")
    return finite(power_of_ten)(row["tolerance"])


def trend(row: Mapping[Any, Any]) -> str:
    """Return the verdict on a run in words."""
    return f"{row['verdict']}, {row['law']}" if row["law"] else str(row["verdict"]) or NONE


MOLECULE: Columns = {"molecule": TITLES.__getitem__}
NAMED = MOLECULE | {"scheme": name_of}
SETTING = NAMED | {"choice": Of(choice), "precision": text}
STEP: Columns = {"h": (femtoseconds, "step [fs]")}
CHANGE: Columns = {"mean": (number, "change"), "error": (number, "&plusmn;")}
VERDICT: Columns = {"trend": (Of(trend), "verdict"), "rounds": (number, "iterations per step")}
POINTS: Columns = {"points": (str, "settings")}
A: Columns = {"a": (Of(with_error, "a", "a_error"), "<i>a</i>")}
B: Columns = {"b": (Of(with_error, "b", "b_error"), "<i>b</i>")}
"""Columns that several tables share."""

RADII = MOLECULE | {
    "positions": str,
    "constraints": str,
    "degrees": (str, "degrees of freedom"),
    "radius": (partial(number, digits=3), "spectral radius"),
    "refused": (lambda why: "refused" if why else "runs", "LINCS"),
}
SOLVERS = SETTING | CHANGE | {"high": (number, "largest"), "rate": (number, "kJ/mol/ns per degree of freedom")} | VERDICT
SOLVERS |= {"times": (number, "CPU time")}
RUNS = SETTING | {"velocities": text} | STEP | CHANGE | {"low": (number, "smallest"), "high": (number, "largest")}
RUNS |= {"slope": (number, "of it, last 7/8"), "rate": (number, "kJ/mol/ns/dof")} | VERDICT
CONVERGED = MOLECULE | STEP | {"kinetic": (number, "kinetic energy [kJ/mol]"), "fluctuation": (number, "its fluctuation [kJ/mol]")}
CONVERGED |= {"oscillation": number, "verdict": text, "bound": number}
