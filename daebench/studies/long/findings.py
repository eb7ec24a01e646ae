"""Findings on an ensemble of long runs, as it is now."""

import math
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from daebench.diagnostics.drift import Drift
from daebench.diagnostics.random_walk import Walk
from daebench.studies.long.checkpoint import Checkpoint
from daebench.studies.long.ensemble import Ensemble
from daebench.studies.long.figure import draw
from daebench.studies.long.table import Share, growth, members_table, share, windows_table
from daebench.studies.long.verdict import headline, sentence

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Findings:
    """Windows and verdict of what is kept of an ensemble."""

    ensemble: Ensemble
    """The ensemble, of which at least one member has begun."""
    members: dict[int, Checkpoint]
    """What is kept of its members."""

    @property
    def name(self) -> str:
        """The runs, in words."""
        spec = self.ensemble.spec
        return f"{spec.method}{', compensated' * spec.compensated} on {spec.problem}, case {spec.case}, h = {spec.h:g}"

    @cached_property
    def each(self) -> "pd.DataFrame":
        """Windows of each member."""
        return members_table(self.ensemble.spec, self.members)

    @cached_property
    def table(self) -> "pd.DataFrame":
        """Windows over all members."""
        return windows_table(self.each)

    @cached_property
    def growth(self) -> Walk | Drift | None:
        """How the energy error grows."""
        return growth(self.ensemble.spec, self.members)

    @property
    def verdict(self) -> str:
        """That in a sentence."""
        return sentence(self.growth, self.share)

    @property
    def share(self) -> Share:
        """Of which members, and up to when, that is."""
        return share(self.ensemble.spec, self.members, self.ensemble.members, self.ensemble.steps)

    @property
    def failures(self) -> dict[int, str]:
        """Why members stopped early."""
        return {number: checkpoint.failure for number, checkpoint in self.members.items() if checkpoint.failure}

    def write(self, out: Path) -> Path | None:
        """Write picture and tables to a folder, and return the path of the SVG; None where no member came to its first sample."""
        title = f"{headline(self.growth)}\n{self.name}"
        return draw(out, self.ensemble.stem, title, self.each, self.table) if len(self.each) else None

    def plain(self) -> dict[str, Any]:
        """Return everything as JSON has it."""
        spec = self.ensemble.spec
        return {
            **{name: value for name, value in spec.plain().items() if name != "member"},
            "steps": [checkpoint.done for checkpoint in self.members.values()],
            "seconds": [checkpoint.seconds for checkpoint in self.members.values()],
            "passages": [checkpoint.passages for checkpoint in self.members.values()],
            "failures": self.failures,
            "growth": None if self.growth is None else asdict(self.growth),
            "told_from": asdict(self.share) | {"until": None if math.isnan(self.share.until) else self.share.until},
            "exponent": getattr(self.growth, "exponent", None),
            "standard_error": getattr(self.growth, "exponent_error", None),
            "exponent_low": getattr(self.growth, "exponent_low", None),
            "exponent_high": getattr(self.growth, "exponent_high", None),
            "verdict": self.verdict,
            "windows": self.table.to_dict("records"),
        }
