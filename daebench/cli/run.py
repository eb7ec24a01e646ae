"""``daebench run``: one method on one problem."""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from daebench.cli.arguments import Case, Free, Json, Param, Problem, Project
from daebench.cli.console import bar, numbers, pairs, print_json, print_table, words
from daebench.errors import BadInput

if TYPE_CHECKING:
    from daebench.scene import Scene
    from daebench.trajectory import Trajectory


class Precision(StrEnum):
    """Number types of a run."""

    float64 = "float64"
    float32 = "float32"


def run(
    problem: Problem,
    method: Annotated[str, typer.Option("--method", help="Name of a method, for example rattle or ida:index2.")],
    case: Case = None,
    h: Annotated[float | None, typer.Option("--h", help="Step size.")] = None,
    tol: Annotated[float | None, typer.Option("--tol", help="Tolerance, relative and absolute.")] = None,
    steps: Annotated[int | None, typer.Option("--steps", help="Number of steps of exactly h.")] = None,
    t_end: Annotated[float | None, typer.Option("--t-end", help="End time.")] = None,
    points: Annotated[int | None, typer.Option("--points", help="Equidistant outputs of a tolerance-driven method [201].")] = None,
    every: Annotated[int | None, typer.Option("--every", help="Keep a state every so many steps [1]; 0: the end alone.")] = None,
    param: Param = None,
    option: Free = None,
    q0: Annotated[str | None, typer.Option("--q0", help="Initial positions, comma-separated, in place of the case's.")] = None,
    p0: Annotated[str | None, typer.Option("--p0", help="Initial momenta, comma-separated, in place of the case's.")] = None,
    watch: Annotated[str, typer.Option("--watch", help="energy,manifold,integrals or none.")] = "energy,manifold",
    project: Project = False,
    precision: Annotated[Precision, typer.Option("--precision")] = Precision.float64,
    out: Annotated[Path | None, typer.Option("--out", help="Write the trajectory to FILE.csv or FILE.npz.")] = None,
    lam: Annotated[bool, typer.Option("--lam", help="Write the multipliers lam(p, q) to --out too.")] = False,
    raw: Annotated[bool, typer.Option("--raw", help="Write multipliers of every step too: FILE.raw.csv beside --out FILE.csv.")] = False,
    compensated: Annotated[bool, typer.Option("--compensated", help="Compensate sums over steps for rounding.")] = False,
    as_json: Json = False,
) -> None:
    """Run one method on one problem; exit 1 if it stops early."""
    from daebench.api import prepare
    from daebench.files import check_writable, write_trajectory

    if raw and out is None:
        raise BadInput("--raw needs a file to write to; add --out FILE.csv or FILE.npz.")
    if out is not None:
        check_writable(out)
    with bar(f"{method} on {problem}") as progress:
        chosen, scene, request = prepare(
            problem,
            method=method,
            case=case,
            h=h,
            tol=tol,
            steps=steps,
            t_end=t_end,
            points=points,
            every=every,
            parameters=pairs("param", param or []),
            options=pairs("option", option or []),
            q0=numbers("--q0", q0),
            p0=numbers("--p0", p0),
            watch=_watched(watch),
            project=project,
            precision=precision.value,
            multipliers=lam and out is not None,
            raw=raw,
            compensated=compensated,
            progress=progress,
        )
        trajectory = chosen.solve(scene, request)
    if out is not None:
        write_trajectory(out, trajectory)
    summary = _summary(scene, trajectory, compensated=compensated)
    if project:
        summary["projected"] = _moved(problem, case, param or [], numbers("--q0", q0), numbers("--p0", p0), scene)
    if as_json:
        print_json(summary)
    else:
        _print(summary)
    raise typer.Exit(1 if trajectory.failure else 0)


def _watched(text: str) -> list[str]:
    names = words(text)
    if "none" in names and len(names) > 1:
        raise BadInput(f"--watch {text}: none cannot be combined with other names.")
    return [] if names == ["none"] else names


def _moved(problem: str, case: str | None, param: list[str], q0: Any, p0: Any, scene: "Scene") -> dict[str, float]:
    """Return by how much the projection moved the initial values."""
    import numpy as np

    from daebench.catalogue import find_scene

    given = find_scene(problem, case, pairs("param", param), q0=q0, p0=p0)
    return {name: float(np.linalg.norm(getattr(scene, name) - getattr(given, name))) for name in ("q0", "p0")}


def _summary(scene: "Scene", trajectory: "Trajectory", *, compensated: bool) -> dict[str, Any]:
    """Return what a run says of itself; q, p and lam are those at its end."""
    import numpy as np

    q, p = trajectory.q[-1], trajectory.p[-1]
    energy, start = (float(scene.value("H", *state)) for state in ((p, q), (scene.p0, scene.q0)))
    with np.errstate(all="ignore"):
        lam = scene.value("lam", p, q)
    maxima = dict(trajectory.maxima)
    return {
        "problem": trajectory.problem,
        "case": trajectory.case,
        "parameters": dict(trajectory.parameters),
        "method": trajectory.method,
        "compensated": compensated or None,
        "h": trajectory.value if trajectory.knob == "h" else None,
        "tol": trajectory.value if trajectory.knob == "tol" else None,
        "steps": trajectory.steps,
        "t": float(trajectory.t[-1]),
        "q": q,
        "p": p,
        "lam": lam,
        "energy": energy,
        "energy_error": energy - start,
        "max_energy_error": maxima.pop("energy", None),
        "g": maxima.pop("g", None),
        "Gv": maxima.pop("Gv", None),
        "integrals": maxima,
        "maxima_over": trajectory.maxima_over,
        "work": dict(trajectory.work),
        "seconds": trajectory.seconds,
        "compile_seconds": trajectory.compile_seconds,
        "callback_seconds": trajectory.callback_seconds,
        "failure": trajectory.failure,
    }


def _print(summary: dict[str, Any]) -> None:
    def text(value: Any) -> str:
        if isinstance(value, dict):
            return ", ".join(f"{name} {text(item)}" for name, item in value.items())
        if hasattr(value, "tolist"):
            return ", ".join(f"{x:.15g}" for x in value.tolist())
        return f"{value:.9g}" if isinstance(value, float) else str(value)

    print_table(["", ""], [[name, text(value)] for name, value in summary.items() if value is not None and text(value)])
