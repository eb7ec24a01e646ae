"""Results of a plane of starts: exponents, indicators and verdicts, cell by cell."""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from daebench.diagnostics.lyapunov import CHAOTIC, CONFIDENCE, REGULAR, TOLD, UNDETERMINED, Exponents, exponents
from daebench.methods.ensemble.tangents import TangentGrowth
from daebench.runs.result import Result
from daebench.starts.box import coordinates
from daebench.studies.chaos.plane import Plane
from daebench.studies.chaos.section import Section
from daebench.systems.lazily import pandas as pd

EMPTY, STOPPED = "empty", "stopped"
"""What a cell is that has no start, or whose run did not come to its end."""


@dataclass(frozen=True)
class Chaos(Result):
    """Lyapunov exponents over a plane of starts.

    Parameters
    ----------
    plane : Plane
        The starts.
    method : str
        Name in the grammar of methods.
    growth : TangentGrowth
        Growth of a tangent vector along each.
    steps : int
        Steps of each run.
    seed : int
        Seed of the directions of the vectors.
    section : Section, optional
        Crossings of a surface, by some of the motions.
    """

    drawn_by: ClassVar[str] = "daebench.studies.chaos.figure"
    stem: ClassVar[str] = "chaos"
    fails_if: ClassVar[str] = "a run stops early"

    plane: Plane
    method: str
    growth: TangentGrowth
    steps: int
    seed: int
    section: Section | None = None

    @property
    def ivp(self) -> Any:
        """The problem, with its parameters."""
        return self.plane.members.ivp

    @property
    def t(self) -> float:
        """Time of each run, s."""
        return float(self.steps * self.plane.members.h)

    @cached_property
    def exponents(self) -> Exponents:
        """Exponents, indicators and verdicts of the starts, see :func:`daebench.diagnostics.lyapunov.exponents`."""
        return exponents(self.growth.growth, self.growth.interval)

    @property
    def exponent(self) -> NDArray[np.float64]:
        """Largest Lyapunov exponents, 1/s, shape(r, c), rows going up; NaN where there is none."""
        return np.asarray(self.plane.spread(self.exponents.exponent))

    @property
    def megno(self) -> NDArray[np.float64]:
        """Mean exponential growth factors <Y>, shape(r, c)."""
        return np.asarray(self.plane.spread(self.exponents.megno))

    @property
    def verdict(self) -> NDArray[np.str_]:
        """Verdicts, shape(r, c): chaotic, regular, undetermined, stopped or empty.

        Regular means that no exponential growth was observed in this time: an exponent below about 10/t cannot be distinguished from zero.
        """
        words = self.exponents.verdict
        return np.asarray(self.plane.spread(np.where(words == "", STOPPED, words), EMPTY))

    @property
    def table(self) -> "pd.DataFrame":
        """One row per cell: coordinates of the plane, start, exponent with its interval, <Y>, verdict, and the reason for an empty cell."""
        plane, exponents = self.plane, self.exponents
        first, second = plane.names
        table: dict[str, Any] = {"across": np.tile(plane.across, len(plane.up)), "up": np.repeat(plane.up, len(plane.across))}
        start = np.concatenate(plane.members.start, axis=1)
        for name, column in zip(coordinates(self.ivp), start.T, strict=True):
            table[name] = plane.spread(column).ravel()
        for name in ("exponent", "low", "high", "megno"):
            table[name] = plane.spread(getattr(exponents, name)).ravel()
        reasons = plane.reasons.astype("U60")
        reasons[plane.cells] = [self.growth.reason(i) for i in range(len(plane.cells))]
        frame = pd.DataFrame(table | {"verdict": self.verdict.ravel(), "why": reasons})
        return frame.drop(columns=[first, second]).rename(columns={"across": first, "up": second})

    def summary(self) -> dict[str, Any]:
        """Return a summary of the plane, for text and JSON."""
        plane, exponents = self.plane, self.exponents
        counts = Counter(self.verdict.ravel().tolist())
        chaotic = exponents.verdict == CHAOTIC
        stopped = [self.growth.reason(int(i)) for i in np.flatnonzero(self.growth.status)]
        reasons = Counter([*plane.reasons[plane.reasons != ""].tolist(), *stopped])
        return {
            "problem": self.ivp.problem,
            "case": self.ivp.case,
            "parameters": dict(self.ivp.parameters),
            "method": self.method,
            "h": float(plane.members.h),
            "steps": self.steps,
            "t": self.t,
            "starts": plane.about,
            "seed": self.seed,
            "plane": {name: [float(x[0]), float(x[-1])] for name, x in zip(plane.names, (plane.across, plane.up), strict=True)},
            "section": None if self.section is None else {self.section.name: self.section.value},
            "crossings": None if self.section is None else len(self.section.start),
            "cells": plane.reasons.size,
            **{word: counts.get(word, 0) for word in (CHAOTIC, REGULAR, UNDETERMINED, STOPPED, EMPTY)},
            "reasons": dict(reasons.most_common()),
            "exponent": self._largest(),
            "median": float(np.median(exponents.exponent[chaotic])) if np.any(chaotic) else None,
            "confidence": CONFIDENCE,
        }

    @property
    def origin(self) -> dict[str, str]:
        """How the cells were made."""
        return {"Method": self.method, "Starts": self.plane.about, "Seed": str(self.seed)}

    @property
    def status(self) -> int:
        """1 if a run stopped early."""
        return int(STOPPED in self.verdict)

    def printed(self) -> Iterator[str | Mapping[str, Any]]:
        """Yield the summary, the largest exponent with its interval, and what a regular start does not show."""
        summary = self.summary()
        left_out = ("exponent", "plane", "reasons", "median", "confidence")
        yield {name: value for name, value in summary.items() if name not in left_out} | {"reasons": summary["reasons"] or None}
        if largest := summary["exponent"]:
            place = ", ".join(f"{name} = {value:.4g}" for name, value in largest["start"].items())
            ends = f"{100 * CONFIDENCE:.0f} % interval {largest['low']:.3g} to {largest['high']:.3g}"
            yield f"largest exponent {largest['value']:.4g} 1/s ({ends}), {largest['verdict']}, at {place}"
        if summary["median"] is not None:
            yield f"median exponent of chaotic starts {summary['median']:.4g} 1/s"
        if summary[REGULAR]:
            least = f"an exponent below about {TOLD / self.t:.2g} 1/s cannot be distinguished from zero"
            yield f"regular: no exponential growth in {self.t:g} s; {least}"
        for i in self.growth.status.nonzero()[0][:1]:
            yield f"first that stopped: {self.growth.sentence(int(i))}"

    def _largest(self) -> dict[str, Any] | None:
        """Return the largest exponent of the chaotic starts with its interval and its start; of all where none is chaotic."""
        plane, exponents = self.plane, self.exponents
        chosen = np.where(exponents.verdict == CHAOTIC, exponents.exponent, -np.inf)
        if not np.any(np.isfinite(chosen)):
            chosen = np.where(np.isfinite(exponents.exponent), exponents.exponent, -np.inf)
        i = int(np.argmax(chosen))
        if not np.isfinite(chosen[i]):
            return None
        row, column = divmod(int(plane.cells[i]), len(plane.across))
        place = dict(zip(plane.names, (float(plane.across[column]), float(plane.up[row])), strict=True))
        numbers = {"value": exponents.exponent[i], "low": exponents.low[i], "high": exponents.high[i], "megno": exponents.megno[i]}
        return {name: float(x) for name, x in numbers.items()} | {"verdict": str(exponents.verdict[i]), "start": place}
