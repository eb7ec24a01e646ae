"""``daebench bench``: time per step and time to compile, best of several, beside hand-written C where there is a compiler."""

from typing import Annotated

import typer

from daebench.cli.console import print_json, print_table, words


def bench(
    problem: Annotated[str, typer.Option("--problem", help="Name of a problem.")] = "spherical_pendulum",
    case: Annotated[str, typer.Option("--case", help="Named initial values.")] = "fig1.1",
    methods: Annotated[str | None, typer.Option("--methods", help="Fixed-step methods, comma-separated; all if left out.")] = None,
    h: Annotated[float, typer.Option("--h", help="Step size.")] = 0.01,
    steps: Annotated[int, typer.Option("--steps", help="Steps of one timed run.")] = 300_000,
    repeat: Annotated[int, typer.Option("--repeat", help="Runs, of which the best counts.")] = 7,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object on standard output.")] = False,
) -> None:
    """Measure nanoseconds per step and compile time of fixed-step methods. Nothing else should run meanwhile."""
    from daebench.catalogue import find_scene, schemes
    from daebench.timing import hand_written, measure

    scene = find_scene(problem, case)
    names = words(methods) if methods else list(schemes())
    rows = measure(scene, names, h=h, steps=steps, repeat=repeat)
    rows += hand_written(scene, h=h, steps=steps, repeat=repeat, rattle=next((row for row in rows if row["method"] == "rattle"), None))
    if as_json:
        print_json({"problem": problem, "case": case, "h": h, "steps": steps, "repeat": repeat, "rows": rows})
        return
    columns = ("method", "ns_per_step", "ns_watched", "ns_counted", "compile_seconds", "note")
    print_table(columns, [[_cell(row.get(column)) for column in columns] for row in rows])


def _cell(value: object) -> str:
    if value is None:
        return ""
    return f"{value:.4g}" if isinstance(value, float) else str(value)
