"""``daebench run``: one method on one problem."""

from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from daebench.cli import steps_out as steps_files
from daebench.cli.arguments import (
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
from daebench.cli.console import bar, print_json
from daebench.cli.integer import whole
from daebench.errors import BadInput
from daebench.runs.texts import numbers, pairs, words

if TYPE_CHECKING:
    from daebench.methods.plan import Plan
    from daebench.runs.ivp import ConstrainedIvp
    from daebench.runs.request import Request
    from daebench.runs.trajectory import Passage


MOST_PASSAGES = 6
"""Largest number of printed rank-loss events; JSON has all."""


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
    q0: Annotated[str | None, typer.Option("--q0", help="Initial positions, comma-separated, in place of the case's.")] = None,
    p0: Annotated[str | None, typer.Option("--p0", help="Initial momenta, comma-separated, in place of the case's.")] = None,
    y0: Annotated[str | None, typer.Option("--y0", help="Initial state of a Poisson system, comma-separated.")] = None,
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
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> None:
    """Run one method on one problem; exit 1 if it stops early, or its motion is lost: its energy, or a constraint."""
    _check_place(out, steps_out, raw=raw)
    with bar(f"{method} on {problem}") as progress:
        start = _start(case, param, algebra, q0, p0)
        asked: dict[str, Any] = {"h": h, "tol": tol, "steps": steps, "t_end": t_end, "points": points, "every": every}
        asked |= {"watch": None if watch is None else _monitored(watch), "multipliers": lam, "raw": raw}
        asked |= {"options": pairs("option", option or []), "compensated": compensated, "precision": precision, "anyway": anyway}
        asked |= {"y0": numbers("--y0", y0), "project": project, "on_singular": on_singular, "seconds_limit": seconds_limit}
        asked |= {"callbacks": callbacks.value, "sensitivities": words(sensitivities or "")}
        planned = _planned(problem, steps_out, method=method, **start, **asked)
        trajectory = planned.execute(progress)
    _write(out, steps_out, planned, trajectory)
    _print(planned, trajectory, _given(problem, start) if project else None, compensated=compensated, as_json=as_json)
    raise typer.Exit(1 if trajectory.failure or planned.losses(trajectory) else 0)


def _start(case: str | None, param: list[str] | None, algebra: str, q0: str | None, p0: str | None) -> dict[str, Any]:
    """Return the arguments of an initial value problem, without y0 of a Poisson system."""
    chosen: dict[str, Any] = {"case": case, "parameters": pairs("param", param or []), "algebra": algebra}
    return chosen | {"q0": numbers("--q0", q0), "p0": numbers("--p0", p0)}


def _planned(problem: str, steps_out: Path | None, **settings: Any) -> "Plan":
    """Return the plan of the run; a record of steps that has too many columns for a table is refused."""
    from daebench.methods.plan import plan

    planned = plan(problem, solver_steps=steps_out is not None, **settings)
    steps_files.check_size(steps_out, planned.ivp)
    return planned


def _given(problem: str, start: dict[str, Any]) -> "ConstrainedIvp":
    """Return the initial values before the projection."""
    from daebench.methods.initial_value_problem import initial_value_problem
    from daebench.runs.make_ivp import constrained

    return constrained(initial_value_problem(problem, **start, consistent=False))


def _write(out: Path | None, steps_out: Path | None, planned: "Plan", trajectory: Any) -> None:
    """Write a trajectory and a record of steps to the given paths, and beside each file a text on how it was made."""
    from daebench.runs.outputs import described
    from daebench.runs.provenance import definition
    from daebench.runs.trajectory_files import write_trajectory, written

    if out is None and steps_out is None:
        return
    ivp, request = planned.ivp, planned.request
    about = {**definition(ivp), "Method": trajectory.method, "Run": _settings(request, trajectory.steps, trajectory.failure)}
    files = [] if out is None else written(out, raw=request.raw)
    with described([*files, *steps_files.files(steps_out)], about):
        if out is not None:
            write_trajectory(out, trajectory)
        if steps_out is not None:
            title = f"{trajectory.method} on {ivp.problem}, case {ivp.case}, tol = {request.value:g}"
            steps_files.write(steps_out, trajectory.solver_steps, title)


def _print(planned: "Plan", trajectory: Any, given: "ConstrainedIvp | None", *, compensated: bool, as_json: bool) -> None:
    """Print the summary of a run; ``given`` has the initial values before the projection."""
    from dataclasses import asdict

    from daebench.cli.summary import moved, print_summary, summary_of
    from daebench.draw.scene import named_points

    ivp = planned.ivp
    summary = summary_of(ivp, trajectory, compensated=compensated)
    if given is not None:
        summary["projected"] = moved(given, ivp)
    summary["warnings"] = planned.doubts(trajectory)
    passages = getattr(trajectory, "passages", None)
    if passages is not None:
        summary["passages"] = [asdict(passage) for passage in passages] if as_json else _passed(passages)
    if as_json:
        if points := named_points(ivp, trajectory.q[-1]) if "q" in summary else {}:
            summary["points"] = points
        print_json(summary)
    else:
        print_summary(summary)


def _check_place(out: Path | None, steps_out: Path | None, *, raw: bool) -> None:
    """Refuse, before the run, files that cannot be written or that another command made."""
    from daebench.runs.outputs import require_own
    from daebench.runs.trajectory_files import check_writable, written

    if raw and out is None:
        raise BadInput("--raw needs a file to write to; add --out FILE.csv or FILE.npz.")
    if out is not None:
        check_writable(out)
        for file in written(out, raw=raw):
            require_own(file)
    if steps_out is not None:
        if out is not None and out.resolve() == steps_out.resolve():
            raise BadInput(f"--out and --steps-out both name {out}; choose two files.")
        steps_files.check_place(steps_out)


def _settings(request: "Request", steps: int, failure: str | None) -> str:
    """Return a description of the request and the outcome of a run."""
    asked = f"value of h or tol {request.value!r}, t_end = {request.t_end!r}, {request.precision}"
    return f"{asked}; {steps} steps; {failure or 'to the end'}"


def _passed(passages: "Sequence[Passage]") -> str | None:
    """Return where G lost rank and the branch of the motion, for the first few events."""
    texts = [
        f"t = {passage.t:.9g} {passage.branch} (turn {passage.turn:.2g} degrees, pivot {passage.pivot:.1e})"
        for passage in passages[:MOST_PASSAGES]
    ]
    more = [f"... ({len(passages)} passages; --json has all)"] if len(passages) > MOST_PASSAGES else []
    return "; ".join([*texts, *more]) or None


def _monitored(text: str) -> list[str]:
    names = words(text)
    if "none" in names and len(names) > 1:
        raise BadInput(f"--watch {text}: none cannot be combined with other names.")
    return [] if names == ["none"] else names
