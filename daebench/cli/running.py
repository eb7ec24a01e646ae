"""``daebench run`` beside its options: the plan of the run, its output, and files, of which one may be a record of steps."""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from daebench.cli.console import print_json
from daebench.cli.own_start import Shown, own_start_of
from daebench.cli.summary import print_part, print_summary, summary_of
from daebench.draw.figures import save, save_drawing
from daebench.draw.scene import named_points
from daebench.draw.solver_steps import draw
from daebench.errors import BadInput
from daebench.methods.plan import Plan, plan
from daebench.runs.csv_files import write_numbers
from daebench.runs.files import atomic, check_place
from daebench.runs.make_ivp import with_reactions
from daebench.runs.outputs import described, require_own
from daebench.runs.own_start import OwnStart, values_in
from daebench.runs.provenance import definition
from daebench.runs.request import Progress, Request
from daebench.runs.solver_steps import SolverSteps
from daebench.runs.texts import words
from daebench.runs.trajectory import Passage
from daebench.runs.trajectory_files import check_writable, write_trajectory, written

MOST_PASSAGES = 6
"""Largest number of printed rank-loss events; JSON has all."""

OPTION = "--steps-out"

ENDINGS = (".csv", ".svg", ".png")

MOST_UNKNOWNS = 400
"""Largest number of unknowns with columns in a table; in Python there is no limit."""


def step_files(path: Path | None) -> list[Path]:
    """Return the files that are written for a path of the option."""
    return [] if path is None else [path.with_suffix(ending) for ending in ENDINGS]


def _check_steps(path: Path) -> None:
    """Refuse, before the run, files that cannot be written or that another command made; raise BadInput."""
    if path.suffix.lower() != ENDINGS[0]:
        raise BadInput(f"{OPTION} {path}: the file must end in {ENDINGS[0]}.", "steps-file-ending")
    for file in step_files(path):
        check_place(file, OPTION)
        require_own(file, OPTION)


def check_size(path: Path | None, ivp: Any) -> None:
    """Refuse, before the run, a table with columns for each of very many unknowns; raise BadInput."""
    if path is not None and ivp.size > MOST_UNKNOWNS:
        raise BadInput(
            f"{OPTION} {path}: {ivp.problem} has {ivp.size} unknowns, and a table has columns for each of {MOST_UNKNOWNS} at most; "
            "in Python daebench.run(..., solver_steps=True).solver_steps has the arrays.",
            "steps-table-too-wide",
        )


def _write_steps(path: Path, steps: SolverSteps, title: str) -> None:
    """Write FILE.csv, all digits, and FILE.svg and FILE.png beside it."""
    with atomic(path) as scratch:
        write_numbers(scratch, steps.columns)
    save_drawing(draw(steps, title), path.parent, path.stem)


def start(**texts: str | None) -> dict[str, Any]:
    """Return the vectors of a start of one's own, of the texts of their options."""
    return {name: values_in(f"--{name}", text) for name, text in texts.items() if text is not None}


def shown(problem: str, posed: dict[str, Any]) -> Shown | None:
    """Return a start of one's own as it is shown, if there is one."""
    return own_start_of({"problem": problem, **posed}) if any(posed.get(name) for name in OwnStart.__annotations__) else None


def executed(problem: str, steps_out: Path | None, progress: Progress, *, reactions: bool, **settings: Any) -> tuple[Plan, Any, Any]:
    """Return the plan of a run, its trajectory, and its reactions or None.

    Refused are a record of steps that has too many columns for a table, and reactions where there are no constraints.
    """
    planned = plan(problem, solver_steps=steps_out is not None, **settings)
    check_size(steps_out, planned.ivp)
    if reactions:
        with_reactions(planned.ivp)
    trajectory = planned.execute(progress)
    return planned, trajectory, trajectory.reactions() if reactions else None


def _reaction_files(out: Path | None) -> list[Path]:
    """Return the files of reactions beside a trajectory: a table, and its curves."""
    return [] if out is None else [out.with_suffix(f".reactions{ending}") for ending in ENDINGS]


