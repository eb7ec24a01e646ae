"""``daebench chaos``: Lyapunov exponents over a plane of starts."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from daebench.cli.arguments import Anyway, Case, Free, Json, Method, OnSingular, Overwrite, Param, Problem
from daebench.cli.console import bar, number, pairs, print_json, print_written, words
from daebench.cli.folder import Folder
from daebench.cli.integer import whole
from daebench.cli.starts import ranges

if TYPE_CHECKING:
    from daebench.studies.chaos.result import Chaos


def chaos(
    problem: Problem,
    method: Method,
    h: Annotated[float, typer.Option("--h", help="Step size, s.")],
    t_end: Annotated[float | None, typer.Option("--t-end", help="End time, s.")] = None,
    steps: Annotated[int | None, typer.Option("--steps", parser=whole, help="Number of steps, in place of --t-end.")] = None,
    plane: Annotated[
        str | None,
        typer.Option(
            "--plane",
            help="Two coordinates, q1=-1:1,p2=-2:2, or q1,p2 for bounds about the start; the first two independent ones if left out.",
        ),
    ] = None,
    cells: Annotated[int, typer.Option("--cells", help="Cells along a side.")] = 64,
    energy: Annotated[
        str | None, typer.Option("--energy", help="Energy of all starts, or case for the energy of the case; not prescribed if left out.")
    ] = None,
    section: Annotated[
        str | None, typer.Option("--section", help="A third coordinate and its value in all starts, for a Poincare section: q3=0.")
    ] = None,
    case: Case = None,
    param: Param = None,
    option: Free = None,
    seed: Annotated[int, typer.Option("--seed", help="Seed of the directions of tangent vectors.")] = 0,
    anyway: Anyway = False,
    on_singular: OnSingular = None,
    out: Annotated[Path | None, typer.Option("--out", help="Folder for chaos.csv and a picture.")] = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> None:
    """Find the chaotic starts of a plane by the tangent map of the scheme; exit 1 if a run stops early.

    Regular means that no exponential growth was observed in this time t: an exponent below about 10/t cannot be distinguished from zero.
    """
    from daebench.studies.chaos.run import chaos as made

    asked: dict[str, Any] = {"h": h, "t_end": t_end, "steps": steps, "plane": _plane(plane), "cells": cells, "energy": _energy(energy)}
    asked |= {"section": pairs("section", [section]) if section else None, "case": case, "anyway": anyway, "on_singular": on_singular}
    asked |= {"parameters": pairs("param", param or []), "options": pairs("option", option or [])}
    folder = Folder(out, pictures=("chaos",))
    folder.check()
    with bar(f"{method} on {problem}") as progress:
        result = made(problem, method=method, **asked, seed=seed, progress=progress)
    summary, written = result.summary(), _write(folder, result)
    if as_json:
        print_json(summary | {"written": written})
    else:
        _print(summary, result)
        print_written(written)
    raise typer.Exit(1 if summary["stopped"] else 0)


def _plane(given: str | None) -> dict[str, tuple[float, float] | None] | None:
    """Return two coordinates with their bounds, None if these are left out."""
    if given is None:
        return None
    texts = words(given)
    with_bounds = ranges("--plane", [text for text in texts if "=" in text], 2)
    return {
        name: (ends[0], ends[1]) if (ends := with_bounds.get(name)) else None for name in (text.partition("=")[0].strip() for text in texts)
    }


def _energy(given: str | None) -> float | str | None:
    return given if given is None or given == "case" else number("--energy", given)


def _write(folder: Folder, result: "Chaos") -> list[str]:
    """Write the picture, with the table of cells beside it; return the paths."""
    from daebench.studies.chaos.figure import draw

    if folder.out is None:
        return []
    about = {"Method": result.method, "Starts": result.plane.about, "Seed": str(result.seed)}
    with folder.described(result.ivp, about) as written:
        draw(folder.out, "chaos", result)
    return written


def _print(summary: Mapping[str, Any], result: "Chaos") -> None:
    from daebench.cli.summary import print_summary
    from daebench.diagnostics.lyapunov import REGULAR, TOLD

    shown = {name: value for name, value in summary.items() if name not in ("exponent", "plane", "reasons", "median", "confidence")}
    print_summary(shown | {"reasons": summary["reasons"] or None})
    largest = summary["exponent"]
    if largest:
        place = ", ".join(f"{name} = {value:.4g}" for name, value in largest["start"].items())
        ends = f"{100 * summary['confidence']:.0f} % interval {largest['low']:.3g} to {largest['high']:.3g}"
        print(f"largest exponent {largest['value']:.4g} 1/s ({ends}), {largest['verdict']}, at {place}")
    if summary["median"] is not None:
        print(f"median exponent of chaotic starts {summary['median']:.4g} 1/s")
    if summary[REGULAR]:
        t, least = summary["t"], TOLD / summary["t"]
        print(f"regular: no exponential growth in {t:g} s; an exponent below about {least:.2g} 1/s cannot be distinguished from zero")
    for i in result.growth.status.nonzero()[0][:1]:
        print(f"first that stopped: {result.growth.sentence(int(i))}")
