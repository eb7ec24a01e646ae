"""``daebench reference compare``: the agreement of a trajectory of another program with a reference."""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from daebench.cli.arguments import Json
from daebench.cli.console import print_json, print_table
from daebench.cli.reference.arguments import Folder
from daebench.reference.check.file_agreement import agreement

if TYPE_CHECKING:
    from daebench.reference.check.file_agreement import FileAgreement, Place


def compare(
    file: Annotated[Path, typer.Argument(help="CSV file with a header: t and any of q1, ..., p1, ..., lam1, ..., or y1, ...")],
    name: Annotated[str, typer.Option("--with", help="Name of a reference, PROBLEM-CASE.")],
    within: Annotated[
        float, typer.Option("--within", help="Fraction of the size of the motion beyond which a trajectory has departed.")
    ] = 0.01,
    between: Annotated[int, typer.Option("--between", help="Largest number of compared rows between stored times, evenly chosen.")] = 500,
    folder: Folder = None,
    as_json: Json = False,
) -> None:
    """Print how many digits of a trajectory agree with a reference, when it departs, and in which component."""
    agreed = agreement(file, name, folder, within=within, between=between)
    if as_json:
        print_json(asdict(agreed) | {"digits": agreed.digits, "worst": agreed.worst.name})
        return
    _print(agreed)


def _print(agreed: "FileAgreement") -> None:
    rows = [[x.name, f"{x.digits:.1f}", f"{x.error:.2g}", f"{x.t:g}", f"{x.size:.3g}", f"{x.allowed:.1f}"] for x in agreed.columns]
    columns = ["", "digits", "largest error", "at t =", "size", "digits that reference and file allow"]
    print_table(columns, rows, f"{agreed.file} with {agreed.reference} up to t = {agreed.t_end:g}")
    print_table(["fewer digits than", "from t =", "first in"], [[str(k), *_place(x)] for k, x in agreed.lost.items()])
    print(f"Agrees to {agreed.digits:.1f} digits, least in {agreed.worst.name}; {_left(agreed)}.")
    print(f"Rounding of a single state leaves {agreed.possible:.1f} digits by t = {agreed.t_end:g} in double precision.")
    print(f"Compared: {agreed.compared} of {agreed.rows} rows{_rest(agreed)}.")
    if agreed.missing:
        print(f"Not in the file: {', '.join(agreed.missing)}.")
    if agreed.ignored:
        print(f"Columns left aside: {', '.join(map(repr, agreed.ignored))}.")


def _place(place: "Place | None") -> list[str]:
    return ["never", ""] if place is None else [f"{place.t:g}", place.column]


def _left(agreed: "FileAgreement") -> str:
    if agreed.left is None:
        return f"never further than {agreed.within:g} of the motion"
    late = ", where no run in double precision can follow" if agreed.left.t >= agreed.double_horizon else ""
    return f"leaves at t = {agreed.left.t:g} in {agreed.left.column}, by more than {agreed.within:g} of the motion{late}"


def _rest(agreed: "FileAgreement") -> str:
    """Print which rows were not compared."""
    rest = []
    if agreed.passed_over:
        rest.append(f"{agreed.passed_over} between stored times passed over (see --between)")
    if agreed.beyond:
        rest.append(f"{agreed.beyond} beyond the horizon at t = {agreed.horizon:g}")
    return f"; {', '.join(rest)}" if rest else ""
