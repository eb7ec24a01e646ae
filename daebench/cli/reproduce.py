"""``daebench reproduce``: compare an archive with new runs."""

from collections.abc import Sequence
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from daebench.cli.arguments import Json, Trusted, TrustedCode
from daebench.cli.console import bar, print_json, printable
from daebench.errors import BadInput, real
from daebench.methods.foreign import Trust
from daebench.records.comparison import DIFFERS, EQUAL, WITHIN
from daebench.studies.grid.reproduce import read, reproduced

if TYPE_CHECKING:
    from daebench.studies.grid.reproduce import Reproduced

MOST = 20
"""Largest number of differing runs that are named; --json has all."""


def reproduce(
    file: Annotated[Path, typer.Argument(help="Archive that daebench archive wrote.")],
    rtol: Annotated[float, typer.Option("--rtol", help="Relative tolerance.")] = 1e-6,
    atol: Annotated[float, typer.Option("--atol", help="Absolute difference that counts as round-off.")] = 1e-12,
    trust: Trusted = False,
    code: TrustedCode = None,
    json: Json = False,
) -> None:
    """Repeat the runs of an archive, and print which are equal to the bit, within tolerances, or differ; exit 1 if one differs."""
    for name, value in (("--rtol", rtol), ("--atol", atol)):
        if real(name, value) < 0:
            raise BadInput(f"{name} {value:g} must be 0 or more.", "negative-tolerance-option")
    archive = read(file, Trust.of(trust, code or ()))
    with bar(f"{file.name} again") as progress:
        runs = list(reproduced(archive, rtol=rtol, atol=atol, tell=progress))
    if json:
        print_json({"file": str(file), "made": archive.manifest["made"], "rtol": rtol, "atol": atol, "rows": list(map(_plain, runs))})
    else:
        origin = f"{file}: made on {archive.manifest['made']} by {_makers(archive.manifest['versions'])}; {archive.manifest['machine']}."
        print(printable("\n".join([origin, *_told(runs)])))
    raise typer.Exit(1 if any(run.verdict == DIFFERS for run in runs) else 0)


def _makers(versions: dict[str, str]) -> str:
    return ", ".join(f"{name} {versions[name]}" for name in ("daebench", "numpy", "numba", "llvmlite") if name in versions)


def _told(runs: "Sequence[Reproduced]") -> list[str]:
    """Return the summary: how many runs are equal, how many are within tolerances and by how much, and which differ."""
    lines = [f"equal to the bit: {sum(run.verdict == EQUAL for run in runs)} of {len(runs)} runs."]
    if within := [run for run in runs if run.verdict == WITHIN]:
        # Comparisons with NaN are false, and the result of max would depend on the order of runs.
        largest = max(within, key=lambda run: -1.0 if isnan(run.difference) else run.difference)
        lines.append(f"within tolerances: {len(within)} runs; most in {_place(largest)}.")
    differ = [run for run in runs if run.verdict == DIFFERS]
    lines += [f"differs: {_place(run)}." for run in differ[:MOST]]
    if absent := dict.fromkeys(name for run in runs for name in run.absent):
        lines.append(f"not compared, as rows of another version of daebench lack it: {', '.join(absent)}.")
    return [*lines, f"... and {len(differ) - MOST} more differ; --json has all."] if len(differ) > MOST else lines


def _place(run: "Reproduced") -> str:
    specification = run.specification
    values = f"{run.column} = {_short(run.archived)}, here {_short(run.new)}"
    return f"{specification.method} on {specification.problem}, case {specification.case}, {specification.value:g}: {values}"


def _short(value: Any) -> str:
    return f"{value:.17g}" if isinstance(value, float) else "nothing" if value is None else repr(value)[:80]


def _plain(run: "Reproduced") -> dict[str, Any]:
    specification = {name: getattr(run.specification, name) for name in ("problem", "case", "method", "value", "t_end")}
    return {
        **specification,
        "verdict": run.verdict,
        "difference": run.difference,
        "column": run.column,
        "archived": run.archived,
        "new": run.new,
        "absent": list(run.absent),
    }
