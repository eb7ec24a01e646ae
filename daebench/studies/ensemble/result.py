"""Results of an ensemble: errors of all members along the run, their quantiles, which members stopped and why, and the picture."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from daebench.diagnostics.drift import FAILED
from daebench.draw.bands import LEVELS, column, fill
from daebench.draw.figures import BLUE, VERMILION, drawing, grid_of_axes, legend_below
from daebench.methods.ensemble.result import EnsembleRun
from daebench.runs.csv_files import write_frame
from daebench.runs.files import atomic
from daebench.runs.request import Request
from daebench.runs.result import Result, Table
from daebench.runs.trajectory import Array
from daebench.starts.box import columns
from daebench.studies.ensemble.energies import ended_members, member_energies
from daebench.studies.held_verdict import held_verdicts
from daebench.systems.lazily import pandas as pd

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Ensemble(Result):
    """The runs of n members, with N steps each, of which k states of c numbers are stored.

    Parameters
    ----------
    run : EnsembleRun
        States, ends, maxima, failures and times of all members.
    starts : str
        A sentence on the distribution of the starts.
    seed : int
        Seed of the starts.
    method : FixedStepMethod
        The method.
    request : Request
        What each member was asked.
    """

    stem: ClassVar[str] = "bands"
    ends_files: ClassVar[tuple[str, ...]] = ("starts.csv", "ends.csv")
    fails_if: ClassVar[str] = "a member stops early"

    run: EnsembleRun
    starts: str
    seed: int
    method: Any = field(repr=False)
    request: Request = field(repr=False)

    @property
    def ivp(self) -> Any:
        """The problem, with the parameters that all members have in common."""
        return self.run.members.ivp

    @property
    def t(self) -> Array:
        """Times of the stored states, s, shape(k,), or shape(k, n) where members have their own step sizes."""
        return self.run.t

    @property
    def y(self) -> Array:
        """States, shape(k, n, c): y, or (p, q); NaN where a member had stopped before."""
        return self.run.states

    @property
    def p(self) -> Array:
        """Momenta of a constrained problem, shape(k, n, d)."""
        return self._part(0)

    @property
    def q(self) -> Array:
        """Positions of a constrained problem, shape(k, n, d)."""
        return self._part(1)

    def _part(self, k: int) -> Array:
        if not self.ivp.on_manifold:
            raise AttributeError(f"{self.ivp.problem} is a Poisson system, which has states y.")
        part: Array = self.ivp.vectors(self.run.states)[k]
        return part

    def along(self, name: str) -> Array:
        """Return a function of the state for each stored state of each member, shape(k, n, ...).

        Parameters
        ----------
        name : str
            "H", "g", "Gv", "casimirs" or another name of ``daebench/schemes/kernels/language.py``; of "g" the positions alone are given.
        """
        return np.array([self.run.members.of_states(name, states) for states in self.run.states])

    @cached_property
    def energy_errors(self) -> Array:
        """H - H0, in the unit of H, shape(k, n)."""
        energies = self.along("H")
        errors: Array = energies - energies[0]
        return errors

    @cached_property
    def constraint_errors(self) -> Array:
        """Largest modulus of g, or of the changes of the Casimirs of a Poisson system that has some, shape(k, n)."""
        values = self.along(self.kept)
        errors: Array = np.max(np.abs(values - values[0] if self.kept == "casimirs" else values), axis=2)
        return errors

    @cached_property
    def spread(self) -> Array:
        """Distance of positions, or of y, from their mean over the members that go on, as a root of the mean square, shape(k,)."""
        x = self.ivp.vectors(self.run.states)[-1]
        with np.errstate(all="ignore"):
            mean = np.nansum(x, axis=1, keepdims=True) / np.sum(~np.isnan(x), axis=1, keepdims=True)  # NaN where no member goes on
            squares = np.sum((x - mean) ** 2, axis=2)
            distance: Array = np.sqrt(np.nansum(squares, axis=1) / np.sum(~np.isnan(squares), axis=1))
        return distance

    @cached_property
    def verdicts(self) -> NDArray[np.str_]:
        """Verdict on the energy of each member, shape(n,), see ``daebench.studies.held_verdict``."""
        words = np.full(len(self.run.members), FAILED, dtype="U12")
        ended = ended_members(self.run)
        if len(ended):
            parts = member_energies(self.run, ended)["energy_verdict"]
            words[ended] = held_verdicts(parts, self.run, ended, self.method, self.request)
        return words

    def quantiles(self, values: Array, levels: Sequence[float] = LEVELS) -> Array:
        """Return quantiles over the members that go on, shape(levels, ...), of numbers of shape(..., n); NaN where there is none."""
        numbers = np.where(np.isfinite(values), values, np.nan)
        some = np.any(np.isfinite(numbers), axis=-1)
        numbers = np.where(some[..., None], numbers, 0.0)
        result: Array = np.where(some, np.nanquantile(numbers, levels, axis=-1), np.nan)
        return result

    @property
    def reasons(self) -> dict[str, int]:
        """Number of members that stopped early, by reason in two or three words."""
        return dict(Counter(self.run.reason(int(i)) for i in self.run.failed).most_common())

    @property
    def table(self) -> "pd.DataFrame":
        """Quantiles in time, see :attr:`bands`."""
        return self.bands

    @property
    def bands(self) -> "pd.DataFrame":
        """Quantiles in time, one row per stored state: of H - H0, of |g| or the Casimirs; the spread and the number of active members."""
        t = self.t if self.t.ndim == 1 else self.t.mean(axis=1)
        table = {"t": t, "members": np.count_nonzero(np.isfinite(self.energy_errors), axis=1)}
        shown = {"energy": self.energy_errors} | ({self.kept: self.constraint_errors} if self.kept else {})
        for name, errors in shown.items():
            quantiles = self.quantiles(errors)
            table |= {column(level, name): row for level, row in zip(LEVELS, quantiles, strict=True)}
        return pd.DataFrame(table | {"spread": self.spread})

    @property
    def kept(self) -> str:
        """Conserved quantity other than the energy: "g", "casimirs", or "" for a Poisson system without Casimir functions."""
        return "g" if self.ivp.on_manifold else "casimirs" if self.ivp.casimirs else ""

    def members(self, states: Array) -> dict[str, Any]:
        """Return a table of states, one row per member: q1, ... p1, ... or y1, ..., and the parameters that differ between members."""
        some, ivp = self.run.members, self.ivp
        h = np.broadcast_to(some.h, (len(some),))
        table = {"member": np.arange(len(some)), "h": h} | {name: np.asarray(values) for name, values in some.parameters.items()}
        positions_first = sorted(columns(ivp).items(), key=lambda item: item[0].startswith("p"))
        return table | {name: states[:, k] for name, k in positions_first}

    @property
    def start_table(self) -> "pd.DataFrame":
        """Starts, one row per member."""
        return pd.DataFrame(self.members(self.run.states[0]))

    @property
    def end_table(self) -> "pd.DataFrame":
        """Last good states, one row per member, with steps and time, monitored maxima, and why it stopped if it did."""
        run = self.run
        table = self.members(run.ends) | {"steps": run.steps, "t": run.steps * np.broadcast_to(run.members.h, (len(run.members),))}
        table |= {f"max_{name}": values for name, values in run.maxima.items()}
        return pd.DataFrame(table | {"failure": [run.reason(i) for i in range(len(run.members))]})

    @property
    def origin(self) -> dict[str, str]:
        """How the members were made."""
        return {"Method": self.run.method, "Starts": self.starts, "Seed": str(self.seed)}

    @property
    def status(self) -> int:
        """1 if a member stopped early."""
        return int(len(self.run.failed) > 0)

    @classmethod
    def outputs(cls, **asked: Any) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Return the tables of starts and ends, and the stem of the picture."""
        return cls.ends_files, (cls.stem,)

    def write(self, folder: Path) -> list[Path]:
        """Write tables of starts and ends, and the picture with its table, into a folder; return the paths."""
        for name, table in zip(self.ends_files, (self.start_table, self.end_table), strict=True):
            with atomic(folder / name) as scratch:
                write_frame(scratch, table)
        return [*(folder / name for name in self.ends_files), *super().write(folder)]

    def plot(self) -> "Figure":
        """Return the picture of the ensemble."""
        return figure(self)

    def printed(self) -> Iterator[str | Table | Mapping[str, Any]]:
        """Yield the summary, quantiles of the largest errors, and the first member that stopped for each reason."""
        summary = self.summary()
        quantiles, failures = summary.pop("quantiles"), summary["failures"]
        yield summary | {"failures": failures or None, "varied": summary["varied"] or None}
        if quantiles:
            rows = [[f"max {name}", *(f"{value:.3g}" for value in row.values())] for name, row in quantiles.items()]
            yield Table(["quantile over members", *map(str, LEVELS)], rows)
        for reason in failures:
            first = next(int(i) for i in self.run.failed if self.run.reason(int(i)) == reason)
            yield f"member {first}: {self.run.failure(first)}"

    def summary(self) -> dict[str, Any]:
        """Return the summary of an ensemble, for text and JSON."""
        run, ivp = self.run, self.ivp
        h = np.asarray(run.members.h)
        maxima = {name: dict(zip(map(str, LEVELS), self.quantiles(values).tolist(), strict=True)) for name, values in run.maxima.items()}
        return {
            "problem": ivp.problem,
            "case": ivp.case,
            "parameters": dict(ivp.parameters),
            "varied": {name: [float(np.min(x)), float(np.max(x))] for name, x in run.members.parameters.items()},
            "method": run.method,
            "h": float(h) if h.ndim == 0 else [float(h.min()), float(h.max())],
            "starts": self.starts,
            "seed": self.seed,
            "members": len(run.members),
            "steps": int(run.index[-1]),
            "t": float(np.max(run.index[-1] * h)),
            "failed": len(run.failed),
            "failures": self.reasons,
            "verdicts": dict(Counter(self.verdicts.tolist()).most_common()),
            "quantiles": maxima,
            "seconds": run.seconds,
            "compile_seconds": run.compile_seconds,
            "lanes": run.lanes,
        }


