"""The largest usable step, by bisection: up to where the equations of a step can be solved, and up to where the energy is kept."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from daebench.draw.figures import QUIET, STROKES, drawing, grid_of_axes, save
from daebench.draw.methods import name_of
from daebench.errors import BadInput
from daebench.methods.fixed_step.reasons import ITS_OWN
from daebench.studies.grid.measure import row_of
from daebench.studies.grid.rows import lost_rank
from daebench.studies.grid.run_specification import GridRun, Row
from daebench.studies.grid.runs import Runs
from daebench.studies.stability.extreme import Asked
from daebench.systems.lazily import pandas as pd

FINEST = 40
"""Halvings of the first step size after which there is none that gets through."""

PART = 0.01
"""Energy error, in parts of the energy's size, with which a step is still usable."""

SCAN = 8
"""Step sizes between h and 2 h that are tried above the largest that got through: where there are gaps, a bisection may end in one."""

LARGEST = 8
"""The bisection begins at the end of the run over this."""

DIGITS = 2
"""Digits of the step that is found."""


@dataclass(frozen=True)
class Edge:
    """Where a method stops to get through."""

    h: float
    """Largest step size found that gets through, with all smaller ones that were tried above half of it; 0 if there is none."""
    fails: float
    """Smallest step size above it that does not; infinite if there is none."""
    why: str
    """What happened there."""
    gaps: bool
    """Whether a larger step size gets through again."""
    tried: int
    """Runs that this took."""


def largest_step(
    specification: GridRun, passes: Callable[[Row], str], *, largest: float, digits: int = 3, run: Callable[[GridRun], Row] = row_of
) -> Edge:
    """Return the largest h with which a run passes, to so many digits, by a method with fixed steps; the run's own h is not used.

    From the largest down, h is halved until a run passes; between the two it is bisected. ``passes`` returns "" for the row of a run that
    passes, or else what is wrong with it. BadInput is raised if the method has no steps of its own to choose, or nothing is left to bisect.
    """
    if specification.solver.knob != "h":
        raise BadInput(
            f"{specification.method} chooses its own steps, so it has no largest step; give a fixed-step method.", "largest-step-own-steps"
        )
    if not 0 < largest <= specification.t_end / 3:
        raise BadInput(
            f"the largest step to begin with must be positive and at most t_end/3 = {specification.t_end / 3:g}, not {largest:g}.",
            "largest-step-out-of-range",
        )
    trials = _Trials(specification, passes, run)
    good, bad = trials.bracket(largest)
    if good == 0 or math.isinf(bad):
        return Edge(good, bad, trials.known.get(bad, ""), False, len(trials.known))
    while bad - good > 0.5 * 10.0**-digits * good:
        middle = (good + bad) / 2
        good, bad = (good, middle) if trials.verdict(middle) else (middle, bad)
    above = [good * (1 + k / SCAN) for k in range(1, SCAN + 1) if good * (1 + k / SCAN) <= largest]
    return Edge(good, bad, trials.known[bad], any(not trials.verdict(h) for h in above), len(trials.known))


class _Trials:
    """Runs with different steps, each made once, and what was wrong with them."""

    def __init__(self, specification: GridRun, passes: Callable[[Row], str], run: Callable[[GridRun], Row]) -> None:
        self.specification, self.passes, self.run = specification, passes, run
        self.known: dict[float, str] = {}

    def verdict(self, h: float) -> str:
        if h not in self.known:
            self.known[h] = self.passes(self.run(self.specification.at(h)))
        return self.known[h]

    def bracket(self, largest: float) -> tuple[float, float]:
        """Return a step that passes, 0 if there is none, and twice that step, which does not; infinity if the largest passes."""
        good, bad = largest, math.inf
        while self.verdict(good):
            good, bad = good / 2, good
            if good < largest * 2.0**-FINEST or self._lost_with_both(bad):
                return 0.0, bad
        return good, bad

    def _lost_with_both(self, h: float) -> bool:
        """Return whether runs with a step and with its double stop where G loses rank."""
        return all(lost_rank({"failure": self.known.get(step, "")}) for step in (h, 2 * h))


def completes(row: Row) -> str:
    """Return why a run did not come to its end; "" if it did: the limit is that of the solvability of its equations."""
    return str(row["failure"])


def keeps_energy(row: Row) -> str:
    """Return why a run did not come to its end with the energy kept within :data:`PART` of its size; "" if it did."""
    off, size = row["energy_error"], row["energy_scale"]
    return completes(row) or ("" if off <= PART * size else f"its energy error is {off:.2g}, and the size of the energy is {size:.3g}")


