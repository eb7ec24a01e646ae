"""``daebench tolerance-for``: the tolerance of a constraint solver for a given energy drift."""

from typing import Annotated

import typer

from daebench.cli.arguments import Case, Json, OnSingular, Param, Precision, Problem
from daebench.cli.console import bar, pairs, print_json, print_table


def tolerance_for(
    problem: Problem,
    drift: Annotated[float, typer.Option("--drift", help="Largest change of the energy, in standard deviations of the kinetic energy.")],
    h: Annotated[float, typer.Option("--h", help="Step size, s.")],
    t_end: Annotated[float, typer.Option("--t-end", help="Time of each run, s.")],
    method: Annotated[str, typer.Option("--method", help="A scheme with a tolerance, for example rattle_ilves.")] = "rattle_gauss_seidel",
    case: Case = None,
    param: Param = None,
    on_singular: OnSingular = None,
    precision: Precision = "float64",
    as_json: Json = False,
) -> None:
    """Find the loosest tolerance of constraints for which the energy drift is small enough; exit 1 if there is none."""
    from daebench.studies.tolerance_for import tolerance_for as made

    with bar(f"{method} on {problem}") as progress:
        found = made(
            problem,
            drift=drift,
            h=h,
            t_end=t_end,
            method=method,
            case=case,
            parameters=pairs("param", param or []),
            on_singular=on_singular,
            precision=precision,
            progress=progress,
        )
    if as_json:
        print_json(found.summary())
    else:
        rows = [[f"{r.tolerance:g}", r.drift.verdict, f"{r.ratio:.2g}", f"{r.rate:.2g}", f"{r.rounds:.3g}"] for r in found.tried]
        print_table(["tolerance", "energy", "drift / std(T), at most", "per s and degree of freedom", "rounds a step"], rows)
        print("no tolerance tried is small enough" if found.tolerance is None else f"tolerance = {found.tolerance:g}")
        if found.fortuitous:
            print(f"small enough too, but not with every tighter tolerance: {', '.join(f'{x:g}' for x in found.fortuitous)}")
    raise typer.Exit(1 if found.tolerance is None else 0)
