"""``daebench shadow``: the shadow Hamiltonian, which a symplectic scheme conserves."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from daebench.cli.arguments import Case, Json, OnSingular, Overwrite, Param, Problem
from daebench.cli.console import method_names, pairs, print_json, print_table, print_written, words
from daebench.cli.folder import Folder

if TYPE_CHECKING:
    from collections.abc import Sequence

    from daebench.studies.shadow.run import Shadow


def shadow(
    problem: Problem,
    methods: Annotated[str, typer.Option("--method", "--methods", help="rattle, shake, symplectic_euler, symplectic_euler_adjoint.")],
    h: Annotated[float, typer.Option("--h", help="Step size, s.")],
    t_end: Annotated[float, typer.Option("--t-end", help="End time, s.")],
    case: Case = None,
    param: Param = None,
    orders: Annotated[str, typer.Option("--orders", help="Even orders from 2 to 24.")] = "2,4,6,8,10,12",
    compare: Annotated[
        bool, typer.Option("--compare", help="Allow se, seproj and midpoint, which have no shadow Hamiltonian, for comparison.")
    ] = False,
    on_singular: OnSingular = None,
    out: Annotated[Path | None, typer.Option("--out", help="Folder for the picture and the table.")] = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> None:
    """Compute the shadow Hamiltonian along a scheme's orbit: the modified energy that it conserves, to increasing order.

    If the scheme keeps the two-form, its range decreases with the order, down to round-off, as long as the step resolves the motion.
    """
    from daebench.errors import BadInput
    from daebench.studies.shadow.run import shadow as computed

    try:
        numbers = [int(word) for word in words(orders)]
    except ValueError:
        raise BadInput(f"--orders {orders}: give even numbers separated by commas, for example 2,4,8.") from None
    folder = Folder(out, pictures=("shadow",))
    folder.check()
    asked: dict[str, Any] = {"h": h, "t_end": t_end, "case": case, "parameters": pairs("param", param or []), "orders": numbers}
    asked |= {"on_singular": on_singular}
    energies = [computed(problem, method=method, compare=compare, **asked) for method in method_names(methods)]
    written = _write(folder, energies)
    if as_json:
        print_json({"runs": [run.summary() for run in energies], "written": written})
        return
    _print(energies)
    print_written(written)


def _write(folder: Folder, energies: "Sequence[Shadow]") -> list[str]:
    """Write the picture, with the table beside it; return the paths."""
    if folder.out is None:
        return []
    from daebench.studies.shadow.figure import draw

    with folder.described(energies[0].ivp, {}) as written:
        draw(folder.out, energies)
    return written


def _print(energies: "Sequence[Shadow]") -> None:
    first = energies[0]
    print(f"{first.ivp.problem}, case {first.ivp.case}, h = {first.h:g}, to t = {first.t[-1]:g}: range (maximum - minimum) by order")
    rows = [["energy" if order == 0 else str(order), *(f"{run.ranges[order]:.3g}" for run in energies)] for order in first.ranges]
    print_table(["order", *(run.method for run in energies)], rows)
    for run in energies:
        if not run.derived:
            print(
                f"{run.method} does not claim to be symplectic on the manifold, and has no shadow Hamiltonian; it is shown for comparison."
            )
