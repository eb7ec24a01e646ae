"""Runs that differ in a parameter alone, as one piece of a study: made together, and kept as one row of a store with lists."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

from daebench.errors import BadInput
from daebench.studies.grid.run_specification import GridRun

MEASURED = {"energy": ("energy_error", "energy_size", "energy_scale", "energy_verdict"), "manifold": ("g", "Gv"), "jump": ("jump",)}
"""What is measured of them, by the name of the metric, and the columns of it that are kept."""

ALWAYS = ("steps", "failure")
"""Columns that are kept in any case."""


@dataclass(frozen=True, kw_only=True)
class ParameterRuns(GridRun):
    """Runs of one method with one step size over values of a parameter."""

    varied: str
    """Name of the parameter."""
    values: tuple[float, ...]
    """Its values, one for each run."""

    def __post_init__(self) -> None:
        if others := set(self.metrics) - set(MEASURED):
            raise BadInput(f"{', '.join(sorted(others))} of runs that are made together is not measured; there are {', '.join(MEASURED)}.")

    @property
    def count(self) -> int:
        """How many runs these are."""
        return len(self.values)

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns with an entry for each run."""
        return (*ALWAYS, *(name for metric in self.metrics for name in MEASURED[metric]))

    def of_any_kind(self) -> Self:
        """Return the runs without what compiles nothing anew."""
        return replace(super().of_any_kind(), varied="", values=())

    def run(self, i: int) -> GridRun:
        """Return one of the runs by itself."""
        fields = {name: value for name, value in vars(self).items() if name in GridRun.__dataclass_fields__}
        return GridRun(**fields | {"parameters": (*self.parameters, (self.varied, self.values[i]))})

    def rows(self, row: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
        """Give the row of each run, of what was computed for all of them."""
        common = {name: value for name, value in row.items() if name not in self.columns}
        for i, value in enumerate(self.values):
            yield {**common, self.varied: value, **{name: row[name][i] for name in self.columns}}
