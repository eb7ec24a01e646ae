"""Options of commands that draw starts, and ranges of coordinates and parameters in options."""

from collections.abc import Iterable
from enum import StrEnum
from typing import Annotated, Any

import typer

from daebench.cli.console import number
from daebench.errors import BadInput


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
Energy = Annotated[float | None, typer.Option("--energy", help="Energy of the starts; the energy of the case if left out.")]

OPTIONS = {"size": "--size", "box": "--box", "E": "--energy", "values": "--grid"}
"""Options of the settings of distributions."""

MOST_VALUES = 2**20
"""Largest number of values of one name in a grid."""

FORMS = {2: "name=lo:hi", 3: "name=lo:hi:number"}
"""Forms of a range, by the number of its entries."""


def settings_of(
    starts: str, *, size: float | None = None, box: list[str] | None = None, energy: float | None = None, grid: list[str] | None = None
) -> dict[str, Any]:
    """Return the settings of a distribution, by name; refuse settings that it does not have."""
    from daebench.starts.draw import DISTRIBUTIONS

    given = {"size": size, "box": bounds("--box", box), "E": energy, "values": values("--grid", grid)}
    settings = {name: value for name, value in given.items() if value is not None}
    for name in settings:
        takers = [other for other, kind in DISTRIBUTIONS.items() if name in kind.__dataclass_fields__]
        if starts not in takers:
            where = "starts of its own" if takers == ["grid"] else f"--starts {' or '.join(takers)}"
            raise BadInput(f"{OPTIONS[name]} is for {where}, not for {'a --grid' if starts == 'grid' else f'--starts {starts}'}.")
    return settings


def bounds(option: str, given: list[str] | None) -> dict[str, tuple[float, float]] | None:
    """Return bounds by name, given as name=lo:hi."""
    return {name: (lo, hi) for name, (lo, hi) in ranges(option, given or [], 2).items()} or None


def values(option: str, given: list[str] | None) -> dict[str, list[float]] | None:
    """Return equidistant values by name, given as name=lo:hi:number."""
    chosen = {}
    for name, (lo, hi, count) in ranges(option, given or [], 3).items():
        if not (1 <= count <= MOST_VALUES and count == int(count)):
            raise BadInput(f"{option} {name}: {count:g} must be a whole number of values, from 1 to {MOST_VALUES}.")
        chosen[name] = [lo + (hi - lo) * k / max(1, int(count) - 1) for k in range(int(count))]
    return chosen or None


def ranges(option: str, given: Iterable[str], count: int) -> dict[str, list[float]]:
    """Return a number of values by name, given as name=1:2."""
    chosen: dict[str, list[float]] = {}
    for text in given:
        name, equals, numbers = (part.strip() for part in text.partition("="))
        if not name or not equals or numbers.count(":") != count - 1:
            raise BadInput(f"{option} {text!r} must be of the form {FORMS[count]}.")
        if name in chosen:
            raise BadInput(f"{option} names {name} twice; give it once.")
        chosen[name] = [number(f"{option} {name}", part) for part in numbers.split(":")]
    return chosen