TITLES = {"g": ("constraints", "largest $|g|$"), "casimirs": ("Casimirs", "largest change")}
"""Title and label of the panel of what the structure keeps."""

MOST_REASONS = 3
"""Reasons of failures that the title names."""


def figure(ensemble: Ensemble) -> "Figure":
    """Return the picture of an ensemble."""
    bands, conserved = ensemble.table, ensemble.kept
    with drawing():
        drawn, axes = grid_of_axes(1, 2 + bool(conserved), 3.3, sharex=True, x="time $t$ [s]")
        _bands(axes[0, 0], bands, "energy", VERMILION)
        axes[0, 0].set(title="energy error", ylabel="$H - H_0$ [unit of $H$]")
        if conserved:
            _bands(axes[0, 1], bands, conserved, BLUE)
            axes[0, 1].set(title=TITLES[conserved][0], ylabel=TITLES[conserved][1])
            if (bands[column(0.05, conserved)][1:] > 0).all():
                axes[0, 1].set_yscale("log")
        _line(axes[0, -1], bands["t"], bands["spread"])
        axes[0, -1].set(title="spread", ylabel="rms distance from the mean")
        legend_below(drawn, axes[0, 0], 3)
        drawn.suptitle(_title(ensemble), fontsize="medium")
    return drawn


def _title(ensemble: Ensemble) -> str:
    """Return the title, the answer first: how many of the members came to their end."""
    run, total = ensemble.run, len(ensemble.run.members)
    reasons = list(ensemble.reasons.items())
    named = ", ".join(f"{count} {reason}" for reason, count in reasons[:MOST_REASONS])
    failed = f"{len(run.failed)} of {total} members stopped early: {named}" if reasons else f"all {total} members came to their end"
    return f"{run.method} on {ensemble.ivp.problem}, case {ensemble.ivp.case}: {failed}"


def _bands(axis: Any, bands: "pd.DataFrame", name: str, color: str) -> None:
    """Draw bands of quantiles, and the median."""
    fill(axis, bands["t"], lambda level: bands[column(level, name)], color, of="members")
    axis.plot(bands["t"], bands[column(0.5, name)], color=color, linewidth=1.2, label="median")


def _line(axis: Any, t: Any, spread: Any) -> None:
    axis.plot(t, spread, color="black")
    if np.nanmax(spread) > 0:
        axis.set_yscale("log")
