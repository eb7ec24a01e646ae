"""Runs of one method from many starts that are drawn, as one piece of a study: kept as one row of a store with lists."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

from daebench.errors import BadInput, whole
from daebench.studies.grid.run_specification import GridRun

MEASURED = ("q", "p", "y")
"""What is measured of them: errors of parts of the state."""


@dataclass(frozen=True, kw_only=True)
class StartRuns(GridRun):
    """Runs of one method with one step size or tolerance from many starts.

    The errors are those at ``outputs`` equidistant times, the same for all methods.
    """

    members: int
    """Number of starts; fewer of them are the first of more."""
    distribution: str = "neighbourhood"
    """What they are drawn from, see :func:`daebench.starts.draw.draw_starts`."""
    settings: str = "{}"
    """Its settings, as JSON."""
    seed: int = 0
    """Seeds them."""
    finest: float
    """Smallest step size of the study, s, of which a reference takes a third where heyoka does not make it."""

    def __post_init__(self) -> None:
        if whole("members", self.members) < 1:
            raise BadInput(f"members = {self.members} must be at least 1.")
        if others := set(self.metrics) - set(MEASURED):
            raise BadInput(f"{', '.join(sorted(others))} of runs from many starts is not measured; there are {', '.join(MEASURED)}.")

    @property
    def drawn(self) -> dict[str, Any]:
        """Settings of the distribution by name."""
        settings: dict[str, Any] = json.loads(self.settings)
        return settings

    @property
    def count(self) -> int:
        """How many runs these are."""
        return self.members

    def of_any_kind(self) -> Self:
        """Return the runs without what compiles nothing anew."""
        return replace(super().of_any_kind(), members=1, distribution="", settings="", seed=0, finest=1.0)

    def rows(self, row: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
        """Give the row of each run, of what was computed for all of them."""
        for i in range(self.members):
            yield {"member": i} | {name: value[i] if isinstance(value, list) else value for name, value in row.items()}
