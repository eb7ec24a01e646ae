"""Options of commands that draw starts, and ranges of coordinates and parameters in options."""

from enum import StrEnum
from typing import Annotated, Any

import typer

from daebench.errors import BadInput
from daebench.runs.texts import bounds, values


class Distribution(StrEnum):
    """Distributions of starts; a grid is not a distribution, and has a separate option."""

    neighbourhood = "neighbourhood"
    liouville = "liouville"
    energy = "energy"


Starts = Annotated[
    Distribution,
    typer.Option(
        "--starts", help="Distribution of starts: neighbourhood of the case, liouville measure in a --box, or the measure at one --energy."
    ),
]
Size = Annotated[float | None, typer.Option("--size", help="Relative size of the neighbourhood [0.01].")]
Box = Annotated[list[str] | None, typer.Option("--box", help="Bounds of a coordinate, q1=-1:1; repeatable.")]
Grid = Annotated[list[str] | None, typer.Option("--grid", help="Values of a parameter, coordinate or h, name=5:15:64.")]
Energy = Annotated[float | None, typer.Option("--energy", help="Energy of the starts; the energy of the case if left out.")]

OPTIONS = {"size": "--size", "box": "--box", "E": "--energy", "values": "--grid"}
"""Options of the settings of distributions."""


def settings_of(
    starts: str, *, size: float | None = None, box: list[str] | None = None, energy: float | None = None, grid: list[str] | None = None
) -> dict[str, Any]:
    """Return the settings of a distribution, by name; refuse settings that it does not have."""
    from daebench.starts.draw import DISTRIBUTIONS  # which computes, and the help does not

    given = {"size": size, "box": bounds("--box", box), "E": energy, "values": values("--grid", grid)}
    settings = {name: value for name, value in given.items() if value is not None}
    for name in settings:
        takers = [other for other, kind in DISTRIBUTIONS.items() if name in kind.__dataclass_fields__]
        if starts not in takers:
            where = "starts of its own" if takers == ["grid"] else f"--starts {' or '.join(takers)}"
            raise BadInput(
                f"{OPTIONS[name]} is for {where}, not for {'a --grid' if starts == 'grid' else f'--starts {starts}'}.",
                "setting-of-other-starts",
            )
    return settings
