"""``daebench animate``: several methods on one problem, animated side by side."""

from pathlib import Path
from typing import Annotated, Any

import typer

from daebench.cli.arguments import (
    OUTSIDE,
    Algebra,
    Anyway,
    Case,
    Free,
    Json,
    OnSingular,
    Overwrite,
    Param,
    Problem,
    Project,
    StepSize,
    TEnd,
    Tolerance,
)
from daebench.cli.console import bar, method_names, print_written
from daebench.errors import BadInput
from daebench.pages.animation.animation import animation
from daebench.runs.texts import pairs, sides

Out = Annotated[Path, typer.Option("--out", help="File: .html (a page that plays), .svg, .gif or .mp4; its numbers go to FILE.frames.csv.")]


def animate(
    problem: Problem,
    methods: Annotated[str, typer.Option("--methods", help=f"Names of methods, comma-separated; each has its own picture; {OUTSIDE}.")],
    t_end: TEnd,
    out: Out,
    case: Case = None,
    h: StepSize = None,
    tol: Tolerance = 1e-8,
    fps: Annotated[float, typer.Option("--fps", help="Largest number of frames per second.")] = 25.0,
    seconds: Annotated[float | None, typer.Option("--seconds", help="Length of the animation, s [12].")] = None,
    speed: Annotated[float | None, typer.Option("--speed", help="Units of physical time per second, in place of --seconds.")] = None,
    param: Param = None,
    option: Free = None,
    project: Project = False,
    on_singular: OnSingular = None,
    algebra: Algebra = "",
    anyway: Anyway = False,
    title: Annotated[str, typer.Option("--title", help="Title above the animation.")] = "",
    size: Annotated[str | None, typer.Option("--size", help="Pixels of a .gif or .mp4, for example 1920x1080.")] = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> None:
    """Animate methods on one problem: the motion of each above its energy error and conserved quantities; exit 1 if one stops early."""
    wanted = method_names(methods)

    with bar(f"animate {problem}") as progress:
        runs: dict[str, Any] = {"case": case, "parameters": pairs("param", param or []), "options": pairs("option", option or [])}
        runs |= {"project": project, "anyway": anyway, "on_singular": on_singular, "algebra": algebra}
        runs |= {"methods": wanted, "t_end": t_end, "h": h, "tol": tol}
        shown: dict[str, Any] = {"out": out, "overwrite": overwrite, "fps": fps, "seconds": seconds, "speed": speed}
        shown |= {"title": title, "size": _pixels(size)}
        animated = animation(problem, **runs, **shown, progress=progress)
    if not as_json:
        for failure in animated.failures:
            print(failure)
    print_written(animated.paths, as_json=as_json, failures=animated.failures)
    raise typer.Exit(1 if animated.failures else 0)


def _pixels(text: str | None) -> tuple[int, int] | None:
    """Return width and height of a text such as 1920x1080."""
    if text is None:
        return None
    size = sides(text, int)
    if size is None:
        raise BadInput(f"--size {text!r} must be width x height in pixels, for example 1920x1080.")
    return size
