"""``daebench run``: one method on one problem."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from daebench.cli.arguments import (
    P0,
    Q0,
    V0,
    Y0,
    Algebra,
    Anyway,
    Case,
    Compensated,
    Free,
    Json,
    Method,
    OnSingular,
    Overwrite,
    Param,
    Precision,
    Problem,
    Project,
)
from daebench.cli.console import bar
from daebench.cli.integer import whole
from daebench.runs.texts import pairs, words


class Callbacks(StrEnum):
    """Kinds of callbacks of IDA and CVODE."""

    native = "native"
    python = "python"


Watch = Annotated[
    str | None,
    typer.Option(
        "--watch",
        help="Monitored quantities: energy; manifold, or casimirs of a Poisson system; integrals; none; all but integrals if left out.",
    ),
]

StepsOut = Annotated[
    Path | None,
    typer.Option(
        "--steps-out", help="Write the step sizes, orders and error estimates of IDA or CVODE to FILE.csv, with a picture beside it."
    ),
]

Sensitivities = Annotated[
    str | None,
    typer.Option(
        "--sensitivities", help="Differentiate q and p, or y, with respect to parameters and initial values, for example gravity,q0."
    ),
]

Reactions = Annotated[
    bool,
    typer.Option(
        "--reactions",
        help="Give force and torque of each joint of a mechanism, or of each constraint; with --out also as FILE.reactions.csv and .png.",
    ),
]

SecondsLimit = Annotated[
    float | None, typer.Option("--seconds-limit", help="Wall-clock limit, s; the run then ends with its states so far.")
]


def run(
    problem: Problem,
    method: Method,
    case: Case = None,
    h: Annotated[float | None, typer.Option("--h", help="Step size, s.")] = None,
    tol: Annotated[float | None, typer.Option("--tol", help="Tolerance, relative and absolute.")] = None,
    steps: Annotated[int | None, typer.Option("--steps", parser=whole, help="Number of steps of exactly h.")] = None,
    t_end: Annotated[float | None, typer.Option("--t-end", help="End time, s.")] = None,
    points: Annotated[int | None, typer.Option("--points", parser=whole, help="Number of outputs if a tolerance is given [201].")] = None,
    every: Annotated[int | None, typer.Option("--every", parser=whole, help="Steps between stored states [1]; 0: only the end.")] = None,
    param: Param = None,
    option: Free = None,
    q0: Q0 = None,
    p0: P0 = None,
    v0: V0 = None,
    y0: Y0 = None,
    watch: Watch = None,
    project: Project = False,
    precision: Precision = "float64",
    out: Annotated[Path | None, typer.Option("--out", help="Write the trajectory to FILE.csv or FILE.npz.")] = None,
    lam: Annotated[bool, typer.Option("--lam", help="Also write the multipliers lam(p, q) to --out.")] = False,
    raw: Annotated[bool, typer.Option("--raw", help="Also write the multipliers of every step, to FILE.raw.csv.")] = False,
    on_singular: OnSingular = None,
    algebra: Algebra = "",
    anyway: Anyway = False,
    compensated: Compensated = False,
    sensitivities: Sensitivities = None,
    seconds_limit: SecondsLimit = None,
    callbacks: Annotated[Callbacks, typer.Option("--callbacks", help="Callbacks of IDA and CVODE: native or python.")] = Callbacks.native,
    steps_out: StepsOut = None,
    reactions: Reactions = False,
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> None:
    """Run one method on one problem; exit 1 if it stops early, or its motion is lost: its energy, or a constraint."""
    from daebench.cli import running  # which imports what a run needs, and the help does not

    running.check_places(out, steps_out, raw=raw, reactions=reactions)
    with bar(f"{method} on {problem}") as progress:
        posed: dict[str, Any] = {"case": case, "parameters": pairs("param", param or []), "algebra": algebra, "on_singular": on_singular}
        posed |= {"method": method, "project": project, "callbacks": callbacks.value, **running.start(q0=q0, p0=p0, v0=v0, y0=y0)}
        asked: dict[str, Any] = {"h": h, "tol": tol, "steps": steps, "t_end": t_end, "points": points, "every": every}
        asked |= {"watch": running.monitored(watch), "multipliers": lam, "raw": raw, "sensitivities": words(sensitivities or "")}
        asked |= {"options": pairs("option", option or []), "compensated": compensated, "precision": precision, "anyway": anyway}
        done = running.executed(problem, steps_out, progress, reactions=reactions, seconds_limit=seconds_limit, **posed, **asked)
    running.write(out, steps_out, *done)
    raise typer.Exit(running.show(*done, running.shown(problem, posed), compensated=compensated, as_json=as_json))
