"""``daebench bench``: time per step and time to the first step, best of several, beside hand-written C if there is a compiler."""

from typing import Annotated, Any

import typer

from daebench.cli.arguments import Algebra, Anyway, Case, Json, OnSingular, Param
from daebench.cli.benchmarks import MEASUREMENTS, cell
from daebench.cli.console import bar, methods_if_given, print_json, print_table
from daebench.cli.integer import whole
from daebench.errors import BadInput
from daebench.methods.catalogue import schemes
from daebench.methods.initial_value_problem import initial_value_problem
from daebench.methods.registry import poisson_registry
from daebench.runs.texts import pairs
from daebench.studies.start_up import first_step, numpy_alone
from daebench.studies.timers import hand_written, measure

COLUMNS = ("method", "ns_per_step", "ns_watched", "ns_counted", "cold_seconds", "warm_seconds", "note")
Solvers = Annotated[bool, typer.Option("--solvers", help="Time IDA instead: compiled callbacks, a program in C, Python callbacks.")]
Gradients = Annotated[bool, typer.Option("--gradients", help="Time gradients of runs of RATTLE instead, beside the runs alone.")]
Ensemble = Annotated[
    bool, typer.Option("--ensemble", help="Time members of an ensemble instead: in lanes, alone, a program in C, heyoka in batches.")
]
Rows = Annotated[bool, typer.Option("--rows", help="Time steps of long chains per link instead, and of a problem in time.")]

Generated = Annotated[bool, typer.Option("--generated", help="Time generated C instead, beside machine code.")]

STARTS = 3
"""Number of new processes, of which the best counts."""


def bench(
    problem: Annotated[
        str, typer.Option("--problem", help="Name of a problem, or path of a problem file (ends in .py); it is executed.")
    ] = "spherical_pendulum",
    case: Case = None,
    param: Param = None,
    algebra: Algebra = "",
    methods: Annotated[str | None, typer.Option("--methods", help="Fixed-step methods, comma-separated; all if left out.")] = None,
    h: Annotated[float, typer.Option("--h", help="Step size.")] = 0.01,
    steps: Annotated[int, typer.Option("--steps", parser=whole, help="Steps of one timed run.")] = 300_000,
    repeat: Annotated[int, typer.Option("--repeat", help="Number of runs, of which the best counts.")] = 7,
    anyway: Anyway = False,
    on_singular: OnSingular = None,
    solvers: Solvers = False,
    gradients: Gradients = False,
    ensemble: Ensemble = False,
    rows: Rows = False,
    generated: Generated = False,
    as_json: Json = False,
) -> None:
    """Measure nanoseconds per step of fixed-step methods, and seconds to the first step with an empty and with a full cache."""
    others = {"--solvers": solvers, "--gradients": gradients, "--ensemble": ensemble, "--rows": rows, "--generated": generated}
    if asked := [name for name, wanted in others.items() if wanted]:
        if len(asked) > 1:
            raise BadInput(f"{' and '.join(asked)} are different measurements; give one at a time.", "measurements-combined")
        MEASUREMENTS[asked[0]](steps, repeat, as_json=as_json)
        return

    more: dict[str, Any] = {"parameters": pairs("param", param or []), "algebra": algebra, "on_singular": on_singular}
    ivp = initial_value_problem(problem, case, **more)
    more["anyway"] = anyway
    measured = _steps(problem, ivp, methods, h, steps, repeat, more)
    if as_json:
        print_json({"problem": problem, "case": ivp.case, "h": h, "steps": steps, "repeat": repeat, "rows": measured})
        return
    print_table(COLUMNS, [[cell(row.get(column)) for column in COLUMNS] for row in measured])


def _steps(problem: str, ivp: Any, methods: str | None, h: float, steps: int, repeat: int, more: dict[str, Any]) -> list[dict[str, Any]]:
    """Return one row per method, and the rows of programs in C and of NumPy alone."""
    registry = schemes() if ivp.facts.KIND == "constrained" else poisson_registry()
    names = methods_if_given(methods) or list(registry)
    rows = []
    with bar("bench") as progress:
        for k, name in enumerate(names):
            progress(k / len(names), name)
            row = measure(ivp, name, h=h, steps=steps, repeat=repeat, anyway=more["anyway"])
            if "ns_per_step" in row:
                row["cold_seconds"], row["warm_seconds"] = first_step(problem, ivp.case, name, h, repeat=STARTS, **more)
            rows.append(row)
        rows += hand_written(ivp, rows, h=h, steps=steps, repeat=repeat)
        rows.append({"method": "NumPy alone", "warm_seconds": numpy_alone(repeat=STARTS)})
    return rows
