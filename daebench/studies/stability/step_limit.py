"""The largest usable step: up to where the equations of a step can be solved, and up to where the energy is kept."""

from pathlib import Path

from daebench.draw.figures import QUIET, STROKES, drawing, grid_of_axes, save
from daebench.draw.methods import name_of
from daebench.methods.fixed_step.stepping import ITS_OWN
from daebench.studies.grid.run_specification import GridRun
from daebench.studies.grid.runs import Runs
from daebench.studies.stability.extreme import Asked
from daebench.studies.stability.largest_step import PART, completes, keeps_energy, largest_step
from daebench.systems.lazily import pandas as pd

LARGEST = 8
"""The bisection begins at the end of the run over this."""

DIGITS = 2
"""Digits of the step that is found."""

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
    for specification in specifications(asked):
        for verdict, passes in VERDICTS.items():
            edge = largest_step(
                specification, passes, largest=asked.end / LARGEST, digits=DIGITS, run=lambda trial: dict(runs([trial]).iloc[0])
            )
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
