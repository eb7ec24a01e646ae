"""The problems, a page each: motion, definition, reference trajectories, and the results of each family of methods."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd
from markupsafe import Markup

from daebench.methods.catalogue import problems
from daebench.pages.report import Progress
from daebench.pages.report.page import make_report
from daebench.pages.report.tables import Table
from daebench.pages.report.thumbnail import draw_thumbnail
from daebench.pages.report.two_processes import Job, computed
from daebench.reports.problems import drawings, ivps, rank, results, runs
from daebench.reports.problems.drawings import Drawing, drawing_of
from daebench.reports.problems.facts import Facts, facts, overview_frame, overview_table, parameters_table, published_table
from daebench.reports.problems.ivps import names
from daebench.studies.claims.bench import ROUNDINGS

SHOWN = "torus"
"""The problem in the picture for the index."""

CONSTANTS = SimpleNamespace(
    RANK=rank, STEPS=ivps.STEPS, TOL=ivps.TOL, ROUNDINGS=ROUNDINGS, FINE=drawings.FINE, SECONDS=drawings.SECONDS, LENGTHS=runs.LENGTHS
)


def make(out: Path, progress: Progress) -> Path:
    """Make the report in a folder; return the path of its page, see :func:`daebench.pages.report.page.make_report`."""
    moving = Markup((resources.files(__package__) / "cards.js").read_text(encoding="utf-8"))
    functions = {"motions": drawings.motions, "step_size": ivps.step_size, "reason": results.reason}
    return make_report("problems", out, progress, measure, check, draw, tables, beside, c=CONSTANTS, moving=moving, **functions)


@dataclass(frozen=True)
class Numbers:
    """The measurements of the report.

    Parameters
    ----------
    facts : list of Facts
        Facts of each constrained problem.
    others : mapping of str to list of Facts
        Facts of the problems of the kinds :data:`daebench.reports.problems.ivps.OTHERS`.
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
    others: dict[str, list[Facts]]
    drawings: dict[str, Drawing]
    runs: pd.DataFrame
    rank: pd.DataFrame
    rank_paths: pd.DataFrame
    losses: dict[str, float]

    @property
    def pages(self) -> list[Facts]:
        """Facts of all problems."""
        return [*self.facts, *(entry for entries in self.others.values() for entry in entries)]


def jobs() -> list[Job]:
    """Return the measurements; the methods of a problem are one job, because they share its derivation; the most expensive come first."""
    queue: list[Job] = [(problem_rows, (name,)) for name in names()]
    queue += [(rank_rows, (problem, case)) for problem, case in rank.IVPS]
    everything = [*names(), *(name for kind in ivps.OTHERS for name in problems(kind))]
    return queue + [(work, (name,)) for name in everything for work in (facts, drawing_of)]


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
    others = {kind: [results[facts, (name,)] for name in problems(kind)] for kind in ivps.OTHERS}
    problem_names = [entry.name for entry in about]
    lost = [results[rank_rows, ivp] for ivp in rank.IVPS]
    drawings = {
        name: results[drawing_of, (name,)] for name in [*problem_names, *(entry.name for entries in others.values() for entry in entries)]
    }
    return Numbers(
        facts=about,
        others=others,
        drawings={name: drawing for name, drawing in drawings.items() if drawing is not None},
        runs=pd.DataFrame([row for name in problem_names for row in results[problem_rows, (name,)]]),
        rank=pd.DataFrame([row for rows, _ in lost for row in rows]),
        rank_paths=pd.concat([paths for _, paths in lost], ignore_index=True),
        losses={problem: rank.loss(problem) for problem, _ in rank.IVPS},
    )


def check(numbers: Numbers) -> SimpleNamespace:
    """Return the numbers of the text; the first sentence that does not hold raises ClaimRefuted."""
    drawings.check_drawings([problem.name for problem in numbers.facts], numbers.drawings)
    return SimpleNamespace(
        across=results.check_runs(numbers.runs), rank=rank.check_rank(numbers.rank, numbers.losses), per=results.per_problem(numbers.runs)
    )


def draw(numbers: Numbers, findings: SimpleNamespace, folder: Path) -> Iterator[Path]:
    """Draw all figures into a folder, and give the paths of the SVG files."""
    scenes = numbers.drawings
    for scene in scenes.values():
        yield drawings.draw_scene(scene, folder)
    yield drawings.draw_scenes([scenes[problem.name] for problem in numbers.facts if problem.name in scenes], folder)
    yield rank.draw_rank(numbers.rank_paths, numbers.losses, folder)
    yield results.draw_heat_map(numbers.runs, folder)
    if SHOWN in scenes:
        yield draw_thumbnail(folder, lambda axis: drawings.thumbnail(axis, scenes[SHOWN]))


def tables(numbers: Numbers, findings: SimpleNamespace) -> Mapping[str, Table | pd.DataFrame]:
    """Return the tables: of all problems, and of each."""
    return {
        "runs": numbers.runs,
        "rank_loss": numbers.rank,
        "overview": overview_table(overview_frame(numbers.facts)),
        "across": results.across_table(findings.across.table),
        "rank": rank.rank_table(numbers.rank),
        **{str(name): results.runs_table(frame) for name, frame in numbers.runs.groupby("problem", sort=False)},
        **{f"parameters-{problem.name}": parameters_table(problem) for problem in numbers.pages},
        **{f"published-{problem.name}": published_table(problem) for problem in numbers.facts if problem.published},
    }


def beside(numbers: Numbers, findings: SimpleNamespace) -> Mapping[str, Mapping[str, Any]]:
    """Return the content of the page of each problem, by its name."""
    return {
        problem.name: {
            "each": problem,
            "own": findings.per.get(problem.name),
            "plan": ivps.horizon(problem.name),
            "scene": numbers.drawings.get(problem.name),
        }
        for problem in numbers.pages
    }