VERDICTS = {"completes": completes, "keeps the energy": keeps_energy}
"""What makes a step usable."""

PLURAL = {"completes": "complete", "keeps the energy": "keep the energy"}
"""The same of several methods."""


def refusal(asked: Asked) -> str:
    """Return why a problem has no such extreme, as a sentence, or ""."""
    return "" if asked.fixed else "none of these methods has fixed steps"


def specifications(asked: Asked) -> list[GridRun]:
    """Return the runs that a bisection begins with; it makes some twenty more for each."""
    return [asked.specification(method, asked.end / LARGEST, ("energy",)) for method in asked.fixed]


def measure(asked: Asked, runs: Runs) -> "pd.DataFrame":
    """Return one row for each method and verdict: the step, the next one that fails, why, and whether larger ones pass again."""
    rows = []
    run = cache(lambda trial: dict(runs([trial]).iloc[0]))  # both verdicts are on the same runs
    for specification in specifications(asked):
        for verdict, passes in VERDICTS.items():
            edge = largest_step(specification, passes, largest=asked.end / LARGEST, digits=DIGITS, run=run)
            rows.append(
                {
                    "method": specification.method,
                    "verdict": verdict,
                    "h": edge.h,
                    "fails": edge.fails,
                    "why": edge.why,
                    "gaps": edge.gaps,
                    "tried": edge.tried,
                }
            )
    return pd.DataFrame(rows)


def says(table: "pd.DataFrame") -> list[str]:
    """Return which method takes the largest steps, by each verdict, and where usable steps are no interval."""
    sentences = []
    for verdict, rows in ((str(name), group) for name, group in table.groupby("verdict", sort=False)):
        ranked = rows[rows["h"] > 0].sort_values("h", ascending=False, kind="stable")
        none = list(rows[rows["h"] == 0]["method"])
        if len(ranked):
            best, last = ranked[ranked["h"] == ranked["h"].max()], ranked.iloc[-1]
            several = f"; the smallest limit is that of {last['method']}, {last['h']:.2g} s" if last["h"] < best["h"].iloc[0] else ""
            least = "at least " if best["fails"].iloc[0] == float("inf") else ""
            names = " and ".join(best["method"])
            verb = verdict if len(best) == 1 else PLURAL[verdict]
            sentences.append(f"{names} {verb} with the largest steps, up to {least}h = {best['h'].iloc[0]:.2g} s{several}.")
        if none:
            sentences.append(f"With no step that was tried {verdict}: {', '.join(none)}.")
            sentences += [str(row.why) for row in rows.itertuples() if verdict == "completes" and row.h == 0]
    limited_rows = table["why"].astype(str).str.contains(ITS_OWN, regex=False) & (table["verdict"] == "completes")
    if simplified := list(dict.fromkeys(table["method"][limited_rows])):
        sentences.append(f"Of {', '.join(simplified)} {ITS_OWN}.")
    if gaps := sorted({str(name) for name in table[table["gaps"]]["method"]}):
        sentences.append(f"Above the limit some larger steps pass again, by chance, with {', '.join(gaps)}.")
    return sentences


def draw(out: Path, stem: str, table: "pd.DataFrame") -> Path:
    """Draw the limits of all methods, one line each."""
    methods = list(dict.fromkeys(table["method"]))
    with drawing():
        figure, axes = grid_of_axes(1, 1, 1.1 + 0.28 * len(methods))
        axis = axes[0, 0]
        for stroke, (verdict, rows) in zip((STROKES[3], STROKES[0]), table.groupby("verdict", sort=False), strict=True):
            good = rows[rows["h"] > 0]
            label = "reaches its end" if verdict == "completes" else f"keeps the energy within {PART:.0%} of its size"
            axis.plot(good["h"], [methods.index(name) for name in good["method"]], label=label, **stroke.points() | {"linestyle": "none"})
        axis.hlines(range(len(methods)), 0, 1, transform=axis.get_yaxis_transform(), color=QUIET, linewidth=0.3, zorder=0)
        axis.set_yticks(range(len(methods)), [name_of(name) for name in methods])
        axis.invert_yaxis()
        axis.grid(visible=False, axis="y")
        axis.set(xscale="log" if (table["h"] > 0).any() else "linear", xlabel="largest usable step h [s]")
        figure.legend(loc="outside lower center", ncols=2)
        return save(figure, out, stem, table)
