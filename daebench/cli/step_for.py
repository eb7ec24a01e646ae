"""``daebench step-for``: the largest step size whose statistics are those of half of it."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from daebench.cli.arguments import Anyway, Case, Free, Json, Method, Overwrite, Param, Problem
from daebench.cli.console import bar, pairs, print_json, print_table
from daebench.cli.ensemble import Distribution, bounds

if TYPE_CHECKING:
    from daebench.studies.step_for.result import StepFor

MAKER = "daebench step-for"
"""Who made a file, as the text beside it says."""

TABLE = "steps.csv"
"""Table that is written, a row a step and a quantity."""


def step_for(
    problem: Problem,
    statistic: Annotated[str, typer.Option("--statistic", help="energy, kinetic, potential, g, Gv, a coordinate or a first integral.")],
    margin: Annotated[float, typer.Option("--margin", help="Largest difference that does not matter, in the unit of the statistic.")],
    method: Method,
    h: Annotated[float, typer.Option("--h", help="Largest step size, s; its half, a quarter and so on are tried after it.")],
    t_end: Annotated[float, typer.Option("--t-end", help="End time, s.")],
    members: Annotated[int, typer.Option("--members", help="Number of starts.")] = 1024,
    halvings: Annotated[int, typer.Option("--halvings", help="Number of steps that are tried at most.")] = 6,
    level: Annotated[float, typer.Option("--level", help="Probability of passing a step that should not, of the whole search.")] = 0.05,
    starts: Annotated[
        Distribution,
        typer.Option("--starts", help="A neighbourhood of the case, the liouville measure in a --box, or that at one energy."),
    ] = Distribution.neighbourhood,
    size: Annotated[float | None, typer.Option("--size", help="Relative size of the neighbourhood [0.01].")] = None,
    box: Annotated[list[str] | None, typer.Option("--box", help="Bounds of a coordinate, q1=-1:1; repeatable.")] = None,
    energy: Annotated[float | None, typer.Option("--energy", help="Energy of the starts; that of the case if left out.")] = None,
    case: Case = None,
    param: Param = None,
    option: Free = None,
    seed: Annotated[int, typer.Option("--seed", help="Seeds starts and the bootstrap.")] = 0,
    anyway: Anyway = False,
    out: Annotated[Path | None, typer.Option("--out", help="Folder for steps.csv and a picture.")] = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> None:
    """Find the largest step size that does, in a statistic, as half of it does; exit 1 if none of those tried passes."""
    from daebench.runs import provenance
    from daebench.runs.files import make_folder
    from daebench.studies.step_for.run import step_for as made

    if out is not None:
        make_folder(out)
        provenance.require_own(out / TABLE, MAKER, overwrite=overwrite)
    drawn = {"size": size, "box": bounds("--box", box), "E": energy}
    asked: dict[str, Any] = {"statistic": statistic, "margin": margin, "method": method, "h": h, "t_end": t_end, "members": members}
    asked |= {"halvings": halvings, "level": level, "starts": starts.value, "seed": seed, "case": case, "anyway": anyway}
    asked |= {"drawn": {name: value for name, value in drawn.items() if value is not None}}
    asked |= {"parameters": pairs("param", param or []), "options": pairs("option", option or [])}
    with bar(f"{method} on {problem}") as progress:
        found = made(problem, **asked, progress=progress)
    summary = found.summary() | {"files": _write(out, found) or None}
    if as_json:
        print_json(summary)
    else:
        _print(summary)
    raise typer.Exit(1 if found.h is None else 0)


def _write(out: Path | None, found: "StepFor") -> list[str]:
    """Write the picture, with the table of tests beside it; return the paths."""
    from daebench.runs import provenance
    from daebench.studies.step_for.figure import draw

    if out is None:
        return []
    picture = draw(out, "steps", found)
    about = provenance.made_by(MAKER) | provenance.definition(found.ivp)
    provenance.write_beside(out / TABLE, about | {"Method": found.method, "Starts": f"{found.starts} Seed {found.seed}."})
    return [str(out / TABLE), str(picture)]


def _print(summary: Mapping[str, Any]) -> None:
    from daebench.cli.summary import print_summary

    print_summary({name: value for name, value in summary.items() if name not in ("tried", "h")})
    rows = []
    for row in summary["tried"]:
        for name, (value, low, high) in (row["differences"] or {}).items():
            rows.append([f"{row['h']:g}", name, f"{value:.3g}", f"{low:.3g} to {high:.3g}", row["verdict"]])
        if row["why"]:
            rows.append([f"{row['h']:g}", "", "", row["why"], row["verdict"]])
    print_table(["h", "quantity", "difference from h/2", "interval", "verdict"], rows)
    for row in summary["tried"]:
        if row["verdict"] == "undecided":
            enough = f"about {row['needed']} members would decide" if row["needed"] else "the difference is the margin within rounding"
            print(f"h = {row['h']:g} s is undecided: {enough}")
    print("no step tried passes" if summary["h"] is None else f"h = {summary['h']:g} s passes, the largest that does")
    level, planned = summary["level"], summary["planned"]
    print(f"level {level:g} of the search: each of {planned} tests at {level / planned:.3g}")
