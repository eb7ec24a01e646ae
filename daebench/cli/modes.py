"""``daebench modes``: natural frequencies, and the spectrum of each formulation at an equilibrium."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from daebench.cli.arguments import Case, Json, OnSingular, Overwrite, Param, Problem
from daebench.cli.console import methods_if_given, pairs, print_json, print_table, print_written
from daebench.cli.folder import Folder

if TYPE_CHECKING:
    from daebench.studies.modes.run import Modes


def modes(
    problem: Problem,
    case: Case = None,
    param: Param = None,
    alpha: Annotated[float | None, typer.Option("--alpha", help="alpha of Baumgarte's stabilisation, 1/s [10].")] = None,
    beta: Annotated[float | None, typer.Option("--beta", help="beta of it, 1/s [10].")] = None,
    stiff: Annotated[float | None, typer.Option("--stiff", help="Stiffness of a penalty in place of the constraints.")] = None,
    methods: Annotated[
        str | None, typer.Option("--methods", "--method", help="Fixed-step methods whose step limit is computed; some if left out.")
    ] = None,
    on_singular: OnSingular = None,
    out: Annotated[Path | None, typer.Option("--out", help="Folder for the picture and the table of eigenvalues.")] = None,
    overwrite: Overwrite = False,
    as_json: Json = False,
) -> None:
    """Find an equilibrium, and the small oscillations of each formulation about it.

    The equilibrium is found by a descent of the potential energy from the case. Zeros are the directions in which a formulation drifts.
    """
    from daebench.studies.modes.run import modes as made

    folder = Folder(out, pictures=("modes",))
    folder.check()
    asked: dict[str, Any] = {"alpha": alpha, "beta": beta, "stiff": stiff, "methods": methods_if_given(methods)}
    asked |= {"on_singular": on_singular}
    found = made(problem, case=case, parameters=pairs("param", param or []), **asked)
    written = _write(folder, found)
    if as_json:
        print_json(found.summary() | {"written": written})
        return
    _print(found)
    print_written(written)


def _write(folder: Folder, found: "Modes") -> list[str]:
    """Write the picture, with the table of eigenvalues beside it; return the paths."""
    if folder.out is None:
        return []
    from daebench.studies.modes.figure import draw

    with folder.described(found.ivp, {}) as written:
        draw(folder.out, found)
    return written


def _print(found: "Modes") -> None:
    summary = found.summary()
    print(f"{found.ivp.problem} at rest: q = {', '.join(f'{x:.6g}' for x in found.rest.q)}")
    frequencies = [[f"{k + 1}", *_frequency(square)] for k, square in enumerate(map(float, found.squares))]
    print_table(["mode", "rad/s", "Hz", "period s"], frequencies)
    rows = [
        [name, str(len(row["eigenvalues"])), str(row["zeros"]), f"{row['largest_real']:.3g}", f"{row['fastest']:.6g}"]
        for name, row in summary["formulations"].items()
    ]
    print_table(["formulation", "eigenvalues", "zeros", "largest real part", "largest modulus 1/s"], rows)
    steps = [[name, "none" if h is None else f"{h:.4g}"] for name, h in summary["steps"].items()]
    print_table(["method", "step limit s"], steps)
    for name, why in found.left_out.items():
        print(f"no limit of {name}: {why}")


def _frequency(square: float) -> list[str]:
    """Return a frequency as text; if its square is not positive, there is no oscillation."""
    if square <= 0:
        return ["free" if square == 0 else f"grows by e in {1 / (-square) ** 0.5:.3g} s", "", ""]
    w = square**0.5
    return [f"{w:.10g}", f"{w / 6.283185307179586:.6g}", f"{6.283185307179586 / w:.6g}"]