def write(out: Path | None, steps_out: Path | None, planned: Plan, trajectory: Any, reactions: Any) -> None:
    """Write a trajectory, its reactions and a record of steps to the given paths, and beside each file a text on how it was made."""
    if out is None and steps_out is None:
        return
    ivp, request = planned.ivp, planned.request
    about = {**definition(ivp), "Method": trajectory.method, "Run": _settings(request, trajectory.steps, trajectory.failure)}
    files = [] if out is None else written(out, raw=request.raw)
    tables = [] if reactions is None else _reaction_files(out)[:1]
    with described([*files, *step_files(steps_out), *tables], about):
        if out is not None:
            write_trajectory(out, trajectory)
        for table in tables:
            save(reactions.signed(reactions.plot()), table.parent, table.stem, reactions.table)
        if steps_out is not None:
            title = f"{trajectory.method} on {ivp.problem}, case {ivp.case}, tol = {request.value:g}"
            _write_steps(steps_out, trajectory.solver_steps, title)


def show(planned: Plan, trajectory: Any, reactions: Any, start: Shown | None, *, compensated: bool, as_json: bool) -> int:
    """Print the summary of a run, and return the exit status; ``start`` is one's own."""
    ivp, doubts = planned.ivp, planned.doubts(trajectory)
    summary = summary_of(ivp, trajectory, compensated=compensated)
    summary["warnings"] = doubts
    passages = getattr(trajectory, "passages", None)
    if passages is not None:
        summary["passages"] = [asdict(passage) for passage in passages] if as_json else _passed(passages)
    if as_json:
        if points := named_points(ivp, trajectory.q[-1]) if "q" in summary else {}:
            summary["points"] = points
        if reactions is not None:
            summary["reactions"] = reactions.summary()
        print_json(summary | (start.plain if start else {}))
    else:
        for part in start.printed if start else ():
            print_part(part)
        print_summary(summary)
        for part in () if reactions is None else reactions.printed():
            print_part(part)
    return 1 if trajectory.failure or {*doubts} - {*planned.at_start} else 0


def check_places(out: Path | None, steps_out: Path | None, *, raw: bool, reactions: bool) -> None:
    """Refuse, before the run, files that cannot be written or that another command made."""
    if raw and out is None:
        raise BadInput("--raw needs a file to write to; add --out FILE.csv or FILE.npz.", "raw-without-file")
    if out is not None:
        check_writable(out)
        for file in [*written(out, raw=raw), *(_reaction_files(out) if reactions else [])]:
            require_own(file)
    if steps_out is not None:
        if out is not None and out.resolve() == steps_out.resolve():
            raise BadInput(f"--out and --steps-out both name {out}; choose two files.", "two-files-of-one-name")
        _check_steps(steps_out)


def _settings(request: Request, steps: int, failure: str | None) -> str:
    """Return a description of the request and the outcome of a run."""
    asked = f"value of h or tol {request.value!r}, t_end = {request.t_end!r}, {request.precision}"
    return f"{asked}; {steps} steps; {failure or 'to the end'}"


def _passed(passages: Sequence[Passage]) -> str | None:
    """Return where G lost rank and the branch of the motion, for the first few events."""
    texts = [
        f"t = {passage.t:.9g} {passage.branch} (turn {passage.turn:.2g} degrees, pivot {passage.pivot:.1e})"
        for passage in passages[:MOST_PASSAGES]
    ]
    more = [f"... ({len(passages)} passages; --json has all)"] if len(passages) > MOST_PASSAGES else []
    return "; ".join([*texts, *more]) or None


def monitored(text: str | None) -> list[str] | None:
    """Return the quantities that --watch names; none for the word none."""
    if text is None:
        return None
    names = words(text)
    if "none" in names and len(names) > 1:
        raise BadInput(f"--watch {text}: none cannot be combined with other names.", "watch-none-with-others")
    return [] if names == ["none"] else names
