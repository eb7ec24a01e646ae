"""``daebench run --steps-out``: step sizes, orders and error estimates of IDA or CVODE, as a table and a picture."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from daebench.errors import BadInput

if TYPE_CHECKING:
    from daebench.runs.solver_steps import SolverSteps

OPTION = "--steps-out"

ENDINGS = (".csv", ".svg", ".png")

MOST_UNKNOWNS = 400
"""Largest number of unknowns with columns in a table; in Python there is no limit."""


def files(path: Path | None) -> list[Path]:
    """Return the files that are written for a path of the option."""
    return [] if path is None else [path.with_suffix(ending) for ending in ENDINGS]


def check_place(path: Path) -> None:
    """Refuse, before the run, files that cannot be written or that another command made; raise BadInput."""
    from daebench.runs import outputs
    from daebench.runs.files import check_place

    if path.suffix.lower() != ENDINGS[0]:
        raise BadInput(f"{OPTION} {path}: the file must end in {ENDINGS[0]}.")
    for file in files(path):
        check_place(file, OPTION)
        outputs.require_own(file, OPTION)


def check_size(path: Path | None, ivp: Any) -> None:
    """Refuse, before the run, a table with columns for each of very many unknowns; raise BadInput."""
    if path is not None and ivp.size > MOST_UNKNOWNS:
        raise BadInput(
            f"{OPTION} {path}: {ivp.problem} has {ivp.size} unknowns, and a table has columns for each of {MOST_UNKNOWNS} at most; "
            "in Python daebench.run(..., solver_steps=True).solver_steps has the arrays."
        )


def write(path: Path, steps: "SolverSteps", title: str) -> None:
    """Write FILE.csv, all digits, and FILE.svg and FILE.png beside it."""
    from daebench.draw.figures import save_drawing
    from daebench.draw.solver_steps import draw
    from daebench.runs.csv_files import write_numbers
    from daebench.runs.files import atomic

    with atomic(path) as scratch:
        write_numbers(scratch, steps.columns)
    save_drawing(draw(steps, title), path.parent, path.stem)
