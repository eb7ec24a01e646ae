"""``daebench step-for``: the largest step size whose statistics agree with those of half of it."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from daebench.cli.arguments import Anyway, Case, Free, Json, Method, OnSingular, Overwrite, Param, Problem
from daebench.cli.console import bar, pairs, print_json, print_table, print_written
from daebench.cli.folder import Folder
from daebench.cli.integer import whole
from daebench.cli.starts import Box, Distribution, Energy, Size, Starts, settings_of

if TYPE_CHECKING:
    from daebench.studies.step_for.result import StepFor


def step_for(
    problem: Problem,
    statistic: Annotated[
        str, typer.Option("--statistic", help="Statistic: energy, kinetic, potential, g, Gv, a coordinate or a first integral.")
    ],
    margin: Annotated[float, typer.Option("--margin", help="Margin of equivalence, in the unit of the statistic.")],
    method: Method,
    h: Annotated[float, typer.Option("--h", help="Largest step size, s; its half, a quarter and so on are tried after it.")],
    t_end: Annotated[float, typer.Option("--t-end", help="End time, s.")],
    members: Annotated[int, typer.Option("--members", parser=whole, help="Number of starts.")] = 1024,
    halvings: Annotated[int, typer.Option("--halvings", help="Largest number of step sizes to try.")] = 6,
    level: Annotated[
        float, typer.Option("--level", help="Probability that the search passes a step size that differs by the margin or more.")
    ] = 0.05,
    starts: Starts = Distribution.neighbourhood,
    size: Size = None,
    box: Box = None,
    energy: Energy = None,
    case: Case = None,
    param: Param = None,
    option: Free = None,
    seed: Annotated[int, typer.Option("--seed", help="Seed of the starts.")] = 0,
    anyway: Anyway = False,
    on_singular: OnSingular = None,
    out: Annotated[Path | None, typer.Option("--out", help="Folder for steps.csv and a picture.")] = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> None:
    """Find the largest step size whose statistic agrees with that of half of it; exit 1 if no step size passes.

    Whether the half agrees with the exact motion is not tested.
    """
    from daebench.studies.step_for.run import step_for as made

    asked: dict[str, Any] = {"statistic": statistic, "margin": margin, "method": method, "h": h, "t_end": t_end, "members": members}
    asked |= {"halvings": halvings, "level": level, "starts": starts.value, "seed": seed, "case": case}
    asked |= {"anyway": anyway, "on_singular": on_singular}
    asked |= {"drawn": settings_of(starts.value, size=size, box=box, energy=energy)}
    asked |= {"parameters": pairs("param", param or []), "options": pairs("option", option or [])}
    folder = Folder(out, pictures=("steps",))
    folder.check()
    with bar(f"{method} on {problem}") as progress:
        found = made(problem, **asked, progress=progress)
    summary, written = found.summary(), _write(folder, found)
    if as_json:
        print_json(summary | {"written": written})
    else:
        _print(summary)
        print_written(written)
    raise typer.Exit(1 if found.h is None else 0)


def _write(folder: Folder, found: "StepFor") -> list[str]:
    """Write the picture, with the table of tests beside it; return the paths."""
    from daebench.studies.step_for.figure import draw

    if folder.out is None:
        return []
    about = {"Method": found.method, "Starts": found.starts, "Seed": str(found.seed)}
    with folder.described(found.ivp, about) as written:
        draw(folder.out, "steps", found)
    return written


def _print(summary: Mapping[str, Any]) -> None:
    from daebench.cli.summary import print_summary

    print_summary({name: value for name, value in summary.items() if name not in ("tried", "h")})
    rows = []
    for row in summary["tried"]:
        for name, (value, low, high) in (row["differences"] or {}).items():
            interval = f"{low:.3g} to {high:.3g}" if math.isfinite(high) else "too few members"
            rows.append([f"{row['h']:g}", name, f"{value:.3g}", interval, row["verdict"]])
        if not row["differences"]:
            rows.append([f"{row['h']:g}", "", "", row["why"], row["verdict"]])
    print_table(["h", "quantity", "difference from h/2", "interval", "verdict"], rows)
    for row in summary["tried"]:
        if row["verdict"] == "undecided":
            print(f"h = {row['h']:g} s is undecided: {row['why']}")
    print(_passed(summary))
    level, planned = summary["level"], summary["planned"]
    print(f"level {level:g} of the search: each of {planned} tests at {level / planned:.3g}")


def _passed(summary: Mapping[str, Any]) -> str:
    """Return which step passes, and what this does not show."""
    h = summary["h"]
    if h is None:
        return "no step tried passes"
    which = "the largest tried" if h == summary["tried"][0]["h"] else "the largest that passes"
    return f"h = {h:g} s passes, {which}: it agrees with {h / 2:g} s; whether that agrees with the exact motion is not tested"
