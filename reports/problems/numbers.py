"""Everything that the report on problems measures, in parallel on up to two cores; no judgement here, and no text."""

from dataclasses import dataclass
from typing import Any

import pandas as pd

from daebench.pages.report import Progress
from daebench.pages.report.two_processes import Job, computed
from daebench.reports.problems import rank, runs
from daebench.reports.problems.facts import Facts, facts
from daebench.reports.problems.ivps import names
from daebench.reports.problems.path import Drawing, drawing_of


@dataclass(frozen=True)
class Numbers:
    """What was measured.

    Parameters
    ----------
    facts : list of Facts
        Facts of each problem.
    drawings : mapping of str to Drawing
        Drawing of each problem that declares a picture.
    runs : DataFrame
        One row per problem and method.
    rank : DataFrame
        One row for each problem that loses rank, method and mode.
    rank_paths : DataFrame
        Positions over time of these runs.
    losses : mapping of str to float
        Time at which G loses rank, by problem.
    """

    facts: list[Facts]
    drawings: dict[str, Drawing]
    runs: pd.DataFrame
    rank: pd.DataFrame
    rank_paths: pd.DataFrame
    losses: dict[str, float]


def jobs() -> list[Job]:
    """Return the measurements; the methods of a problem are one job, because they share its derivation; the most expensive come first."""
    queue: list[Job] = [(problem_rows, (name,)) for name in names()]
    queue += [(rank_rows, (problem, case)) for problem, case in rank.IVPS]
    return queue + [(work, (name,)) for name in names() for work in (facts, drawing_of)]


def problem_rows(problem: str) -> list[dict[str, Any]]:
    """Return a row for each method on a problem, including methods that are left out."""
    against = runs.sizes_of(problem)
    return [runs.row(problem, name, against) for name in runs.METHODS]


def rank_rows(problem: str, case: str) -> tuple[list[dict[str, Any]], pd.DataFrame]:
    """Return the behaviour of each method where G loses rank, in each mode, and the drawn positions."""
    rows, paths = zip(*(rank.behaviour(problem, case, name, mode) for name in rank.METHODS for mode in rank.MODES), strict=True)
    return list(rows), pd.concat(paths, ignore_index=True)


def measure(tell: Progress) -> Numbers:
    """Return the numbers; ``tell`` receives the fraction done and a description of the finished work."""
    results = dict(computed(jobs(), tell, "measured"))
    about: list[Facts] = sorted((results[facts, (name,)] for name in names()), key=lambda entry: (entry.m, entry.d, entry.name))
    problem_names = [entry.name for entry in about]
    lost = [results[rank_rows, ivp] for ivp in rank.IVPS]
    drawings = {name: results[drawing_of, (name,)] for name in problem_names}
    return Numbers(
        facts=about,
        drawings={name: drawing for name, drawing in drawings.items() if drawing is not None},
        runs=pd.DataFrame([row for name in problem_names for row in results[problem_rows, (name,)]]),
        rank=pd.DataFrame([row for rows, _ in lost for row in rows]),
        rank_paths=pd.concat([paths for _, paths in lost], ignore_index=True),
        losses={problem: rank.loss(problem) for problem, _ in rank.IVPS},
    )
